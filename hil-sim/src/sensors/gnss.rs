//! GNSS receivers: the vehicle's, which is deaf under water, and the ship's.

use super::Sampler;
use crate::noise::{Colour, Colouring, NoiseKind, SensorClass};
use crate::observation::{GnssFix, ObservationKind};
use crate::rng::{Source, Stream};
use crate::scenario;
use crate::ship::ShipTruth;
use crate::truth::VehicleTruth;

/// Position of the surfaced vehicle.
#[derive(Clone, Debug)]
pub(super) struct VehicleGnss {
    pub(super) sampler: Sampler,
    random: Stream,
    sigma_m: f64,
    max_depth_m: f64,
    arm_m: [f64; 3],
    colouring: Option<Colouring<2>>,
}

impl VehicleGnss {
    pub(super) fn new(
        settings: &scenario::Gnss,
        diameter_m: f64,
        declared_sigma_m: f64,
        arm_m: [f64; 3],
        noise: NoiseKind,
        seed: u64,
    ) -> Self {
        let mixture = noise.mixture(SensorClass::Gnss, Colour::GNSS, seed);
        Self {
            sampler: Sampler::new(settings.fitted, settings.rate_hz, settings.offset_s),
            random: Stream::new(seed, Source::VehicleGnss),
            sigma_m: mixture.size * settings.sigma_m.unwrap_or(declared_sigma_m),
            // the centre of a thick hull that floats lies deeper
            max_depth_m: settings.max_depth_m.max(diameter_m),
            arm_m,
            colouring: mixture.colouring(seed, Source::VehicleGnssColour),
        }
    }

    pub(super) fn sample(&mut self, vehicle: &VehicleTruth) -> Option<ObservationKind> {
        self.sampler.due(vehicle.time_us).then(|| {
            let mut noise = self.random.normals::<2>(self.sigma_m);
            if let Some(colouring) = &mut self.colouring {
                noise = colouring.mix(noise, self.sigma_m, vehicle.time_us);
            }
            let z = vehicle.state[2];
            let [x, y, _] = vehicle.position_at(self.arm_m);
            let [north, east, _] = vehicle.velocity_at(self.arm_m);
            let fix = (z < self.max_depth_m).then(|| GnssFix {
                time_us: vehicle.time_us,
                position_m: [x + noise[0], y + noise[1]],
                speed_mps: libm::hypot(north, east),
                course_rad: libm::atan2(east, north).rem_euclid(std::f64::consts::TAU),
            });
            ObservationKind::VehicleGnss { fix }
        })
    }
}

/// Position of the ship.
#[derive(Clone, Debug)]
pub(super) struct ShipGnss {
    pub(super) sampler: Sampler,
    random: Stream,
    sigma_m: f64,
}

impl ShipGnss {
    pub(super) fn new(settings: &scenario::ShipGnss, declared_sigma_m: f64, noise: NoiseKind, seed: u64) -> Self {
        Self {
            sampler: Sampler::new(settings.fitted, settings.rate_hz, settings.offset_s),
            random: Stream::new(seed, Source::ShipGnss),
            sigma_m: noise.factor() * settings.sigma_m.unwrap_or(declared_sigma_m),
        }
    }

    pub(super) fn sample(&mut self, time_us: u64, ship: &ShipTruth) -> Option<ObservationKind> {
        self.sampler.due(time_us).then(|| {
            let noise = self.random.normals::<2>(self.sigma_m);
            ObservationKind::ShipGnss { position_m: core::array::from_fn(|i| ship.position_m[i] + noise[i]) }
        })
    }
}
