//! What a vehicle recorded and what is declared of it: vehicle logs, importers for other people's logs, session files,
//! vehicle files.
//!
//! Errors of the readers name the file, the line, the column and what was expected there.

pub mod data_sheets;
pub mod error;
pub mod geomagnetism;
pub mod importers;
pub mod interrupt;
pub mod kinds;
pub mod log;
pub mod output;
pub mod plausible_noise;
pub mod session;
pub mod settings;
pub mod short_runs;
pub mod stats;
pub mod textbook;
pub mod vehicle_file;

pub use error::{DataError, with_hint};
pub use log::{Column, Log, LogRow, LogWriter, STATE_COLUMNS, Truth, TruthRow, TruthWriter};
pub use short_runs::ShortRuns;
pub use vehicle_file::{BoardFile, BoardParameter, VehicleEffects, VehicleFile, parameters_page};
