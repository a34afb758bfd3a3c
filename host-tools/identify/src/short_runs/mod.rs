//! A torpedo's dynamics from many short runs without rates, fixes or a fast DVL: output error with multiple shooting.
//!
//! ```text
//! recording   a log as runs, stretches and windows      unknowns   what is fitted, with its prior
//! model       the board's dynamics with further terms   fit        Gauss-Newton over all windows and their starts
//! spread      how far the values may be off, by runs
//! start       the state at the start of a window        predict    open-loop predictions against what was measured
//! stops       the propeller's torque, where the motor stops
//! ```

pub mod fit;
pub mod model;
pub mod predict;
pub mod recording;
mod spread;
pub mod start;
pub mod stops;
#[cfg(test)]
mod tests;
pub mod unknowns;

pub use fit::{Fit, Problem, Starts};
pub use model::RunModel;
pub use recording::{Run, runs};
pub use spread::Gaussian;
pub use unknowns::{Draft, Unknown};
