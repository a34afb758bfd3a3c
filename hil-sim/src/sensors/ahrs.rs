//! Attitude and heading reference with rate gyros.

use super::Sampler;
use crate::observation::ObservationKind;
use crate::rng::{Source, Stream};
use crate::scenario::{self, HeadingBias};
use crate::world::VehicleTruth;

/// Euler angles and body rates with white noise; the compass may have a hard-iron error.
#[derive(Clone, Debug)]
pub(super) struct Ahrs {
    pub(super) sampler: Sampler,
    random: Stream,
    attitude_sigma_rad: f64,
    rates_sigma_radps: f64,
    heading_bias: HeadingBias,
}

impl Ahrs {
    pub(super) fn new(settings: &scenario::Ahrs, declared: [f64; 2], heading_bias: HeadingBias, seed: u64) -> Self {
        Self {
            sampler: Sampler::new(settings.fitted, settings.rate_hz, settings.offset_s),
            random: Stream::new(seed, Source::Ahrs),
            attitude_sigma_rad: settings.attitude_sigma_rad.unwrap_or(declared[0]),
            rates_sigma_radps: settings.rates_sigma_radps.unwrap_or(declared[1]),
            heading_bias,
        }
    }

    pub(super) fn sample(&mut self, vehicle: &VehicleTruth) -> Option<ObservationKind> {
        self.sampler.due(vehicle.time_us).then(|| {
            let [_, _, _, roll, pitch, heading, _, _, _, p, q, r] = vehicle.state;
            let (sin, cos) = libm::sincos(heading);
            let bias = self.heading_bias.const_rad + self.heading_bias.sin_rad * sin + self.heading_bias.cos_rad * cos;
            let angle = self.random.normals::<3>(self.attitude_sigma_rad);
            let rate = self.random.normals::<3>(self.rates_sigma_radps);
            ObservationKind::Ahrs {
                euler_rad: [
                    roll + angle[0],
                    pitch + angle[1],
                    libm::remainder(heading + bias + angle[2], std::f64::consts::TAU),
                ],
                rates_radps: [p + rate[0], q + rate[1], r + rate[2]],
            }
        })
    }
}
