//! Output-error fit of a manoeuvring model (Gauss and Newton with Levenberg's damping): segments with free starts, which
//! are eliminated segment by segment.

use super::{ManoeuvringData, ManoeuvringEstimate, STATES, start};
use crate::vessel::model::ManoeuvringModel;
use crate::vessel::readings::Reading;
use backseat_identify::IdentifyError;
use backseat_logs::stats::{Z_95, rms};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use rayon::prelude::*;

const ITERATIONS: usize = 30;
/// Part by which the cost falls in a step worth another.
const LEAST_GAIN: f64 = 1e-5;
/// Steps of the derivatives: of a coefficient in parts of its axis' largest acceleration, of a start in the unit of the
/// state.
const STEP: f64 = 1e-5;
/// One sigma of an output at least: what a log's digits resolve.
const LEAST_SIGMA: [f64; STATES] = [1e-4, 1e-4, 1e-5, 1e-5, 1e-3, 1e-3];
/// Scores of few segments may scatter less by chance.
const LEAST_INFLATION: f64 = 0.5;

/// Segments with their starts, and the model that is fitted to them.
pub(super) struct Fit<'a> {
    segments: Vec<&'a [Reading]>,
    measured: [bool; STATES],
    model: ManoeuvringModel,
    starts: Vec<[f64; STATES]>,
    sigma: [f64; STATES],
}

/// What one segment says: of the coefficients with its start taken out, and of its start.
struct Reduced {
    information: DMatrix<f64>,
    score: DVector<f64>,
    /// Start = `base` + `by_theta` · change of the coefficients.
    base: SVector<f64, STATES>,
    by_theta: DMatrix<f64>,
}

impl<'a> Fit<'a> {
    pub(super) fn new(data: &ManoeuvringData, segments: Vec<&'a [Reading]>, model: ManoeuvringModel) -> Self {
        let has_position = segments.iter().copied().flatten().any(|reading| reading.position_m.is_some());
        let [u, v, r] = data.measured;
        let starts = segments.iter().map(|segment| start(&segment[0])).collect();
        let measured = [u, v, r, true, has_position, has_position];
        Self { segments, measured, model, starts, sigma: [0.05, 0.05, 0.02, 0.05, 0.5, 0.5] }
    }

    fn with(&self, theta: &[f64]) -> ManoeuvringModel {
        let mut model = self.model.clone();
        model.coefficients.iter_mut().zip(theta).for_each(|(coefficient, value)| coefficient.value = *value);
        model
    }

    fn theta(&self) -> Vec<f64> {
        self.model.coefficients.iter().map(|coefficient| coefficient.value).collect()
    }

    /// Measured less simulated, over sigma; zero where nothing was measured.
    fn residuals(&self, model: &ManoeuvringModel, start: [f64; STATES], segment: &[Reading]) -> Vec<[f64; STATES]> {
        let states = model.simulate(start, segment);
        let of = |(state, reading): (&[f64; STATES], &Reading)| {
            let measurement = super::start(reading);
            [0, 1, 2, 3, 4, 5].map(|i| {
                let is_there = self.measured[i] && (i < 4 || reading.position_m.is_some());
                if is_there { (measurement[i] - state[i]) / self.sigma[i] } else { 0.0 }
            })
        };
        states.iter().zip(segment).map(of).collect()
    }

    fn cost(&self, model: &ManoeuvringModel, starts: &[[f64; STATES]]) -> f64 {
        let of = |(segment, start): (&&[Reading], &[f64; STATES])| -> f64 {
            self.residuals(model, *start, segment).iter().flatten().map(|residual| residual * residual).sum()
        };
        self.segments.iter().zip(starts).map(of).sum()
    }

