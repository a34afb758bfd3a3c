//! One entrance to all methods.

use crate::data::IdentificationData;
use crate::estimate::Estimate;
use crate::options::{IdentifyError, Method, Options};
use crate::{aid, automatic, instrumental, output_error};
use backseat_core::dynamics::VehicleParameters;

/// Identifies a vehicle from its log; `progress` receives the share done, 0 to 1.
///
/// # Errors
/// If the prior is unusable or the data determine nothing.
pub fn identify(
    method: Method,
    data: &IdentificationData,
    prior: &VehicleParameters,
    options: &Options,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Estimate, IdentifyError> {
    prior.validate().map_err(IdentifyError::Prior)?;
    match method {
        Method::AidOnline => aid::online(data, prior, options),
        Method::Aid => aid::offline(data, prior, options, progress),
        Method::Iv => instrumental::identify(data, prior, options, progress),
        Method::OutputError => output_error::identify(data, prior, options, progress),
        Method::Auto => automatic::identify(data, prior, options, progress),
    }
}
