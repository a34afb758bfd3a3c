//! One flight: world, devices and backseat on one clock.

mod lockstep;
mod record;
mod setup;

pub use lockstep::fly;
pub use record::{FlightLog, ModeChange, Sample};
pub use setup::board_parameters;

use crate::backseat::BackseatError;
use backseat_data::DataError;

/// Length of a lock-step, µs.
pub const STEP_US: u64 = 100_000;

/// Why a flight ended before its time.
#[derive(Debug, thiserror::Error)]
pub enum FlightError {
    /// The backseat.
    #[error(transparent)]
    Backseat(#[from] BackseatError),
    /// A file.
    #[error(transparent)]
    Data(#[from] DataError),
}
