//! The vehicle moved by its own model, measured with noise.

use super::support::{Random, VEHICLE, model};
use backseat_core::dynamics::{ActuatorInput, VehicleModel, VehicleParameters};
use backseat_core::identification::theta::{B1, M11, theta_of, with_theta};
use backseat_core::identification::{IdentificationConfig, Identifier, SampleOutcome};
use backseat_core::state::{self, VehicleState};
use core::f64::consts::TAU;

/// 10 Hz.
pub const PERIOD_S: f64 = 0.1;

/// Periods (s) of the excitation: propeller, rudder, elevator, each fast one differential for roll.
#[derive(Clone, Copy)]
pub struct Programme([f64; 7]);

/// What is identified on.
pub const EXCITATION: Programme = Programme([97.0, 41.0, 37.0, 13.0, 29.0, 11.0, 5.3]);
/// What the estimate has to predict: other frequencies.
pub const VALIDATION: Programme = Programme([71.0, 31.0, 53.0, 17.0, 43.0, 9.0, 6.7]);

impl Programme {
    pub fn input(&self, time_s: f64) -> ActuatorInput {
        let [propeller, slow, rudder, fast_rudder, elevator, fast_elevator, roll] =
            self.0.map(|period| libm::sin(TAU * time_s / period));
        let yaw = 0.14 * rudder + 0.08 * fast_rudder;
        let pitch = 0.10 * elevator + 0.06 * fast_elevator;
        let twist = 0.06 * roll;
        ActuatorInput {
            propeller_radps: 110.0 + 40.0 * propeller + 15.0 * slow,
            fins_rad: [twist + yaw, twist - yaw, twist - pitch, twist + pitch],
        }
    }
}

/// Table 4.13: one-sigma noise.
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    pub linear_mps: f64,
    pub angular_radps: f64,
    pub roll_pitch_rad: f64,
}

impl Noise {
    pub const NONE: Self = Self { linear_mps: 0.0, angular_radps: 0.0, roll_pitch_rad: 0.0 };
    pub const TABLE_4_13: Self =
        Self { linear_mps: 0.013, angular_radps: 1.745_329_25e-4, roll_pitch_rad: 4.363_323_13e-3 };
}

/// One period with the input as a function of the time in it (s), by two classical Runge-Kutta steps: the roll's
/// natural frequency is 1 Hz.
fn integrate(model: &VehicleModel, x: &VehicleState, input: impl Fn(f64) -> ActuatorInput) -> VehicleState {
    let dt = 0.5 * PERIOD_S;
    let mut x = *x;
    for from in [0.0, dt] {
        let [before, middle, after] = [from, from + 0.5 * dt, from + dt].map(&input);
        let k1 = model.derivative(&x, &before);
        let k2 = model.derivative(&(x + k1 * (0.5 * dt)), &middle);
        let k3 = model.derivative(&(x + k2 * (0.5 * dt)), &middle);
        let k4 = model.derivative(&(x + k3 * dt), &after);
        x += (k1 + (k2 + k3) * 2.0 + k4) * (dt / 6.0);
    }
    x
}

/// Mean of inputs that change all the time over the period before a time, by Simpson's rule.
fn mean_before(time_s: f64) -> ActuatorInput {
    let [a, b, c] = [1.0, 0.5, 0.0].map(|periods| EXCITATION.input(time_s - periods * PERIOD_S));
    let simpson = |a: f64, b: f64, c: f64| (a + 4.0 * b + c) / 6.0;
    ActuatorInput {
        propeller_radps: simpson(a.propeller_radps, b.propeller_radps, c.propeller_radps),
        fins_rad: core::array::from_fn(|i| simpson(a.fins_rad[i], b.fins_rad[i], c.fins_rad[i])),
    }
}

/// One period of constant input.
pub fn advance(model: &VehicleModel, x: &VehicleState, input: &ActuatorInput) -> VehicleState {
    integrate(model, x, |_| *input)
}

pub fn start() -> VehicleState {
    let mut x = VehicleState::zeros();
    x[state::U] = 0.5;
    x
}

/// A prior wrong by up to `share` in everything but m11, the scale; B1 and B2, zero in truth, by up to `share` of B3.
pub fn wrong(share: f64, random: &mut Random) -> VehicleParameters {
    let truth = theta_of(&VEHICLE);
    let mut theta = truth;
    for (j, value) in theta.iter_mut().enumerate() {
        let size = if j == B1 || j == B1 + 1 { truth[B1 + 2] } else { *value };
        if j != M11 {
            *value += random.within(share) * size;
        }
    }
    with_theta(&VEHICLE, &theta)
}

/// Lets the vehicle move and the identifier look on; inputs are `held` from sample to sample, or change all the time.
pub fn identify(
    identifier: &mut Identifier,
    held: bool,
    prior: &VehicleParameters,
    duration_s: f64,
    noise: &Noise,
    random: &mut Random,
) {
    let truth = model(&VEHICLE);
    identifier.configure(&IdentificationConfig::DEFAULT, prior).expect("a usable prior");
    let mut x = start();
    for step in 0..(duration_s / PERIOD_S) as u64 {
        let time_s = step as f64 * PERIOD_S;
        let since = if held { EXCITATION.input(time_s - PERIOD_S) } else { mean_before(time_s) };
        let mut attitude = state::attitude(&x);
        let mut velocity = state::velocity(&x);
        for axis in 0..3 {
            velocity[axis] += noise.linear_mps * random.normal();
            velocity[3 + axis] += noise.angular_radps * random.normal();
        }
        for axis in 0..2 {
            attitude[axis] += noise.roll_pitch_rad * random.normal();
        }
        let report = identifier.sample(step * 100_000, &attitude, &velocity, &since);
        assert!(
            matches!(report.outcome, SampleOutcome::Filling | SampleOutcome::WarmingUp | SampleOutcome::Adapting),
            "{report:?}"
        );
        x = if held {
            advance(&truth, &x, &EXCITATION.input(time_s))
        } else {
            integrate(&truth, &x, |into_s| EXCITATION.input(time_s + into_s))
        };
    }
}

/// Mean absolute error of the open-loop prediction over 600 s: roll, pitch (deg), p, q, r (deg/s), u, v, w (m/s).
pub fn cross_validation(parameters: &VehicleParameters) -> [f64; 8] {
    use state::{P, PHI, Q, R, THETA, U, V, W};
    let (truth, estimate) = (model(&VEHICLE), model(parameters));
    let (mut x, mut predicted) = (start(), start());
    let mut sums = [0.0; 8];
    let steps = 6000;
    for step in 0..steps {
        let input = VALIDATION.input(f64::from(step) * PERIOD_S);
        x = advance(&truth, &x, &input);
        predicted = advance(&estimate, &predicted, &input);
        for (sum, index) in sums.iter_mut().zip([PHI, THETA, P, Q, R, U, V, W]) {
            let error = predicted[index] - x[index];
            let error = if index == PHI { state::wrap_angle(error) } else { error };
            *sum += if (U..P).contains(&index) { error.abs() } else { error.abs().to_degrees() };
        }
    }
    sums.map(|sum| sum / f64::from(steps))
}
