//! Weak form with instrumental variables.
//!
//! Each equation of motion is multiplied by a window that vanishes at its ends and integrated over it: by parts, so
//! that no acceleration is needed. Least squares on such rows would be biased, for the rows hold the noise of what they
//! are fitted to; the instruments, the same rows of the model's free run, do not. The rows themselves are those of the
//! trajectory of [`crate::smoothing`], because a product of noisy factors has a mean that no instrument takes out.

use crate::aid;
use crate::data::IdentificationData;
use crate::estimate::Estimate;
use crate::excitation::described;
use crate::options::{IdentifyError, Method, Options};
use crate::output_error::free;
use crate::parameters::{self, EXTENDED, Extended, ExtendedRegressor};
use crate::sample::{PERIOD_S, Sample};
use crate::smoothing::{self, CutOffs};
use backseat_core::dynamics::{Attitude, VehicleModel, VehicleParameters};
use backseat_core::identification::aid::Instant;
use backseat_core::identification::regressor::{Regressor, known_wrench, regressor};
use backseat_core::identification::theta::M11;
use backseat_core::state::{self, VehicleState};
use backseat_logs::interrupt;
use core::f64::consts::PI;
use nalgebra::{DMatrix, DVector, Vector6};
use rayon::prelude::*;

/// Length of a window, in samples: 3 s; each begins half a length after the one before.
const WINDOW: usize = 30;
/// New instruments and weights this often.
const ROUNDS: usize = 3;
/// Cut-offs of what the model leaves, Hz.
const CUTOFFS: CutOffs = [0.03, 0.03, 0.1, 0.1, 0.1, 1.0, 1.0, 1.0];

/// One window: the rows of the trajectory, the instruments, and what the declared vehicle has beyond the parameters.
struct Window {
    rows: ExtendedRegressor,
    instruments: ExtendedRegressor,
    known: Vector6<f64>,
}

/// Parameters and covariance.
pub(crate) struct Solved {
    pub parameters: Extended,
    pub covariance: DMatrix<f64>,
}

/// Integral over a window of the equations of motion times sin², by Simpson's rule in every period.
fn integrate(model: &VehicleModel, samples: &[Sample], states: &[VehicleState]) -> (ExtendedRegressor, Vector6<f64>) {
    let length_s = WINDOW as f64 * PERIOD_S;
    let (mut rows, mut known) = (ExtendedRegressor::zeros(), Vector6::zeros());
    let mut y = Regressor::zeros();
    for (k, sample) in samples.iter().take(WINDOW).enumerate() {
        for (half, simpson) in [(0, 1.0), (1, 4.0), (2, 1.0)] {
            let x = &states[2 * k + half];
            let phase = PI * (k as f64 + 0.5 * half as f64) / WINDOW as f64;
            let weight = simpson * PERIOD_S / 6.0;
            let (window, slope) = (phase.sin().powi(2) * weight, (2.0 * phase).sin() * PI / length_s * weight);
            let velocity = state::velocity(x);
            let input = sample.input.at_step(half);
            let at = Instant::new(model, &velocity, &Attitude::new(&state::attitude(x)).down(), &input);
            regressor(&Vector6::zeros(), &velocity, &at.down, &at.actuators, &mut y);
            rows += parameters::extended(&y, &velocity) * window;
            for axis in 0..6 {
                rows[(axis, M11 + axis)] -= velocity[axis] * slope;
            }
            known += known_wrench(&beyond(model.parameters()), &velocity, &input) * window;
        }
    }
    (rows, known)
}

/// The vehicle without cross drag, which is among the parameters here.
fn beyond(vehicle: &VehicleParameters) -> VehicleParameters {
    VehicleParameters { d26: 0.0, d35: 0.0, ..*vehicle }
}

