//! What a vehicle does with its fins, by the declared dynamics in still water: speeds, turn, dive.

use backseat_core::control::speed::propeller_radps;
use backseat_core::control::trim::Trim;
use backseat_core::dynamics::{ActuatorInput, VehicleModel};
use backseat_core::state::{PSI, Q, R, THETA, U, V, VehicleState, Z};
use serde::Serialize;
use std::f64::consts::PI;

/// Integration step, s: a hundredth of the fastest motion of a small vehicle.
const STEP_S: f64 = 0.01;
/// A turn or dive is steady after this, s.
const SETTLED_S: f64 = 40.0;

/// Straight level flight at one speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cruise {
    /// Propeller speed, 1/min.
    pub rpm: f64,
    /// Speed through the water, m/s.
    pub speed_mps: f64,
    /// Pitch, fins and thrust.
    pub trim: Trim,
}

/// A steady turn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Turn {
    /// Angle of the rudders, rad.
    pub fin_rad: f64,
    /// Radius, m.
    pub radius_m: f64,
    /// Time for half a turn from straight flight, s.
    pub half_turn_s: Option<f64>,
    /// Roll in the steady turn, rad.
    pub heel_rad: f64,
}

/// A dive with elevators.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Dive {
    /// Angle of the elevators beyond the trim, rad.
    pub fin_rad: f64,
    /// Positive down, m/s.
    pub rate_mps: f64,
    /// Pitch in the steady dive, rad.
    pub pitch_rad: f64,
}

/// Level flight at this speed, if there is one and the propeller reaches it.
pub fn cruise(model: &VehicleModel, speed_mps: f64) -> Option<Cruise> {
    let trim = Trim::solve(model, speed_mps)?;
    let omega = propeller_radps(model.propeller(), trim.thrust_n, trim.surge_mps);
    let is_reached = omega <= model.parameters().omega_max_radps;
    is_reached.then_some(Cruise { rpm: omega * 30.0 / PI, speed_mps, trim })
}

/// Fastest level flight, m/s.
pub fn top_speed_mps(model: &VehicleModel) -> Option<f64> {
    (1..=300).rev().map(|k| 0.1 * f64::from(k)).find(|speed| cruise(model, *speed).is_some())
}

/// Rudders hard over (opposed fins, nose to starboard) from straight flight.
pub fn turn(model: &VehicleModel, from: &Cruise, fin_rad: f64) -> Option<Turn> {
    let mut input = input(from);
    input.fins_rad[0] = fin_rad;
    input.fins_rad[1] = -fin_rad;
    let (mut turned, mut half_turn_s) = (0.0, None);
    let state = fly(model, from.trim.state(), &input, |t_s, x| {
        turned += x[R] * STEP_S;
        if turned.abs() > PI && half_turn_s.is_none() {
            half_turn_s = Some(t_s);
        }
    })?;
    let speed = state[U].hypot(state[V]);
    (state[R].abs() > 1e-6).then(|| Turn {
        fin_rad,
        radius_m: speed / state[R].abs(),
        half_turn_s,
        heel_rad: state[backseat_core::state::PHI],
    })
}

/// Elevators down by this angle beyond the trim, for as long as a pitch settles.
pub fn dive(model: &VehicleModel, from: &Cruise, fin_rad: f64) -> Option<Dive> {
    let mut input = input(from);
    // positive starboard: nose down; positive port: nose up
    input.fins_rad[2] -= fin_rad;
    input.fins_rad[3] += fin_rad;
    let mut depths = Vec::new();
    let state = fly(model, from.trim.state(), &input, |t_s, x| depths.push((t_s, x[Z])))?;
    let last = depths.last()?;
    let before = depths.get(depths.len().checked_sub(1 + (10.0 / STEP_S) as usize)?)?;
    let is_settled = state[Q].abs() < 0.2;
    is_settled.then(|| Dive { fin_rad, rate_mps: (last.1 - before.1) / (last.0 - before.0), pitch_rad: state[THETA] })
}

fn input(from: &Cruise) -> ActuatorInput {
    ActuatorInput { propeller_radps: from.rpm * PI / 30.0, fins_rad: from.trim.fins_rad }
}

/// Runge-Kutta of fourth order; `None` where the vehicle leaves what the model describes.
fn fly(
    model: &VehicleModel,
    mut x: VehicleState,
    input: &ActuatorInput,
    mut watch: impl FnMut(f64, &VehicleState),
) -> Option<VehicleState> {
    let steps = (SETTLED_S / STEP_S) as u32;
    for step in 1..=steps {
        let a = model.derivative(&x, input);
        let b = model.derivative(&(x + a * (0.5 * STEP_S)), input);
        let c = model.derivative(&(x + b * (0.5 * STEP_S)), input);
        let d = model.derivative(&(x + c * STEP_S), input);
        x += (a + (b + c) * 2.0 + d) * (STEP_S / 6.0);
        if !x.iter().all(|value| value.is_finite()) || x[THETA].abs() > 1.5 {
            return None;
        }
        watch(f64::from(step) * STEP_S, &x);
    }
    x[PSI] = backseat_core::state::wrap_angle(x[PSI]);
    Some(x)
}
