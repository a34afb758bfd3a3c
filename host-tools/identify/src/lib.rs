//! Identification of a vehicle's parameters from a log, on the host.
//!
//! Everything starts with [`IdentificationData`], a log resampled at 10 Hz, and a prior; [`identify`] gives an [`Estimate`] by
//! a [`Method`], and [`validate`] says what a vehicle predicts.
//!
//! ```text
//! data         the log at 10 Hz, in stretches without gaps      aid       the board's identifier, and refined offline
//! parameters   θ (21), d26 and d35 as one vector                nullspace NBLS of the thesis, and its noise-whitened form
//! simulation   free run with sensitivities to θ and start       instrumental  weak form, instruments from the model
//! smoothing    zero-phase filter; the model's own trajectory    output_error  prediction error, Gauss-Newton
//! validation   open-loop prediction, held-out comparison        automatic     climbs them, each step on held-out data
//! declared     effects of the vehicle file: taken out first
//! estimate     what a method says                               acceleration  4.2.2: from an AHRS's specific force
//! ```

pub mod acceleration;
pub mod aid;
mod automatic;
pub mod data;
mod declared_effects;
pub mod estimate;
mod excitation;
pub mod instrumental;
mod method;
pub mod nullspace;
pub mod output_error;
pub mod parameters;
pub mod simulation;
pub mod smoothing;
pub mod surge_yaw;
pub mod validation;

pub use data::{IdentificationData, Sample};
pub use declared_effects::fold_into_plant;
pub use estimate::{Estimate, EstimatedParameter, Step, Unseen};
pub use method::{IdentifyError, Method, Options, identify};
pub use validation::{Validation, validate};
