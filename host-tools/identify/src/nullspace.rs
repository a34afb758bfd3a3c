//! Nullspace least squares.

use crate::data::IdentificationData;
use crate::estimate::Estimate;
use crate::method::{IdentifyError, Options};
use backseat_core::dynamics::VehicleParameters;

pub(crate) fn nbls(_: &IdentificationData, _: &VehicleParameters, _: &Options) -> Result<Estimate, IdentifyError> {
    Err(IdentifyError::Degenerate("not yet".into()))
}

pub(crate) fn gtls(_: &IdentificationData, _: &VehicleParameters, _: &Options) -> Result<Estimate, IdentifyError> {
    Err(IdentifyError::Degenerate("not yet".into()))
}