    /// Linear in coefficients and start about the present ones, by differences, the start taken out.
    fn reduced(&self, place: usize, steps: &[f64]) -> Reduced {
        let (segment, start) = (self.segments[place], self.starts[place]);
        let (theta, count) = (self.theta(), steps.len());
        let here = self.residuals(&self.model, start, segment);
        let slope = |moved: Vec<[f64; STATES]>, step: f64| -> Vec<[f64; STATES]> {
            moved.iter().zip(&here).map(|(a, b)| [0, 1, 2, 3, 4, 5].map(|i| (b[i] - a[i]) / step)).collect()
        };
        let mut slopes: Vec<Vec<[f64; STATES]>> = (0..count)
            .map(|j| {
                let mut theta = theta.clone();
                theta[j] += steps[j];
                slope(self.residuals(&self.with(&theta), start, segment), steps[j])
            })
            .collect();
        slopes.extend((0..STATES).map(|j| {
            let mut start = start;
            start[j] += STEP;
            slope(self.residuals(&self.model, start, segment), STEP)
        }));
        let dot = |a: &[[f64; STATES]], b: &[[f64; STATES]]| -> f64 {
            a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a * b).sum()
        };
        let theta_theta = DMatrix::from_fn(count, count, |i, j| dot(&slopes[i], &slopes[j]));
        let start_theta = DMatrix::from_fn(STATES, count, |i, j| dot(&slopes[count + i], &slopes[j]));
        // a state that nothing measures (place without positions) stays where it is
        let start_start = SMatrix::<f64, STATES, STATES>::from_fn(|i, j| {
            dot(&slopes[count + i], &slopes[count + j]) + if i == j { 1e-9 } else { 0.0 }
        });
        let by_theta = DVector::from_fn(count, |i, _| dot(&slopes[i], &here));
        let by_start = SVector::<f64, STATES>::from_fn(|i, _| dot(&slopes[count + i], &here));
        let inverse = start_start.try_inverse().unwrap_or_else(SMatrix::zeros);
        let gain = DMatrix::from_column_slice(STATES, STATES, inverse.as_slice());
        let base = inverse * by_start;
        let start_score = DVector::from_column_slice(base.as_slice());
        Reduced {
            information: theta_theta - start_theta.transpose() * &gain * &start_theta,
            score: by_theta - start_theta.transpose() * start_score,
            base,
            by_theta: -(gain * start_theta),
        }
    }

    /// Steps of the coefficients: each changes the acceleration by the same small part of the axis' largest term.
    fn steps(&self) -> Vec<f64> {
        let coefficients = &self.model.coefficients;
        let sizes: Vec<f64> = coefficients
            .iter()
            .map(|c| {
                let values = self.segments.iter().copied().flatten();
                let term = self.model.terms(c.axis).nth(c.term);
                let values: Vec<f64> =
                    values.filter_map(|reading| Some(term.as_ref()?.value(&reading.manoeuvre()))).collect();
                rms(&values).unwrap_or(0.0).max(f64::MIN_POSITIVE)
            })
            .collect();
        let largest = |axis: usize| {
            let of_axis = coefficients.iter().zip(&sizes).filter(|(c, _)| c.axis == axis);
            of_axis.fold(0.0_f64, |most, (c, size)| most.max(c.value.abs() * size))
        };
        let largest = [0, 1, 2].map(largest);
        coefficients.iter().zip(&sizes).map(|(c, size)| STEP * largest[c.axis] / size).collect()
    }

    /// Fits, leaves out the terms that are not significant, and fits again.
    pub(super) fn run(mut self, segment_s: f64) -> Result<ManoeuvringEstimate, IdentifyError> {
        loop {
            let covariance = self.converge()?;
            let kept = significant(&self.theta(), &covariance);
            if kept.len() < self.model.coefficients.len() {
                self.model.coefficients = kept.iter().map(|i| self.model.coefficients[*i].clone()).collect();
                continue;
            }
            for (i, coefficient) in self.model.coefficients.iter_mut().enumerate() {
                let reach = Z_95 * covariance[(i, i)].max(0.0).sqrt();
                coefficient.ci95 = Some([coefficient.value - reach, coefficient.value + reach]);
            }
            let residual = [0, 1, 2, 3, 4, 5].map(|i| self.measured[i].then_some(self.sigma[i]));
            return Ok(ManoeuvringEstimate { model: self.model, residual, segments: (self.segments.len(), segment_s) });
        }
    }

    /// Moves coefficients and starts to where the cost is least; the covariance of the coefficients there.
    fn converge(&mut self) -> Result<DMatrix<f64>, IdentifyError> {
        let undetermined =
            || IdentifyError::Degenerate("manoeuvring: the log does not determine the coefficients".into());
        let count = self.model.coefficients.len();
        let steps = self.steps();
        if count == 0 {
            return Err(undetermined());
        }
        let (mut damping, mut cost) = (1e-2, self.cost(&self.model, &self.starts));
        let all = |fit: &Self| -> Vec<Reduced> {
            (0..fit.segments.len()).into_par_iter().map(|place| fit.reduced(place, &steps)).collect()
        };
        let sum = |parts: &[Reduced]| {
            let zero = (DMatrix::zeros(count, count), DVector::zeros(count));
            parts.iter().fold(zero, |(a, b), part| (a + &part.information, b + &part.score))
        };
        for _ in 0..ITERATIONS {
            let parts = all(self);
            let (information, score) = sum(&parts);
            let mut next = None;
            while damping < 1e8 {
                let mut damped = information.clone();
                (0..count).for_each(|i| damped[(i, i)] *= 1.0 + damping);
                let Some(factor) = damped.cholesky() else { return Err(undetermined()) };
                let change = factor.solve(&score);
                let theta: Vec<f64> = self.theta().iter().zip(change.iter()).map(|(a, b)| a + b).collect();
                let moved = |(start, part): (&[f64; STATES], &Reduced)| {
                    let by = &part.by_theta * &change;
                    [0, 1, 2, 3, 4, 5].map(|i| start[i] + part.base[i] + by[i])
                };
                let starts: Vec<[f64; STATES]> = self.starts.iter().zip(&parts).map(moved).collect();
                let model = self.with(&theta);
                let trial = self.cost(&model, &starts);
                // not a number where the trial runs away
                if trial < cost {
                    next = Some((model, starts, trial));
                    break;
                }
                damping *= 10.0;
            }
            let Some((model, starts, trial)) = next else { break };
            let gain = 1.0 - trial / cost;
            (self.model, self.starts, damping) = (model, starts, (0.1 * damping).max(1e-9));
            self.rescale();
            cost = self.cost(&self.model, &self.starts);
            if gain < LEAST_GAIN {
                break;
            }
        }
        let parts = all(self);
        let (information, _) = sum(&parts);
        let covariance = information.cholesky().ok_or_else(undetermined)?.inverse();
        // how much more the segments' scores scatter than white residuals would let them, what the fit took away left out
        let (mut scatter, mut expected) = (0.0, 0.0);
        for part in &parts {
            let share = &covariance * &part.information;
            scatter += (part.score.transpose() * &covariance * &part.score)[(0, 0)];
            expected += share.trace() - (&share * &share).trace();
        }
        Ok(covariance * (scatter / expected.max(f64::MIN_POSITIVE)).max(LEAST_INFLATION))
    }

    /// Sigmas by the residuals.
    fn rescale(&mut self) {
        let mut squares = [0.0; STATES];
        let mut count = 0.0_f64;
        for (segment, start) in self.segments.iter().zip(&self.starts) {
            for residual in self.residuals(&self.model, *start, segment) {
                count += 1.0;
                (0..STATES).for_each(|i| squares[i] += (residual[i] * self.sigma[i]).powi(2));
            }
        }
        for i in (0..STATES).filter(|i| self.measured[*i]) {
            self.sigma[i] = (squares[i] / count.max(1.0)).sqrt().max(LEAST_SIGMA[i]);
        }
    }
}

/// Places of the coefficients that are not zero with 95 % confidence, the least significant one taken out at a time; what
/// the others become without it follows from the covariance.
fn significant(theta: &[f64], covariance: &DMatrix<f64>) -> Vec<usize> {
    let (mut theta, mut covariance) = (theta.to_vec(), covariance.clone());
    let mut kept: Vec<usize> = (0..theta.len()).collect();
    loop {
        let significance = |i: &usize| theta[*i] * theta[*i] / covariance[(*i, *i)];
        let least = kept.iter().copied().min_by(|a, b| significance(a).total_cmp(&significance(b)));
        let Some(out) = least.filter(|out| kept.len() > 1 && significance(out) < Z_95 * Z_95) else { return kept };
        let gain: Vec<f64> = (0..theta.len()).map(|i| covariance[(i, out)] / covariance[(out, out)]).collect();
        let (value, row) = (theta[out], covariance.row(out).clone_owned());
        for i in kept.iter().copied() {
            theta[i] -= gain[i] * value;
            kept.iter().for_each(|j| covariance[(i, *j)] -= gain[i] * row[*j]);
        }
        kept.retain(|i| *i != out);
    }
}