fn windows(data: &IdentificationData, model: &VehicleModel) -> Vec<Window> {
    let mut all = Vec::new();
    for samples in data.stretches() {
        let smoothed = smoothing::with_model(model, samples, &CUTOFFS);
        let starts: Vec<usize> = (0..samples.len().saturating_sub(WINDOW)).step_by(WINDOW / 2).collect();
        let some: Vec<Window> = starts
            .into_par_iter()
            .map(|k| {
                interrupt::check();
                let (rows, known) = integrate(model, &samples[k..], &smoothed.states[2 * k..]);
                let (instruments, _) = integrate(model, &samples[k..], &smoothed.model[2 * k..]);
                Window { rows, instruments, known }
            })
            .collect();
        all.extend(some);
    }
    all
}

/// Solves for the free parameters from a model that is close enough to give instruments.
pub(crate) fn solve(
    data: &IdentificationData,
    prior: &VehicleParameters,
    from: &Extended,
    free: &[usize],
    options: &Options,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Solved, IdentifyError> {
    let scale = parameters::scale(prior);
    let mut solved = Solved { parameters: *from, covariance: DMatrix::zeros(EXTENDED, EXTENDED) };
    for round in 0..ROUNDS {
        progress(round as f64 / ROUNDS as f64);
        let vehicle = parameters::with(prior, &solved.parameters);
        let model = VehicleModel::new(&vehicle).map_err(IdentifyError::Prior)?;
        let windows = windows(data, &model);
        let residual = |window: &Window| window.rows * solved.parameters - window.known;
        let mut variance = Vector6::zeros();
        for window in &windows {
            variance += residual(window).map(|r| r * r);
        }
        let weight = variance.map(|v| windows.len() as f64 / v.max(f64::MIN_POSITIVE));
        // Windows overlap by half: each counts as two thirds (correlation of sin² windows half a length apart is 1/6).
        let share = 2.0 / 3.0;
        let n = free.len();
        let mut matrix = DMatrix::from_diagonal(&DVector::from_fn(n, |i, _| scale[free[i]].powi(-2)));
        let mut scatter = DMatrix::zeros(n, n);
        let mut right = DVector::zeros(n);
        for window in &windows {
            interrupt::check();
            let left = residual(window);
            let mut instruments = window.instruments;
            for (axis, weight) in weight.iter().enumerate() {
                instruments.row_mut(axis).scale_mut(*weight * share);
            }
            let product = instruments.transpose() * window.rows;
            let gradient = instruments.transpose() * left;
            let gradient = DVector::from_fn(n, |i, _| gradient[free[i]]);
            matrix += DMatrix::from_fn(n, n, |i, j| product[(free[i], free[j])]);
            scatter += &gradient * gradient.transpose() / share;
            right -= gradient;
        }
        let unit = DVector::from_fn(n, |i, _| scale[free[i]]);
        let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * unit[i] * unit[j]);
        let inverse = scaled.try_inverse().ok_or_else(|| {
            IdentifyError::Degenerate("instrumental variables: the data do not determine the parameters".into())
        })?;
        let inverse = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * unit[i] * unit[j]);
        let step = &inverse * right;
        let mut next = solved.parameters;
        for (&j, step) in free.iter().zip(step.iter()) {
            next[j] += step;
        }
        parameters::project(prior, options.box_ratio, &mut next);
        solved.parameters = next;
        let spread = &inverse * scatter * inverse.transpose();
        solved.covariance.fill(0.0);
        for (i, &row) in free.iter().enumerate() {
            for (j, &column) in free.iter().enumerate() {
                solved.covariance[(row, column)] = spread[(i, j)];
            }
        }
    }
    progress(1.0);
    Ok(solved)
}

/// The method by itself: instruments from adaptive identification.
pub(crate) fn identify(
    data: &IdentificationData,
    prior: &VehicleParameters,
    options: &Options,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Estimate, IdentifyError> {
    let adapted = aid::refine(data, prior, options, &|share| progress(0.5 * share))?;
    let free = free(options, options.cross_drag);
    let from = parameters::of(&adapted);
    let solved = solve(data, prior, &from, &free, options, &|share| progress(0.5 + 0.5 * share))?;
    Ok(described(Method::Iv, data, prior, options, &solved.parameters, Some(&solved.covariance)))
}
