//! Scalar against diagonal gains of the adaptive laws, on the same filtered log and at the same limit of stability.

use super::identification::ExperimentLog;
use super::{Kind, Measured, Study};
use anyhow::Context;
use backseat_core::dynamics::{ActuatorInput, Attitude, VehicleModel};
use backseat_core::identification::ParameterBox;
use backseat_core::identification::aid::{AidState, Instant, heun, model_acceleration, rates};
use backseat_core::identification::regressor::{Regressor, regressor};
use backseat_core::identification::theta::{M11, PARAMETERS, Theta, theta_of, with_theta};
use backseat_identify::simulation::{Output, measured};
use backseat_identify::smoothing::{CutOffs, low_pass};
use nalgebra::{Vector3, Vector6};

/// Both kinds of gain.
pub const GAINS: Study = Study { name: "gains", kind: Kind::Own(run) };

/// Of roll and pitch, and of v, Hz.
const CUT_OFFS_HZ: CutOffs = [1.0, 1.0, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5];
const ALPHA_PER_S: f64 = 0.3;
const PERIOD_S: f64 = 0.1;
/// λ_max(M⁻¹ Y Γ Yᵀ) dt² stays below this: Heun's step is stable.
const STIFFNESS_LIMIT: f64 = 0.3;
/// γ at the start and in the end (1/s²), and the time constant of its fall, s.
const GAMMA: [f64; 2] = [0.3, 0.03];
const GAMMA_TIME_S: f64 = 1000.0;
/// The estimates of the last so many samples are averaged: 1000 s.
const AVERAGE: usize = 10_000;

fn run(seed: u64) -> anyhow::Result<Measured> {
    let case = ExperimentLog::table_4_13(seed)?;
    let model = VehicleModel::new(&case.prior).ok().context("the prior")?;
    let instants = instants(&case, &model);
    let prior = theta_of(&case.prior);
    let energy = energy(&instants, &prior);
    let mass = |j: usize| if j == M11 { 0.0 } else { 1.0 };
    // Diagonal: Γ_j = γ / energy_j. Scalar: the same γ for the trace, spread evenly over parameters in SI units.
    let diagonal = Theta::from_fn(|j, _| mass(j) / energy[j]);
    let trace: f64 = energy.iter().sum();
    let scalar = Theta::from_fn(|j, _| mass(j) * PARAMETERS as f64 / trace);
    let mut measured = Measured::default();
    case.keep_errors(&mut measured, "prior", &case.prior);
    for (row, gains) in [("diagonal gains", diagonal), ("scalar gain", scalar)] {
        let theta = adapt(&case, &instants, &prior, &gains);
        case.keep_errors(&mut measured, row, &with_theta(&case.prior, &theta));
        let truth = theta_of(&crate::experiment::declared());
        let moved = (0..PARAMETERS).filter(|j| truth[*j] != 0.0 && *j != M11);
        let closer = moved.clone().filter(|j| (theta[*j] - truth[*j]).abs() < 0.5 * (prior[*j] - truth[*j]).abs());
        measured.set(&format!("MAE, {row}"), "closer_percent", 100.0 * closer.count() as f64 / moved.count() as f64);
    }
    Ok(measured)
}

/// One sample, low-passed without delay: v and s.
type Smoothed = (Vector6<f64>, Vector3<f64>);

fn smooth(case: &ExperimentLog) -> Vec<Smoothed> {
    let outputs: Vec<_> = case.data.samples.iter().map(measured).collect();
    let attitude = |x: &Output| Attitude::new(&Vector3::new(x[0], x[1], 0.0));
    low_pass(&outputs, &CUT_OFFS_HZ).iter().map(|x| (x.fixed_rows::<6>(2).into_owned(), attitude(x).down())).collect()
}

/// The beginning and the end of every period; the commands of its beginning are held.
fn instants(case: &ExperimentLog, model: &VehicleModel) -> Vec<[Instant; 2]> {
    let at = |(velocity, down): &Smoothed, input: ActuatorInput| Instant::new(model, velocity, down, &input);
    let periods = smooth(case);
    let periods = periods.windows(2).zip(&case.data.samples);
    periods.map(|(pair, sample)| [0, 1].map(|end| at(&pair[end], sample.input.mean()))).collect()
}

fn y(theta: &Theta, at: &Instant) -> Regressor {
    let mut y = Regressor::zeros();
    regressor(&model_acceleration(theta, at), &at.velocity, &at.down, &at.actuators, &mut y);
    y
}

/// mean (Yᵀ M⁻¹ Y)_jj.
fn energy(instants: &[[Instant; 2]], theta: &Theta) -> Theta {
    let mut sum = Theta::zeros();
    let every = instants.iter().step_by(7);
    let count = every.len().max(1) as f64;
    for [at, _] in every {
        let y = y(theta, at);
        sum += Theta::from_fn(|j, _| (0..6).map(|axis| y[(axis, j)] * y[(axis, j)] / theta[M11 + axis]).sum::<f64>());
    }
    sum.map(|energy| (energy / count).max(f64::MIN_POSITIVE))
}

/// The laws over the log; the mean of θ̂ over its last part.
fn adapt(case: &ExperimentLog, instants: &[[Instant; 2]], prior: &Theta, gains: &Theta) -> Theta {
    let bounds = ParameterBox::around(&case.prior, case.options.box_ratio);
    let mut state =
        AidState { velocity: instants.first().map_or_else(Vector6::zeros, |[at, _]| at.velocity), theta: *prior };
    let (mut sum, mut count) = (Theta::zeros(), 0.0);
    for (k, [then, now]) in instants.iter().enumerate() {
        let gamma = GAMMA[1] + (GAMMA[0] - GAMMA[1]) * (-(k as f64) * PERIOD_S / GAMMA_TIME_S).exp();
        let mut gains = gains * gamma;
        // Bounded by the trace.
        let y = y(&state.theta, then);
        let by_axis = |axis: usize| (0..PARAMETERS).map(|j| y[(axis, j)].powi(2) * gains[j]).sum::<f64>();
        let stiffness: f64 =
            (0..6).map(|axis| by_axis(axis) / state.theta[M11 + axis]).sum::<f64>() * PERIOD_S * PERIOD_S;
        if stiffness > STIFFNESS_LIMIT {
            gains *= STIFFNESS_LIMIT / stiffness;
        }
        let first = rates(&state, ALPHA_PER_S, then);
        let mut next = heun(&state, &first, &gains, ALPHA_PER_S, now, PERIOD_S);
        bounds.project(&mut next.theta);
        if next.velocity.iter().chain(next.theta.iter()).all(|value| value.is_finite()) {
            state = next;
        }
        if k + AVERAGE >= instants.len() {
            sum += state.theta;
            count += 1.0;
        }
    }
    sum / f64::max(count, 1.0)
}
