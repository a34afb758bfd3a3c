//! Prediction-error (output-error) method: the parameters whose free run comes closest to what was measured.
//!
//! The log is cut into segments that start where they please (multiple shooting without continuity: each start, eight
//! numbers, is estimated too). Gauss-Newton with Levenberg's damping on normal equations that are bordered by the
//! starts, which Schur's complement takes out segment by segment. Outputs are weighted by their own residuals, so that
//! neither noise nor what the model lacks has to be declared.

use crate::data::IdentificationData;
use crate::estimate::Estimate;
use crate::excitation::described;
use crate::options::{IdentifyError, Method, Options};
use crate::parameters::{self, D26, EXTENDED, Extended};
use crate::sample::{PERIOD_S, Sample};
use crate::simulation::{self, COLUMNS, OUTPUT_STATES, OUTPUTS, Output, Sensitive};
use crate::{aid, smoothing};
use backseat_core::dynamics::{VehicleModel, VehicleParameters};
use backseat_core::state::VehicleState;
use backseat_logs::interrupt;
use nalgebra::{DMatrix, DVector, SMatrix};
use rayon::prelude::*;

/// Length of the segments, s: the start of each costs information of some 10 s.
const SEGMENT_S: f64 = 100.0;
/// Segments for a start from afar, before those: short ones converge where long ones do not.
pub(crate) const SHORT_S: f64 = 10.0;
/// Gauss-Newton steps with each length.
const STEPS: usize = 15;
/// A step that changes the cost by less than this share ends the iteration.
const SETTLED: f64 = 3.0e-6;
/// Residuals are not taken to be smaller than this, rad, m/s, rad/s: data without noise would have infinite weight.
pub(crate) const SMALLEST: [f64; OUTPUTS] = [1.0e-5, 1.0e-5, 1.0e-5, 1.0e-5, 1.0e-5, 1.0e-6, 1.0e-6, 1.0e-6];

type Normal = SMatrix<f64, COLUMNS, COLUMNS>;

/// Samples that are predicted from one start.
pub(crate) struct Segment<'a> {
    pub samples: &'a [Sample],
    pub start: VehicleState,
}

/// What a segment says at one set of parameters.
#[derive(Clone)]
struct Evaluated {
    /// Jᵀ W J.
    normal: Normal,
    /// Jᵀ W r.
    gradient: nalgebra::SVector<f64, COLUMNS>,
    /// Sums of squared residuals.
    squares: Output,
    samples: usize,
}

/// A fit: parameters with their covariance.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Parameters.
    pub parameters: Extended,
    /// Their covariance; zero where held.
    pub covariance: DMatrix<f64>,
    /// Root mean square residual of every output.
    pub sigma: Output,
}

/// The residuals' weights at the start: the noise that the options declare.
#[must_use]
pub fn declared_sigma(options: &Options) -> Output {
    let [u, v, w, p, q, r] = options.velocity_noise;
    let roll_pitch = options.roll_pitch_noise_rad;
    Output::from([roll_pitch, roll_pitch, u, v, w, p, q, r]).sup(&Output::from(SMALLEST))
}

/// Which parameters are free: all but the scale, and the cross drags if `cross`.
#[must_use]
pub fn free(options: &Options, cross: bool) -> Vec<usize> {
    let known = options.scale.parameter();
    (0..EXTENDED).filter(|&j| j != known && (cross || j < D26)).collect()
}

pub(crate) fn segments(data: &IdentificationData, length_s: f64) -> Vec<Segment<'_>> {
    let length = (length_s / PERIOD_S) as usize;
    // A short rest joins the last whole segment.
    let cut = |samples: &'_ [Sample]| (samples.len() / length).max(1);
    data.stretches()
        .flat_map(|samples| {
            let count = cut(samples);
            (0..count).map(move |k| {
                let end = if k + 1 == count { samples.len() } else { (k + 1) * length };
                let part = &samples[k * length..end];
                Segment { samples: part, start: level(part) }
            })
        })
        .collect()
}

/// A start from the first second's samples, without most of their noise.
fn level(samples: &[Sample]) -> VehicleState {
    let outputs: Vec<Output> = samples.iter().take(21).map(simulation::measured).collect();
    let smooth = smoothing::low_pass(&outputs, &smoothing::PLAIN);
    let mut start = simulation::start(&samples[0]);
    for (index, value) in OUTPUT_STATES.iter().zip(smooth[0].iter()) {
        start[*index] = *value;
    }
    start
}

