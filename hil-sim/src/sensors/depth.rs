//! Pressure sensor.

use super::Sampler;
use crate::noise::{Colour, Colouring, NoiseKind, SensorClass};
use crate::observation::ObservationKind;
use crate::rng::{Source, Stream};
use crate::scenario;
use crate::truth::VehicleTruth;

/// Depth of the sensor with noise and bias.
#[derive(Clone, Debug)]
pub(super) struct Depth {
    pub(super) sampler: Sampler,
    random: Stream,
    sigma_m: f64,
    colouring: Option<Colouring<1>>,
    bias_m: f64,
    /// Measured / true − 1.
    ratio: f64,
    arm_m: [f64; 3],
}

impl Depth {
    pub(super) fn new(
        settings: &scenario::Depth,
        declared_sigma_m: f64,
        [bias_m, ratio]: [f64; 2],
        arm_m: [f64; 3],
        noise: NoiseKind,
        seed: u64,
    ) -> Self {
        let mixture = noise.mixture(SensorClass::Depth, Colour::DEPTH, seed);
        Self {
            sampler: Sampler::new(settings.fitted, settings.rate_hz, settings.offset_s),
            random: Stream::new(seed, Source::Depth),
            sigma_m: mixture.size * settings.sigma_m.unwrap_or(declared_sigma_m),
            colouring: mixture.colouring(seed, Source::DepthColour),
            bias_m,
            ratio,
            arm_m,
        }
    }

    pub(super) fn sample(&mut self, vehicle: &VehicleTruth) -> Option<ObservationKind> {
        self.sampler.due(vehicle.time_us).then(|| {
            let mut noise = self.random.normals::<1>(self.sigma_m);
            if let Some(colouring) = &mut self.colouring {
                noise = colouring.mix(noise, self.sigma_m, vehicle.time_us);
            }
            let below_m = vehicle.position_at(self.arm_m)[2];
            ObservationKind::Depth { depth_m: (1.0 + self.ratio) * below_m + self.bias_m + noise[0] }
        })
    }
}
