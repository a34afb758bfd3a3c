//! Doppler velocity log, bottom track.

use super::Sampler;
use crate::observation::ObservationKind;
use crate::rng::{Source, Stream};
use crate::scenario::{self, Effects};
use crate::world::VehicleTruth;

/// Velocity over ground in body axes and altitude over a flat bottom, while it sees the bottom.
#[derive(Clone, Debug)]
pub(super) struct Dvl {
    pub(super) sampler: Sampler,
    random: Stream,
    sigma_mps: f64,
    settings: scenario::Dvl,
    bottom_depth_m: f64,
    /// (1 + scale) Ry(pitch)ᵀ Rz(yaw)ᵀ: true body velocity to what is measured.
    mounting: [[f64; 3]; 3],
}

impl Dvl {
    pub(super) fn new(
        settings: &scenario::Dvl,
        declared_sigma_mps: f64,
        effects: &Effects,
        bottom_depth_m: f64,
        seed: u64,
    ) -> Self {
        let gain = 1.0 + effects.dvl_scale.ratio;
        let (sy, cy) = libm::sincos(effects.dvl_misalignment.yaw_rad);
        let (sp, cp) = libm::sincos(effects.dvl_misalignment.pitch_rad);
        let mounting = [[cp * cy, cp * sy, -sp], [-sy, cy, 0.0], [sp * cy, sp * sy, cp]];
        Self {
            sampler: Sampler::new(settings.fitted, settings.rate_hz, settings.offset_s),
            random: Stream::new(seed, Source::Dvl),
            sigma_mps: settings.sigma_mps.unwrap_or(declared_sigma_mps),
            settings: *settings,
            bottom_depth_m,
            mounting: mounting.map(|row| row.map(|element| gain * element)),
        }
    }

    pub(super) fn sample(&mut self, vehicle: &VehicleTruth) -> Option<ObservationKind> {
        self.sampler.due(vehicle.time_us).then(|| {
            let noise = self.random.normals::<3>(self.sigma_mps);
            let altitude_noise = self.settings.altitude_sigma_m * self.random.normal();
            let altitude_m = self.bottom_depth_m - vehicle.state[2];
            if !(self.settings.min_altitude_m..=self.settings.max_altitude_m).contains(&altitude_m) {
                return ObservationKind::Dvl { velocity_mps: None, altitude_m: None };
            }
            let v = vehicle.velocity_over_ground_mps;
            ObservationKind::Dvl {
                velocity_mps: Some(core::array::from_fn(|i| {
                    let m = &self.mounting[i];
                    m[0] * v[0] + m[1] * v[1] + m[2] * v[2] + noise[i]
                })),
                altitude_m: Some(altitude_m + altitude_noise),
            }
        })
    }
}