fn evaluate(model: &VehicleModel, segment: &Segment<'_>, weights: &Output) -> Evaluated {
    let mut run = Sensitive::new(&segment.start);
    let mut result = Evaluated {
        normal: Normal::zeros(),
        gradient: nalgebra::SVector::zeros(),
        squares: Output::zeros(),
        samples: segment.samples.len(),
    };
    for sample in segment.samples {
        let residual = simulation::residual(sample, &run.state);
        for (output, (residual, weight)) in residual.iter().zip(weights.iter()).enumerate() {
            // One output's row of the sensitivities, contiguous: the compiler takes several elements at a time.
            let row: [f64; COLUMNS] = core::array::from_fn(|column| run.sensitivity.data.0[column][output]);
            for (j, (column, element)) in result.normal.data.0.iter_mut().zip(&row).enumerate() {
                let factor = weight * element;
                for (sum, other) in column[..=j].iter_mut().zip(&row) {
                    *sum += factor * other;
                }
                result.gradient[j] += factor * residual;
            }
        }
        result.squares += residual.component_mul(&residual);
        run.advance(model, &sample.input);
    }
    result.normal.fill_lower_triangle_with_upper_triangle();
    result
}

/// Squares of the residuals alone.
fn squares(model: &VehicleModel, segment: &Segment<'_>) -> Output {
    let run = simulation::free_run(model, &segment.start, segment.samples);
    let mut sum = Output::zeros();
    for (sample, x) in segment.samples.iter().zip(run.iter().step_by(2)) {
        let residual = simulation::residual(sample, x);
        sum += residual.component_mul(&residual);
    }
    sum
}

fn evaluate_all(model: &VehicleModel, segments: &[Segment<'_>], weights: &Output) -> Vec<Evaluated> {
    let one = |segment: &Segment<'_>| {
        interrupt::check();
        evaluate(model, segment, weights)
    };
    segments.par_iter().map(one).collect()
}

fn total(squares: impl IntoIterator<Item = Output>, weights: &Output) -> f64 {
    squares.into_iter().map(|squares| squares.dot(weights)).sum()
}

pub(crate) fn weights(sigma: &Output) -> Output {
    sigma.map(|sigma| 1.0 / (sigma * sigma))
}

/// Normal equations of the free parameters with the starts taken out: matrix, right-hand side.
struct Reduced {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
}

type StartMatrix = SMatrix<f64, OUTPUTS, OUTPUTS>;

/// Inverse of a segment's block of the start, damped.
fn start_inverse(evaluated: &Evaluated, damping: f64) -> StartMatrix {
    let mut block: StartMatrix = evaluated.normal.fixed_view::<OUTPUTS, OUTPUTS>(EXTENDED, EXTENDED).into_owned();
    for i in 0..OUTPUTS {
        block[(i, i)] *= 1.0 + damping + 1.0e-12;
    }
    block.cholesky().map_or_else(StartMatrix::zeros, |factor| factor.inverse())
}

fn reduce(evaluated: &Evaluated, free: &[usize], damping: f64) -> Reduced {
    let inverse = start_inverse(evaluated, damping);
    let across = evaluated.normal.fixed_view::<EXTENDED, OUTPUTS>(0, EXTENDED).into_owned();
    let gain = across * inverse;
    let start_gradient = evaluated.gradient.fixed_rows::<OUTPUTS>(EXTENDED).into_owned();
    let full = evaluated.normal.fixed_view::<EXTENDED, EXTENDED>(0, 0) - gain * across.transpose();
    let right = evaluated.gradient.fixed_rows::<EXTENDED>(0) - gain * start_gradient;
    Reduced {
        matrix: DMatrix::from_fn(free.len(), free.len(), |i, j| full[(free[i], free[j])]),
        right: DVector::from_fn(free.len(), |i, _| right[free[i]]),
    }
}

