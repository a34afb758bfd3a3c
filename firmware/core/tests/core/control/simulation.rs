//! The model in closed loop with the controller: RK4, no noise, no estimation error.

use crate::random::Random;
use backseat_core::control::limits::ActuatorLimits;
use backseat_core::control::mission::{Mission, MissionStatus};
use backseat_core::control::{Command, ControlConfig, Controller};
use backseat_core::dynamics::{ActuatorInput, FINS, VehicleModel, VehicleParameters};
use backseat_core::state::{self, VehicleState};

/// The board's step, s.
pub const STEP_S: f64 = 0.1;

/// Disturbances of water and actuators that the controller does not know.
#[derive(Clone, Copy, Debug)]
pub struct Disturbance {
    /// The vehicle that is flown; the controller knows the reference vehicle.
    pub vehicle: VehicleParameters,
    /// Standard deviation of the white, uniform error of each estimated state.
    pub noise: [f64; 12],
    /// Water current, north and east, m/s.
    pub current_ne_mps: [f64; 2],
    /// Whether the controller knows the current.
    pub current_known: bool,
    /// Actual minus commanded angle of each fin, rad.
    pub fin_bias_rad: [f64; FINS],
    /// Share of its lift and drag that each fin has.
    pub fin_shares: [f64; FINS],
    /// Whether the controller knows those shares.
    pub fins_known: bool,
}

impl Default for Disturbance {
    fn default() -> Self {
        Self {
            vehicle: VehicleParameters::IVER3,
            noise: [0.0; 12],
            current_ne_mps: [0.0; 2],
            current_known: false,
            fin_bias_rad: [0.0; FINS],
            fin_shares: [1.0; FINS],
            fins_known: false,
        }
    }
}

/// One step's worth of history.
#[derive(Clone, Copy, Debug)]
pub struct SimulatedSample {
    pub time_s: f64,
    pub x: VehicleState,
    pub command: Command,
}

/// Flies the mission from `x` for at most `longest_s`; checks the limits of every command on the way.
pub fn fly(
    config: &ControlConfig,
    mission: &Mission,
    x: VehicleState,
    disturbance: &Disturbance,
    longest_s: f64,
) -> Vec<SimulatedSample> {
    fly_ordered(config, mission, x, disturbance, longest_s, |_, _| {})
}

/// The same; before each step the controller is given orders that depend on time, s.
pub fn fly_ordered(
    config: &ControlConfig,
    mission: &Mission,
    mut x: VehicleState,
    disturbance: &Disturbance,
    longest_s: f64,
    order: impl Fn(f64, &mut Controller),
) -> Vec<SimulatedSample> {
    let model = VehicleModel::new(&VehicleParameters::IVER3).unwrap();
    let mut controller = Box::new(Controller::new());
    controller.configure(config, &model).unwrap();
    controller.set_mission(mission);
    controller.start(&x).unwrap();
    if disturbance.fins_known {
        let mut faulted = model.clone();
        faulted.set_fin_effectiveness(&disturbance.fin_shares);
        controller.set_model(&faulted);
    }
    let known_ne_mps = if disturbance.current_known { disturbance.current_ne_mps } else { [0.0; 2] };
    let mut scatter = Random(5);
    let mut actual_vehicle = VehicleModel::new(&disturbance.vehicle).unwrap();
    actual_vehicle.set_fin_effectiveness(&disturbance.fin_shares);
    let mut last = ActuatorInput::default();
    let mut samples = Vec::new();
    for step in 0..(longest_s / STEP_S) as u64 {
        let estimate =
            VehicleState::from_fn(|i, _| x[i] + libm::sqrt(3.0) * disturbance.noise[i] * scatter.within(1.0));
        order(step as f64 * STEP_S, &mut controller);
        let command = controller.command(step * 100_000, &estimate, known_ne_mps);
        check_limits(&config.limits, &last, &command.input);
        last = command.input;
        samples.push(SimulatedSample { time_s: step as f64 * STEP_S, x, command });
        if command.status == MissionStatus::Finished {
            break;
        }
        let mut actual = command.input;
        for (fin, bias) in actual.fins_rad.iter_mut().zip(&disturbance.fin_bias_rad) {
            *fin += bias;
        }
        for _ in 0..4 {
            x = rk4(&actual_vehicle, &x, &actual, disturbance.current_ne_mps, STEP_S / 4.0);
        }
    }
    samples
}

pub fn check_limits(limits: &ActuatorLimits, last: &ActuatorInput, now: &ActuatorInput) {
    // A rounding of the sum of last and step.
    const SLACK: f64 = 1e-12;
    assert!((0.0..=limits.propeller_radps).contains(&now.propeller_radps), "{now:?}");
    assert!((now.propeller_radps - last.propeller_radps).abs() <= limits.propeller_radps2 * STEP_S + SLACK, "{now:?}");
    for (last, now) in last.fins_rad.iter().zip(&now.fins_rad) {
        assert!(now.abs() <= limits.fin_rad, "{now}");
        assert!((now - last).abs() <= limits.fin_rate_radps * STEP_S + SLACK, "{last} {now}");
    }
}

fn rk4(model: &VehicleModel, x: &VehicleState, input: &ActuatorInput, current: [f64; 2], h: f64) -> VehicleState {
    let f = |x: VehicleState| {
        let mut rate = model.derivative(&x, input);
        rate[state::X] += current[0];
        rate[state::Y] += current[1];
        rate
    };
    let k1 = f(*x);
    let k2 = f(x + k1 * (0.5 * h));
    let k3 = f(x + k2 * (0.5 * h));
    let k4 = f(x + k3 * h);
    x + (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0)
}
