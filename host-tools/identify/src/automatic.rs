//! To come.

use crate::data::IdentificationData;
use crate::estimate::Estimate;
use crate::method::{IdentifyError, Options};
use backseat_core::dynamics::VehicleParameters;

pub(crate) fn identify(
    _: &IdentificationData,
    _: &VehicleParameters,
    _: &Options,
    _: &(dyn Fn(f64) + Sync),
) -> Result<Estimate, IdentifyError> {
    Err(IdentifyError::Degenerate("not yet".into()))
}
