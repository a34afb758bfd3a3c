//! Doppler velocity log, bottom track.

use super::Sampler;
use crate::noise::{Colour, Colouring, NoiseKind, SensorClass};
use crate::observation::ObservationKind;
use crate::rng::{Source, Stream};
use crate::scenario;
use crate::scenario::effects::Instruments;
use crate::truth::{VehicleTruth, mounting};

/// Velocity over ground in body axes and altitude over a flat bottom, while it sees the bottom.
#[derive(Clone, Debug)]
pub(super) struct Dvl {
    pub(super) sampler: Sampler,
    random: Stream,
    sigma_mps: f64,
    settings: scenario::Dvl,
    bottom_depth_m: f64,
    instruments: Instruments,
    /// Where it is.
    lever_m: [f64; 3],
    /// How it is turned, if it is.
    turn: Option<mounting::Rotation>,
    colouring: Option<Colouring<3>>,
}

impl Dvl {
    pub(super) fn new(
        settings: &scenario::Dvl,
        declared_sigma_mps: f64,
        instruments: &Instruments,
        installation: &scenario::Installation,
        bottom_depth_m: f64,
        noise: NoiseKind,
        seed: u64,
    ) -> Self {
        let mixture = noise.mixture(SensorClass::Dvl, Colour::DVL, seed);
        Self {
            sampler: Sampler::new(settings.fitted, settings.rate_hz, settings.offset_s),
            random: Stream::new(seed, Source::Dvl),
            sigma_mps: mixture.size * settings.sigma_mps.unwrap_or(declared_sigma_mps),
            settings: *settings,
            bottom_depth_m,
            instruments: *instruments,
            lever_m: std::array::from_fn(|i| installation.dvl_arm_m[i] + instruments.dvl_lever_m[i]),
            turn: (installation.dvl_turn_rad != [0.0; 3]).then(|| mounting::rotation(installation.dvl_turn_rad)),
            colouring: mixture.colouring(seed, Source::DvlColour),
        }
    }

    pub(super) fn sample(&mut self, vehicle: &VehicleTruth) -> Option<ObservationKind> {
        self.sampler.due(vehicle.time_us).then(|| {
            let mut noise = self.random.normals::<3>(self.sigma_mps);
            if let Some(colouring) = &mut self.colouring {
                noise = colouring.mix(noise, self.sigma_mps, vehicle.time_us);
            }
            let altitude_noise = self.settings.altitude_sigma_m * self.random.normal();
            let altitude_m = self.bottom_depth_m - vehicle.state[2];
            let lost = self.settings.until_s.is_some_and(|until_s| vehicle.time_us as f64 * 1e-6 > until_s);
            if lost || !(self.settings.min_altitude_m..=self.settings.max_altitude_m).contains(&altitude_m) {
                return ObservationKind::Dvl { velocity_mps: None, altitude_m: None };
            }
            let ([u, v, w], [x, y, z]) = (vehicle.velocity_over_ground_mps, self.lever_m);
            let [.., p, q, r] = vehicle.state;
            let v = [u + q * z - r * y, v + r * x - p * z, w + p * y - q * x];
            let v = self.turn.as_ref().map_or(v, |turn| mounting::into_frame(turn, v));
            let mounting = self.mounting(vehicle.time_us as f64 * 1e-6);
            ObservationKind::Dvl {
                velocity_mps: Some(core::array::from_fn(|i| {
                    let m = mounting[i];
                    m[0] * v[0] + m[1] * v[1] + m[2] * v[2] + noise[i]
                })),
                altitude_m: Some(altitude_m + altitude_noise),
            }
        })
    }

    /// (1 + scale) Ry(pitch)ᵀ Rz(yaw)ᵀ: true body velocity to what is measured.
    fn mounting(&self, time_s: f64) -> [[f64; 3]; 3] {
        let Instruments { dvl_ratio, dvl_mounting_rad: [yaw, pitch], dvl_change: [scaled, turned], .. } =
            self.instruments;
        let gain = 1.0 + dvl_ratio + scaled.at(time_s);
        let ((sy, cy), (sp, cp)) = (libm::sincos(yaw + turned.at(time_s)), libm::sincos(pitch));
        [[cp * cy, cp * sy, -sp], [-sy, cy, 0.0], [sp * cy, sp * sy, cp]].map(|row| row.map(|element| gain * element))
    }
}
