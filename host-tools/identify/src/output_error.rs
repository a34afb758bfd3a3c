//! Prediction-error (output-error) method: the parameters whose free run comes closest to what was measured.
//!
//! The log is cut into segments that start where they please (multiple shooting without continuity: each start, eight
//! numbers, is estimated too). Gauss-Newton with Levenberg's damping on normal equations that are bordered by the
//! starts, which Schur's complement takes out segment by segment. Outputs are weighted by their own residuals, so that
//! neither noise nor what the model lacks has to be declared.

use crate::bordered::Bordered;
use crate::data::IdentificationData;
use crate::estimate::Estimate;
use crate::excitation::described;
use crate::options::{IdentifyError, Method, Options};
use crate::parameters::{self, D26, EXTENDED, Extended};
use crate::sample::{PERIOD_S, Sample};
use crate::simulation::{self, COLUMNS, OUTPUT_STATES, OUTPUTS, Output, Sensitive, moved};
use crate::{aid, smoothing};
use backseat_core::dynamics::{VehicleModel, VehicleParameters};
use backseat_core::state::VehicleState;
use nalgebra::{DMatrix, DVector};
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

/// Samples that are predicted from one start.
pub(crate) struct Segment<'a> {
    pub samples: &'a [Sample],
    pub start: VehicleState,
}

/// What a segment says at one set of parameters.
#[derive(Clone)]
struct Evaluated {
    equations: Bordered<COLUMNS, EXTENDED>,
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
    let mut squares = Output::zeros();
    let equations = Bordered::sum(|add| {
        for sample in segment.samples {
            let residual = simulation::residual(sample, &run.state);
            for (output, (residual, weight)) in residual.iter().zip(weights.iter()).enumerate() {
                let row = core::array::from_fn(|column| run.sensitivity.data.0[column][output]);
                add(&row, *weight, *residual);
            }
            squares += residual.component_mul(&residual);
            run.advance(model, &sample.input);
        }
    });
    Evaluated { equations, squares, samples: segment.samples.len() }
}

/// Squares of the residuals alone.
pub(crate) fn squares(model: &VehicleModel, samples: &[Sample], start: &VehicleState) -> Output {
    let run = simulation::free_run(model, start, samples);
    samples.iter().zip(run.iter().step_by(2)).fold(Output::zeros(), |sum, (sample, x)| {
        let residual = simulation::residual(sample, x);
        sum + residual.component_mul(&residual)
    })
}

fn evaluate_all(model: &VehicleModel, segments: &[Segment<'_>], weights: &Output) -> Vec<Evaluated> {
    segments.par_iter().map(|segment| evaluate(model, segment, weights)).collect()
}

fn total(squares: impl IntoIterator<Item = Output>, weights: &Output) -> f64 {
    squares.into_iter().map(|squares| squares.dot(weights)).sum()
}

pub(crate) fn weights(sigma: &Output) -> Output {
    sigma.map(|sigma| 1.0 / (sigma * sigma))
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
                let prior_right =
                    DVector::from_fn(free.len(), |i, _| ridge[i] * (reference[free[i]] - parameters[free[i]]));
                let Some(change) = Bordered::step(equations(&evaluated), free, &ridge, prior_right, damping) else {
                    damping *= 10.0;
                    continue;
                };
                let mut candidate = parameters + change;
                parameters::project(prior, options.box_ratio, &mut candidate);
                let Some(model_there) = model_of(&candidate) else {
                    damping = (damping * 10.0).max(1.0e-3);
                    continue;
                };
                let trial: Vec<Segment<'_>> = segments
                    .iter()
                    .zip(&evaluated)
                    .map(|(Segment { samples, start }, at)| Segment {
                        samples,
                        start: moved(start, &at.equations.start_step(&change, damping)),
                    })
                    .collect();
                let trial_squares: Vec<Output> =
                    trial.par_iter().map(|s| squares(&model_there, s.samples, &s.start)).collect();
                let trial_cost = total(trial_squares, &weight) + prior_cost(&candidate);
                if trial_cost < cost {
                    accepted = Some((candidate, model_there, trial, trial_cost));
                    damping = (damping * 0.1).max(1.0e-9);
                    break;
                }
                damping = (damping * 10.0).max(1.0e-6);
            }
            let Some((candidate, model_there, trial, trial_cost)) = accepted else { break };
            (parameters, model, segments) = (candidate, model_there, trial);
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

fn equations(evaluated: &[Evaluated]) -> impl Iterator<Item = &Bordered<COLUMNS, EXTENDED>> {
    evaluated.iter().map(|segment| &segment.equations)
}

/// Covariance of the parameters: the larger of the information's inverse and of the robust one.
fn spread(evaluated: &[Evaluated], free: &[usize], ridge: &DVector<f64>) -> Result<DMatrix<f64>, IdentifyError> {
    let [inverse, mut robust] =
        Bordered::covariances(equations(evaluated), free, ridge).ok_or_else(|| broken("the data determine nothing"))?;
    // With fewer segments than parameters the scatter says nothing.
    if evaluated.len() <= 2 * free.len() {
        robust.clone_from(&inverse);
    }
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
                segment.start = moved(&segment.start, &evaluated.equations.start_step(&Extended::zeros(), 0.0));
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
                segment.start = moved(&segment.start, &evaluated.equations.start_step(&Extended::zeros(), 0.0));
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
