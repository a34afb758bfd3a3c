//! The sensors: true state in, noisy observations out, each at its own rate and from its own
//! random stream.

mod ahrs;
mod depth;
mod dvl;
mod gnss;

use crate::observation::{Observation, ObservationKind};
use crate::scenario::Scenario;
use crate::scenario::effects::Instruments;
use crate::ship::ShipTruth;
use crate::truth::VehicleTruth;

/// When a sensor samples: at the first integration step not before offset + n / rate.
#[derive(Clone, Debug)]
struct Sampler {
    rate_hz: f64,
    offset_s: f64,
    taken: u64,
    next_us: u64,
}

impl Sampler {
    fn new(fitted: bool, rate_hz: f64, offset_s: f64) -> Self {
        let next_us = if fitted { (offset_s * 1.0e6).round() as u64 } else { u64::MAX };
        Self { rate_hz, offset_s, taken: 0, next_us }
    }

    /// Whether a sample is due; takes it.
    fn due(&mut self, time_us: u64) -> bool {
        let due = time_us >= self.next_us;
        if due {
            self.taken += 1;
            self.next_us = ((self.offset_s + self.taken as f64 / self.rate_hz) * 1.0e6).round() as u64;
        }
        due
    }
}

/// All sensors of vehicle and ship.
#[derive(Clone, Debug)]
pub struct Sensors {
    depth: depth::Depth,
    ahrs: ahrs::Ahrs,
    dvl: dvl::Dvl,
    gnss: gnss::VehicleGnss,
    ship_gnss: gnss::ShipGnss,
}

impl Sensors {
    /// The sensors of a scenario.
    #[must_use]
    pub fn new(scenario: &Scenario, instruments: &Instruments) -> Self {
        let settings = &scenario.settings;
        let (seed, sensors, kind, noise) =
            (settings.seed, &settings.sensors, settings.noise, &scenario.vehicle.sensors);
        Self {
            depth: depth::Depth::new(&sensors.depth, noise.depth_m, instruments.depth_m, kind, seed),
            ahrs: ahrs::Ahrs::new(&sensors.ahrs, [noise.attitude_rad, noise.rates_radps], instruments, kind, seed),
            dvl: dvl::Dvl::new(
                &sensors.dvl,
                noise.dvl_mps,
                instruments,
                settings.environment.bottom_depth_m,
                kind,
                seed,
            ),
            gnss: gnss::VehicleGnss::new(&sensors.gnss, noise.gnss_m, kind, seed),
            ship_gnss: gnss::ShipGnss::new(&sensors.ship_gnss, noise.ship_gnss_m, kind, seed),
        }
    }

    /// Whether any sensor samples now.
    #[must_use]
    pub fn any_due(&self, time_us: u64) -> bool {
        let next_us = [
            self.depth.sampler.next_us,
            self.ahrs.sampler.next_us,
            self.dvl.sampler.next_us,
            self.gnss.sampler.next_us,
            self.ship_gnss.sampler.next_us,
        ];
        next_us.iter().any(|&next_us| time_us >= next_us)
    }

    /// Hands out what is sampled now, always in the same order.
    pub fn observe(&mut self, vehicle: &VehicleTruth, ship: &ShipTruth, sink: &mut impl FnMut(&Observation)) {
        let time_us = vehicle.time_us;
        let kinds: [Option<ObservationKind>; 5] = [
            self.depth.sample(vehicle),
            self.ahrs.sample(vehicle),
            self.dvl.sample(vehicle),
            self.gnss.sample(vehicle),
            self.ship_gnss.sample(time_us, ship),
        ];
        for kind in kinds.into_iter().flatten() {
            sink(&Observation { time_us, kind });
        }
    }
}
