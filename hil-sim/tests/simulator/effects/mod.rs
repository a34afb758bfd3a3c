//! Every effect does what its definition says: against closed forms, or against the same world without it.

mod installation;
mod plant;
mod sensing;
mod table;

use hil_sim::observation::{Observation, ObservationKind};
use hil_sim::scenario::{Effect, Scenario};
use hil_sim::truth::{Actuators, VehicleTruth};
use hil_sim::world::World;

/// Speed of the propeller that holds 1 m/s by the declared drag: 3 u² + 0.369 u² (fins) = 3e-4 ω².
const CRUISE_RADPS: f64 = 105.97;

/// The reference vehicle at depth in unbounded water, ideal actuators, neutrally buoyant, no noise anywhere.
fn quiet() -> Scenario {
    let mut scenario = Scenario::built_in("survey").unwrap();
    let settings = &mut scenario.settings;
    settings.start.depth_m = 10.0;
    settings.start.speed_mps = 1.0;
    settings.plant.process_noise_factor = 0.0;
    settings.plant.servo_rate_radps = 1e6;
    settings.plant.propeller_lag_s = 0.0;
    settings.plant.surface = false;
    settings.ship.wander_m = 0.0;
    settings.sensors.depth.sigma_m = Some(0.0);
    settings.sensors.ahrs.attitude_sigma_rad = Some(0.0);
    settings.sensors.ahrs.rates_sigma_radps = Some(0.0);
    settings.sensors.dvl.sigma_mps = Some(0.0);
    settings.acoustics.range_sigma_m = Some(0.0);
    settings.acoustics.range_rate_sigma_mps = Some(0.0);
    scenario.vehicle.parameters.displaced_mass_kg = scenario.vehicle.parameters.mass_kg;
    scenario
}

/// The scenario with an effect more.
fn with(mut scenario: Scenario, name: &str, values: &[(&str, f64)]) -> Scenario {
    scenario.settings.effects.push(Effect::new(name, values).unwrap());
    scenario
}

/// The propeller at cruise, these fins.
fn cruise(fins_rad: [f64; 4]) -> Actuators {
    Actuators { propeller_radps: CRUISE_RADPS, fins_rad }
}

/// A world flown open-loop: its observations and the truth at every step.
struct ObservedFlight {
    observations: Vec<Observation>,
    truth: Vec<VehicleTruth>,
}

fn flown(scenario: &Scenario, targets: Actuators, seconds: u64) -> ObservedFlight {
    let mut world = World::new(scenario);
    world.set_actuator_targets(0, targets);
    let (mut observations, mut truth) = (Vec::new(), Vec::new());
    for time_us in (0..=seconds * 1_000_000).step_by(10_000) {
        world.advance(time_us, &mut |observation| observations.push(*observation));
        truth.push(world.truth());
    }
    ObservedFlight { observations, truth }
}

impl ObservedFlight {
    fn last(&self) -> &VehicleTruth {
        self.truth.last().unwrap()
    }

    /// The truth at the time of an observation of a sensor.
    fn at(&self, time_us: u64) -> &VehicleTruth {
        &self.truth[(time_us / 10_000) as usize]
    }

    fn ahrs(&self) -> impl Iterator<Item = (&VehicleTruth, [f64; 3], [f64; 3])> {
        self.observations.iter().filter_map(|o| match o.kind {
            ObservationKind::Ahrs { euler_rad, rates_radps } => Some((self.at(o.time_us), euler_rad, rates_radps)),
            _ => None,
        })
    }

    fn dvl(&self) -> impl Iterator<Item = (&VehicleTruth, [f64; 3])> {
        self.observations.iter().filter_map(|o| match o.kind {
            ObservationKind::Dvl { velocity_mps: Some(velocity), .. } => Some((self.at(o.time_us), velocity)),
            _ => None,
        })
    }

    fn ranges(&self) -> Vec<(f64, f64)> {
        let downlink = |o: &Observation| match &o.kind {
            ObservationKind::Downlink(packet) => Some((o.time_us as f64 * 1e-6, packet.range_m)),
            _ => None,
        };
        self.observations.iter().filter_map(downlink).collect()
    }
}

#[track_caller]
fn close(got: f64, expected: f64, tolerance: f64) {
    assert!((got - expected).abs() <= tolerance, "{got} instead of {expected}");
}
