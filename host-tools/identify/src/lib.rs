//! Identification of a vehicle's parameters from a log, on the host.
//!
//! Everything starts with [`IdentificationData`], a log resampled at 10 Hz, and a prior; [`identify`] gives an
//! [`Estimate`] by a [`Method`], and [`validate`] gives the vehicle's prediction errors.
//!
//! ```text
//! sample, data      the log at 10 Hz, in stretches without gaps      identifier    the board's adaptive identifier over a log
//! parameters        θ (21), d26 and d35 as one vector                aid           the same laws offline, without its delay
//! simulation        free run with sensitivities to θ and start       output_error  prediction error, Gauss-Newton
//! smoothing         zero-phase filter; the model's own trajectory    instrumental  weak form, instruments from the model
//! validation        open-loop prediction, held-out comparison        automatic     tries them, each step on held-out data
//! declared_effects  effects of the vehicle file, removed first
//! estimate          the result of a method                           excitation    what the motion shows of each parameter
//! learnt            the covariance as a robust filter's prior
//! options, method   settings, and one entrance to all methods        plan          the mission with most information
//! timing            when fins and propeller follow their commands    bordered      normal equations, the starts taken out
//! ```

pub mod aid;
mod automatic;
mod bordered;
pub mod data;
mod declared_effects;
pub mod estimate;
mod excitation;
pub mod identifier;
pub mod instrumental;
mod learnt;
mod method;
mod options;
pub mod output_error;
pub mod parameters;
pub mod plan;
mod sample;
pub mod short_runs;
pub mod simulation;
pub mod smoothing;
pub mod timing;
pub mod validation;

pub use data::{IdentificationData, LoggedInputs};
pub use declared_effects::fold_into_plant;
pub use estimate::{Estimate, EstimatedParameter, Step, Unseen};
pub use learnt::learnt;
pub use method::identify;
pub use options::{IdentifyError, Method, Options};
pub use sample::{PERIOD_S, PeriodInput, Sample, mean};
pub use timing::TimingEstimate;
pub use validation::{Validation, nothing_changes, validate};
