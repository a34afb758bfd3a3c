//! The sensors: true state in, noisy observations out, each at its own rate and from its own
//! random stream.

mod ahrs;
mod depth;
mod dvl;
mod gnss;

use crate::observation::{Observation, ObservationKind};
use crate::scenario::effects::Instruments;
use crate::scenario::{Installation, Scenario};
use crate::ship::ShipTruth;
use crate::truth::VehicleTruth;
use std::collections::VecDeque;

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
    /// How late depth, AHRS, DVL and the GNSS receivers are, µs.
    delays_us: [u64; 5],
    /// What is on its way, in order of arrival.
    late: VecDeque<(u64, ObservationKind)>,
}

impl Sensors {
    /// The sensors of a scenario.
    pub fn new(scenario: &Scenario, instruments: &Instruments, installation: &Installation) -> Self {
        let settings = &scenario.settings;
        let (seed, sensors, kind, noise) =
            (settings.seed, &settings.sensors, settings.noise, &scenario.vehicle.sensors);
        Self {
            depth: depth::Depth::new(
                &sensors.depth,
                noise.depth_m,
                [instruments.depth_m, instruments.depth_ratio],
                installation.depth_arm_m,
                kind,
                seed,
            ),
            ahrs: ahrs::Ahrs::new(&sensors.ahrs, noise, instruments, installation.ahrs_turn_rad, kind, seed),
            dvl: dvl::Dvl::new(
                &sensors.dvl,
                noise.dvl_mps,
                instruments,
                installation,
                settings.environment.bottom_depth_m,
                kind,
                seed,
            ),
            gnss: gnss::VehicleGnss::new(
                &sensors.gnss,
                scenario.vehicle.parameters.diameter_m,
                noise.gnss_m,
                installation.gnss_arm_m,
                kind,
                seed,
            ),
            ship_gnss: gnss::ShipGnss::new(&sensors.ship_gnss, noise.ship_gnss_m, kind, seed),
            delays_us: [
                installation.depth_delay_s,
                installation.ahrs_delay_s,
                installation.dvl_delay_s,
                installation.gnss_delay_s,
                0.0,
            ]
            .map(|delay_s| (delay_s * 1.0e6).round() as u64),
            late: VecDeque::new(),
        }
    }

    /// Whether any sensor samples now, or a late sample arrives.
    pub fn any_due(&self, time_us: u64) -> bool {
        let next_us = [
            self.depth.sampler.next_us,
            self.ahrs.sampler.next_us,
            self.dvl.sampler.next_us,
            self.gnss.sampler.next_us,
            self.ship_gnss.sampler.next_us,
            self.late.front().map_or(u64::MAX, |(due_us, _)| *due_us),
        ];
        next_us.iter().any(|&next_us| time_us >= next_us)
    }

    /// Hands out late samples that arrive now, at the time of their arrival, and what is sampled now, always in the
    /// same order.
    pub fn observe(&mut self, vehicle: &VehicleTruth, ship: &ShipTruth, sink: &mut impl FnMut(&Observation)) {
        let time_us = vehicle.time_us;
        let kinds: [Option<ObservationKind>; 5] = [
            self.depth.sample(vehicle),
            self.ahrs.sample(vehicle),
            self.dvl.sample(vehicle),
            self.gnss.sample(vehicle),
            self.ship_gnss.sample(time_us, ship),
        ];
        for (kind, delay_us) in kinds.into_iter().zip(self.delays_us) {
            let Some(kind) = kind else { continue };
            if delay_us == 0 {
                sink(&Observation { time_us, kind });
            } else {
                let due_us = time_us + delay_us;
                let place = self.late.partition_point(|(other_us, _)| *other_us <= due_us);
                self.late.insert(place, (due_us, kind));
            }
        }
        while let Some((due_us, kind)) = self.late.pop_front_if(|(due_us, _)| *due_us <= time_us) {
            sink(&Observation { time_us: due_us, kind });
        }
    }
}
