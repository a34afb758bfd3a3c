//! Adaptive identification (AID) of the plant and actuator parameters, chapter 4.
//!
//! One [`Identifier`] takes attitude, body velocity, fins and propeller at 10 Hz and adapts θ̂, 21 parameters, from a
//! prior to the measured motion; it reads no clock, never allocates and never panics.
//!
//! ```text
//! theta       the parameters: order, names, and as a vehicle     aid         the laws and Heun's step
//! regressor   Y with Y θ = h, shared with offline methods        projection  the box around the prior
//! filter      low-pass and equal delay of all                    excitation  gains; what is seen, collinear, frozen
//! config      settings                                           drift       estimates against their own noise
//! identifier  all of it, one call a sample                     model_comparison  which of several sets predicts better
//! fault       a fin, drag, thrust, water: which one changed
//! ```
//!
//! Convergence: the predicted motion converges, a single parameter only as far as the motion separates it from the
//! others. m44 and β1 (nearly collinear with d11) hardly ever converge.

pub mod aid;
mod config;
mod drift;
mod excitation;
mod fault;
mod filter;
mod identifier;
mod projection;
pub mod regressor;
pub mod theta;

pub use config::{ConfigError, IdentificationConfig, Scale};
pub use drift::DriftMonitor;
pub use excitation::{Excitation, ParameterExcitation, Visibility};
pub use fault::{Diagnosis, FaultCause, FaultMonitor, FaultState};
pub use filter::{DELAY, Measured, PreFilter};
pub use identifier::{Identifier, Report, SampleOutcome};
pub use projection::ParameterBox;
pub use theta::{PARAMETERS, Theta};

/// Noise of an acceleration averaged over a second with the sensors of Table 4.13, m/s² and rad/s², and an allowance
/// for the error of the model, about a thousandth of the acceleration: what a motion is worth before it is flown.
pub const ACCELERATION_NOISE: [f64; 6] = [0.015, 0.015, 0.015, 0.003, 0.003, 0.003];