/// Fits the free parameters, from `from`; `is_close` says that it predicts a minute or two already.
///
/// # Errors
/// If the model cannot run on the data, or they determine nothing.
pub fn fit(
    data: &IdentificationData,
    prior: &VehicleParameters,
    (from, is_close): (&Extended, bool),
    free: &[usize],
    options: &Options,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Fit, IdentifyError> {
    let lengths: &[f64] = if is_close { &[SEGMENT_S] } else { &[SHORT_S, SEGMENT_S] };
    let mut sigma = declared_sigma(options);
    let mut parameters = *from;
    let scale = parameters::scale(prior);
    // A plausible error of each parameter as one weak measurement of its start: settles what the data leave open, and
    // nothing else.
    let ridge = DVector::from_fn(free.len(), |i, _| scale[free[i]].powi(-2));
    let reference = *from;
    let mut covariance = DMatrix::zeros(EXTENDED, EXTENDED);
    for (stage, &length_s) in lengths.iter().enumerate() {
        let mut segments = segments(data, length_s);
        let mut damping = 1.0e-3;
        let model_of = |parameters: &Extended| VehicleModel::new(&parameters::with(prior, parameters)).ok();
        let mut model = model_of(&parameters).ok_or_else(|| broken("the starting parameters are out of range"))?;
        for step in 0..STEPS {
            progress((stage as f64 + step as f64 / STEPS as f64) / lengths.len() as f64);
            let weight = weights(&sigma);
            let evaluated = evaluate_all(&model, &segments, &weight);
            let prior_cost = |parameters: &Extended| {
                free.iter().zip(ridge.iter()).map(|(&j, r)| r * (parameters[j] - reference[j]).powi(2)).sum::<f64>()
            };
            let cost = total(evaluated.iter().map(|e| e.squares), &weight) + prior_cost(&parameters);
            if !cost.is_finite() {
                return Err(broken("the model's run leaves all bounds"));
            }
            let mut accepted = None;
            for _ in 0..8 {
                let Some((candidate, starts)) =
                    newton(&evaluated, &segments, &parameters, &reference, free, &ridge, damping)
                else {
                    damping *= 10.0;
                    continue;
                };
                let mut candidate = candidate;
                parameters::project(prior, options.box_ratio, &mut candidate);
                let Some(moved) = model_of(&candidate) else {
                    damping = (damping * 10.0).max(1.0e-3);
                    continue;
                };
                let trial: Vec<Segment<'_>> = segments
                    .iter()
                    .zip(starts)
                    .map(|(segment, start)| Segment { samples: segment.samples, start })
                    .collect();
                let trial_squares: Vec<Output> = trial.par_iter().map(|s| squares(&moved, s)).collect();
                let trial_cost = total(trial_squares, &weight) + prior_cost(&candidate);
                if trial_cost < cost {
                    accepted = Some((candidate, moved, trial, trial_cost));
                    damping = (damping * 0.1).max(1.0e-9);
                    break;
                }
                damping = (damping * 10.0).max(1.0e-6);
            }
            let Some((candidate, moved, trial, trial_cost)) = accepted else { break };
            (parameters, model, segments) = (candidate, moved, trial);
            sigma = residuals(&evaluated);
            if (cost - trial_cost) < SETTLED * cost {
                break;
            }
        }
        let evaluated = evaluate_all(&model, &segments, &weights(&sigma));
        sigma = residuals(&evaluated);
        if stage + 1 == lengths.len() {
            covariance = spread(&evaluated, free, &ridge)?;
        }
    }
    progress(1.0);
    Ok(Fit { parameters, covariance, sigma })
}

fn broken(why: &str) -> IdentifyError {
    IdentifyError::Degenerate(format!("output error: {why}"))
}

/// Root mean square residuals, not below [`SMALLEST`].
fn residuals(evaluated: &[Evaluated]) -> Output {
    let mut squares = Output::zeros();
    for segment in evaluated {
        squares += segment.squares;
    }
    // Eight numbers of each segment are spent on its start.
    let samples: usize = evaluated.iter().map(|segment| segment.samples - 1).sum();
    (squares / samples.max(1) as f64).map(f64::sqrt).sup(&Output::from(SMALLEST))
}

/// The damped Gauss-Newton step: parameters and starts.
fn newton(
    evaluated: &[Evaluated],
    segments: &[Segment<'_>],
    parameters: &Extended,
    reference: &Extended,
    free: &[usize],
    ridge: &DVector<f64>,
    damping: f64,
) -> Option<(Extended, Vec<VehicleState>)> {
    let mut matrix = DMatrix::from_diagonal(ridge);
    let mut right = DVector::from_fn(free.len(), |i, _| ridge[i] * (reference[free[i]] - parameters[free[i]]));
    for segment in evaluated {
        let reduced = reduce(segment, free, damping);
        matrix += reduced.matrix;
        right += reduced.right;
    }
    for i in 0..free.len() {
        matrix[(i, i)] *= 1.0 + damping;
    }
    let step = solve(&matrix, &right)?;
    let mut change = Extended::zeros();
    for (&j, value) in free.iter().zip(step.iter()) {
        change[j] = *value;
    }
    let starts = evaluated.iter().zip(segments).map(|(evaluated, segment)| {
        let across = evaluated.normal.fixed_view::<OUTPUTS, EXTENDED>(EXTENDED, 0);
        let right = evaluated.gradient.fixed_rows::<OUTPUTS>(EXTENDED) - across * change;
        let moved = start_inverse(evaluated, damping) * right;
        let mut start = segment.start;
        for (index, value) in OUTPUT_STATES.iter().zip(moved.iter()) {
            start[*index] += value;
        }
        start
    });
    let starts = starts.collect();
    Some((parameters + change, starts))
}

/// Solves a symmetric positive definite system whose unknowns differ by orders of magnitude.
pub(crate) fn solve(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let scale = matrix.diagonal().map(|d| 1.0 / d.max(f64::MIN_POSITIVE).sqrt());
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let step = scaled.cholesky()?.solve(&right.component_mul(&scale));
    Some(step.component_mul(&scale))
}

/// Covariance of the parameters: the larger of the information's inverse and of the one that takes the segments'
/// gradients as they scatter, which holds with coloured residuals too.
fn spread(evaluated: &[Evaluated], free: &[usize], ridge: &DVector<f64>) -> Result<DMatrix<f64>, IdentifyError> {
    let mut matrix = DMatrix::from_diagonal(ridge);
    let mut scatter = DMatrix::zeros(free.len(), free.len());
    for segment in evaluated {
        let reduced = reduce(segment, free, 0.0);
        scatter += &reduced.right * reduced.right.transpose();
        matrix += reduced.matrix;
    }
    let scale = matrix.diagonal().map(|d| 1.0 / d.sqrt());
    let scaled = DMatrix::from_fn(free.len(), free.len(), |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let inverse = scaled.cholesky().ok_or_else(|| broken("the data determine nothing"))?.inverse();
    let inverse = DMatrix::from_fn(free.len(), free.len(), |i, j| inverse[(i, j)] * scale[i] * scale[j]);
    // With fewer segments than parameters the scatter says nothing.
    let robust = if evaluated.len() > 2 * free.len() { &inverse * scatter * &inverse } else { inverse.clone() };
    let mut covariance = DMatrix::zeros(EXTENDED, EXTENDED);
    for (i, &row) in free.iter().enumerate() {
        for (j, &column) in free.iter().enumerate() {
            covariance[(row, column)] = inverse[(i, j)];
        }
        covariance[(row, row)] = inverse[(i, i)].max(robust[(i, i)]);
    }
    Ok(covariance)
}

/// Squared prediction error of every segment of `length_s` in units of `sigma` and a mean over outputs and samples;
/// each segment's start is fitted to it. Infinite where the model cannot run.
#[must_use]
pub fn held_out(data: &IdentificationData, vehicle: &VehicleParameters, sigma: &Output, length_s: f64) -> Vec<f64> {
    let Ok(model) = VehicleModel::new(vehicle) else { return vec![f64::INFINITY; segments(data, length_s).len()] };
    let weight = weights(sigma);
    segments(data, length_s)
        .into_par_iter()
        .map(|mut segment| {
            let mut best = f64::INFINITY;
            for _ in 0..4 {
                let evaluated = evaluate(&model, &segment, &weight);
                let cost = evaluated.squares.dot(&weight) / (OUTPUTS * segment.samples.len()) as f64;
                if !cost.is_finite() || cost > best * (1.0 - 1.0e-6) {
                    break;
                }
                best = cost;
                let moved = start_inverse(&evaluated, 0.0) * evaluated.gradient.fixed_rows::<OUTPUTS>(EXTENDED);
                for (index, value) in OUTPUT_STATES.iter().zip(moved.iter()) {
                    segment.start[*index] += value;
                }
            }
            best
        })
        .collect()
}

/// Mean square residuals of every output over segments whose start is fitted, and their root: what a model leaves.
#[must_use]
pub fn left_over(data: &IdentificationData, vehicle: &VehicleParameters, sigma: &Output) -> Output {
    let Ok(model) = VehicleModel::new(vehicle) else { return Output::repeat(f64::INFINITY) };
    let weight = weights(sigma);
    let evaluated: Vec<Evaluated> = segments(data, SEGMENT_S)
        .into_par_iter()
        .map(|mut segment| {
            for _ in 0..2 {
                let evaluated = evaluate(&model, &segment, &weight);
                let moved = start_inverse(&evaluated, 0.0) * evaluated.gradient.fixed_rows::<OUTPUTS>(EXTENDED);
                for (index, value) in OUTPUT_STATES.iter().zip(moved.iter()) {
                    segment.start[*index] += value;
                }
            }
            evaluate(&model, &segment, &weight)
        })
        .collect();
    residuals(&evaluated)
}

/// The method by itself: from the prior, by way of the board's identifier.
pub(crate) fn identify(
    data: &IdentificationData,
    prior: &VehicleParameters,
    options: &Options,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Estimate, IdentifyError> {
    let first = aid::online(data, prior, options)?;
    let free = free(options, options.cross_drag);
    let fit = fit(data, prior, (&parameters::of(&first.vehicle), false), &free, options, progress)?;
    Ok(described(Method::OutputError, data, prior, options, &fit.parameters, Some(&fit.covariance)))
}
