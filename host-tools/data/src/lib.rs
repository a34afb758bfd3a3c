//! What a lab's computer does with a vehicle's data: vehicle files, vehicle logs, importers for
//! other people's logs, the flight filter over a log, and the report.
//!
//! Errors of the readers name the file, the line, the column and what was expected there.

pub mod commands;
pub mod console;
pub mod dead_reckoning;
pub mod error;
pub mod filter;
pub mod importers;
pub mod inputs;
pub mod log;
pub mod manoeuvring;
pub mod output;
pub mod report;
pub mod session;
pub mod settings;
pub mod smoother;
pub mod stats;
pub mod track;
pub mod vehicle_file;

pub use error::DataError;
pub use log::{Column, Log, LogRow, LogWriter, STATE_COLUMNS, Truth, TruthRow, TruthWriter};
pub use manoeuvring::ManoeuvringModel;
pub use vehicle_file::{BoardFile, BoardParameter, VehicleEffects, VehicleFile, parameters_page};
