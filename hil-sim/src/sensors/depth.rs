//! Pressure sensor.

use super::Sampler;
use crate::observation::ObservationKind;
use crate::rng::{Source, Stream};
use crate::scenario;
use crate::world::VehicleTruth;

/// Depth of the centre of gravity with white noise.
#[derive(Clone, Debug)]
pub(super) struct Depth {
    pub(super) sampler: Sampler,
    random: Stream,
    sigma_m: f64,
}

impl Depth {
    pub(super) fn new(settings: &scenario::Depth, declared_sigma_m: f64, seed: u64) -> Self {
        Self {
            sampler: Sampler::new(settings.fitted, settings.rate_hz, settings.offset_s),
            random: Stream::new(seed, Source::Depth),
            sigma_m: settings.sigma_m.unwrap_or(declared_sigma_m),
        }
    }

    pub(super) fn sample(&mut self, vehicle: &VehicleTruth) -> Option<ObservationKind> {
        self.sampler
            .due(vehicle.time_us)
            .then(|| ObservationKind::Depth { depth_m: vehicle.state[2] + self.sigma_m * self.random.normal() })
    }
}
