//! Faults of sensor readings.

use super::{Active, Fault, FaultKind, SensorFault, active};
use crate::observation::{Observation, ObservationKind};
use std::f64::consts::PI;

/// Distorts observations.
#[derive(Clone, Debug)]
pub struct SensorFaults {
    faults: Vec<Active<SensorFault>>,
    /// The last reading of the AHRS before it froze.
    last_ahrs: Option<([f64; 3], [f64; 3])>,
}

impl SensorFaults {
    /// Those of a scenario.
    pub fn new(faults: &[Fault], seed: u64) -> Self {
        let pick = |kind: &FaultKind| if let FaultKind::Sensor(fault) = kind { Some(*fault) } else { None };
        Self { faults: active(faults, seed, pick), last_ahrs: None }
    }

    /// When the AHRS' timer rolls over, µs.
    pub fn rollover_us(&self) -> Option<u64> {
        let rollover = self.faults.iter().find(|active| active.what == SensorFault::AhrsTimerRollover);
        rollover.map(|active| active.fault.from_us)
    }

    /// What is sensed instead.
    pub fn distort(&mut self, observation: &mut Observation) {
        let mut frozen = false;
        for Active { what, fault, random } in &mut self.faults {
            if !fault.acts(observation.time_us) {
                continue;
            }
            match (*what, &mut observation.kind) {
                (SensorFault::DvlNoLock, ObservationKind::Dvl { velocity_mps, altitude_m }) => {
                    *velocity_mps = None;
                    *altitude_m = None;
                }
                (SensorFault::DvlFalseLock { velocity_mps: wrong }, ObservationKind::Dvl { velocity_mps, .. }) => {
                    /// One sigma of the reading, m/s: as with bottom lock.
                    const SIGMA_MPS: f64 = 0.01;
                    let noise = random.normals::<3>(SIGMA_MPS);
                    *velocity_mps = Some(core::array::from_fn(|i| wrong[i] + noise[i]));
                }
                (SensorFault::AhrsFrozen, ObservationKind::Ahrs { .. }) => frozen = true,
                (SensorFault::AhrsNan, ObservationKind::Ahrs { euler_rad, rates_radps }) => {
                    *euler_rad = [f64::NAN; 3];
                    *rates_radps = [f64::NAN; 3];
                }
                (SensorFault::AhrsUpsideDown, ObservationKind::Ahrs { euler_rad, .. }) => {
                    euler_rad[0] = (euler_rad[0] + 2.0 * PI).rem_euclid(2.0 * PI) - PI;
                }
                (SensorFault::DepthJump { depth_m: by_m }, ObservationKind::Depth { depth_m }) => *depth_m += by_m,
                (SensorFault::DepthDrift { rate_mps }, ObservationKind::Depth { depth_m }) => {
                    *depth_m += rate_mps * (observation.time_us - fault.from_us) as f64 * 1e-6;
                }
                (SensorFault::DepthFactor { factor }, ObservationKind::Depth { depth_m }) => *depth_m *= factor,
                (SensorFault::GnssJump { offset_m }, ObservationKind::VehicleGnss { fix: Some(fix) }) => {
                    shift(&mut fix.position_m, offset_m);
                }
                (SensorFault::GnssDrift { drift_mps }, ObservationKind::VehicleGnss { fix: Some(fix) }) => {
                    let since_s = (observation.time_us - fault.from_us) as f64 * 1e-6;
                    shift(&mut fix.position_m, drift_mps.map(|rate_mps| rate_mps * since_s));
                }
                (SensorFault::GnssWander(wander), ObservationKind::VehicleGnss { fix: Some(fix) }) => {
                    shift(&mut fix.position_m, wander.offset_m(observation.time_us - fault.from_us));
                }
                (SensorFault::ShipGnssJump { offset_m }, ObservationKind::ShipGnss { position_m }) => {
                    shift(position_m, offset_m);
                }
                (SensorFault::HeadingJump { heading_rad }, ObservationKind::Ahrs { euler_rad, .. }) => {
                    turn(&mut euler_rad[2], heading_rad);
                }
                (SensorFault::HeadingDrift { rate_radps }, ObservationKind::Ahrs { euler_rad, .. }) => {
                    turn(&mut euler_rad[2], rate_radps * (observation.time_us - fault.from_us) as f64 * 1e-6);
                }
                _ => {}
            }
        }
        if let ObservationKind::Ahrs { euler_rad, rates_radps } = &mut observation.kind {
            match self.last_ahrs {
                Some((euler, rates)) if frozen => (*euler_rad, *rates_radps) = (euler, rates),
                _ => self.last_ahrs = Some((*euler_rad, *rates_radps)),
            }
        }
    }
}

fn shift(position_m: &mut [f64; 2], offset_m: [f64; 2]) {
    for (place, offset) in position_m.iter_mut().zip(offset_m) {
        *place += offset;
    }
}

/// Adds to a heading of -π to π.
fn turn(heading_rad: &mut f64, by_rad: f64) {
    *heading_rad = (*heading_rad + by_rad + PI).rem_euclid(2.0 * PI) - PI;
}
