//! Logs without fins and propeller: each kind has the plainest model that it supports.
//!
//! A log model predicts scalars from what was logged and from the effects' sizes; it needs no filter. Its residuals are
//! taken as first-order Gauss-Markov noise (a receiver's wander, waves, eddies), whose scatter and correlation time are
//! estimated from the log with every known column fitted. Differencing neighbours by it whitens rows and slopes alike.
//! From there on all is as with the vehicle's dynamics: the same [selection](crate::selection), alternatives, terms
//! outside the catalogue that remain, and data that judge.

pub mod dead_reckoning;
mod describe;
mod events;
mod evidence;
mod fit;
mod held_readings;
mod layout;
mod model;
mod noise;
pub mod reference_velocity;
mod runs;
mod scoring;
mod selection;

pub use describe::NotNamed;
pub use layout::Layout;
pub use model::{Entry, LogModel, Measures, OutsideTerm, Row, Unexplained, catalogue_range};
pub use noise::Noise;
pub use runs::{MOST_RUNS, WINDS};
pub use selection::{LogModelDiagnosis, run};
