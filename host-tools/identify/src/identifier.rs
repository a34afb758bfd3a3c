//! The board's adaptive identifier over a log.

use crate::data::IdentificationData;
use crate::options::{IdentifyError, Options};
use backseat_core::dynamics::VehicleParameters;
use backseat_core::identification::{IdentificationConfig, Identifier};
use backseat_logs::interrupt;

/// The identifier's settings for a log.
#[must_use]
pub fn config(options: &Options) -> IdentificationConfig {
    IdentificationConfig {
        scale: options.scale,
        box_ratio: options.box_ratio,
        velocity_noise: options.velocity_noise,
        roll_pitch_noise_rad: options.roll_pitch_noise_rad,
        ..IdentificationConfig::DEFAULT
    }
}

/// Runs the board's identifier over the samples.
///
/// # Errors
/// If it refuses prior or settings.
pub fn run_identifier(
    data: &IdentificationData,
    prior: &VehicleParameters,
    options: &Options,
) -> Result<Box<Identifier>, IdentifyError> {
    let mut identifier = Box::new(Identifier::new());
    identifier.configure(&config(options), prior).map_err(IdentifyError::Settings)?;
    for (sample, since) in data.with_input_since() {
        interrupt::check();
        identifier.sample(sample.time_us, &sample.attitude, &sample.velocity, &since);
    }
    Ok(identifier)
}
