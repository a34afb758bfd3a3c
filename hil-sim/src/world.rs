//! The simulated world: vehicle, ship, water, sensors and sound on one clock.

use crate::observation::Observation;
use crate::scenario::Scenario;

/// What the actuators are asked to do; servo and propeller follow at their own pace.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ActuatorTargets {
    /// Propeller speed, rad/s.
    pub propeller_radps: f64,
    /// Fin angles [top, bottom, port, starboard], rad, signs as in `backseat_core::dynamics`.
    pub fins_rad: [f64; 4],
}

/// The true state of the vehicle at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehicleTruth {
    /// µs since the start of the scenario.
    pub time_us: u64,
    /// [x y z | φ θ ψ | u v w | p q r]: NED, Euler angles, velocity through the water, rates; SI.
    pub state: [f64; 12],
    /// Velocity over ground in NED, m/s.
    pub velocity_ned_mps: [f64; 3],
    /// Current at the vehicle, north and east, m/s.
    pub current_mps: [f64; 2],
    /// What the actuators really do.
    pub actuators: ActuatorTargets,
}

/// The true state of the ship at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShipTruth {
    /// North, east, m.
    pub position_m: [f64; 2],
    /// North, east, m/s.
    pub velocity_mps: [f64; 2],
}

/// The simulated world.
#[derive(Clone, Debug)]
pub struct World {
    time_us: u64,
}

impl World {
    /// The world of a scenario at time zero. `seed` replaces the scenario's own where given.
    #[must_use]
    pub fn new(_scenario: &Scenario) -> Self {
        todo!()
    }

    /// µs since the start of the scenario.
    #[must_use]
    pub fn time_us(&self) -> u64 {
        self.time_us
    }

    /// New targets for servos and propeller, from `time_us` on (at once where that is past).
    /// Times must not decrease from call to call.
    pub fn set_actuator_targets(&mut self, _time_us: u64, _targets: ActuatorTargets) {
        todo!()
    }

    /// Moves the world to the last integration step not after `to_us` and hands out everything
    /// observed on the way, in order of time (an observation at `to_us` itself included).
    pub fn advance(&mut self, _to_us: u64, _sink: &mut impl FnMut(&Observation)) {
        todo!()
    }

    /// The true state of the vehicle now.
    #[must_use]
    pub fn truth(&self) -> VehicleTruth {
        todo!()
    }

    /// The true state of the ship now.
    #[must_use]
    pub fn ship(&self) -> ShipTruth {
        todo!()
    }
}
