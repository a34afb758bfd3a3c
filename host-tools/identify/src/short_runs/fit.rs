//! Gauss-Newton over all windows: common unknowns, and the start of every window as unknowns of its own.
//!
//! The starts leave the normal equations window by window (Schur's complement). Every unknown has a prior, so that what
//! the runs do not show stays at the textbook's value. Errors of a prediction are not independent from row to row: their
//! information is divided by `CORRELATED` rows.

use super::model::RunModel;
use super::predict::{CHANNELS, errors};
use super::recording::{Run, Wanted, Window, windows};
use super::start::{OPEN, measured_state, moved, open};
use super::unknowns::{Draft, Place, SPREAD, Unknown};
use backseat_core::state::VehicleState;
use backseat_logs::interrupt;
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use rayon::prelude::*;

/// One sigma of what a good model leaves of each channel over some seconds, SI.
const SIGMA: [f64; CHANNELS.len()] = [0.035, 0.026, 0.06, 0.20, 0.08, 0.10];
/// Residuals beyond so many sigmas count linearly.
const HUBER: f64 = 2.5;
/// Rows that make one independent error: windows overlap, and errors persist for a second or two.
const CORRELATED: f64 = 6.0;
/// The same two of the next few rows.
const SIGMA_OF_ROWS: [f64; CHANNELS.len()] = [0.010, 0.004, 0.004, 0.06, 0.08, 0.10];
const CORRELATED_ROWS: f64 = 3.0;
/// One sigma of a start that the rows tell, in the order of [`OPEN`].
const OF_ROWS: [f64; STARTS] = [0.05, 0.05, 0.05, 0.3, 0.1, 0.1, 0.1, 0.3, 0.1, 0.1];
const STARTS: usize = OPEN.len();
/// Share of what is open of a start where it is to be held.
const HELD: f64 = 0.3;
/// Steps of the iteration at each length.
const STEPS: usize = 60;
/// Steps of the starts alone.
const SETTLING: usize = 3;
/// Attempts at a step, each shorter than the last.
const ATTEMPTS: usize = 10;
/// A step that gains less than this share ends it.
const SETTLED: f64 = 3e-5;

/// What a fit may do with the starts of its windows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Starts {
    /// Move them by what the rows leave open: the values are the vehicle's.
    Open,
    /// Hardly move them: the values are those that predict best from a start that is measured, and make up for its errors.
    Held,
    /// Take them from the rows of the window: over a few seconds these tell when something happens.
    Rows,
}

impl Starts {
    /// One sigma of each channel, and how many rows make one independent error: errors persist for a second or two.
    const fn noise(self) -> ([f64; CHANNELS.len()], f64) {
        match self {
            Self::Open | Self::Held => (SIGMA, CORRELATED),
            Self::Rows => (SIGMA_OF_ROWS, CORRELATED_ROWS),
        }
    }
}

/// What is fitted to which runs.
#[derive(Clone, Debug)]
pub struct Problem<'a> {
    /// All runs.
    pub runs: &'a [Run],
    /// Model that the unknowns are added to.
    pub base: Draft,
    /// What is fitted.
    pub unknowns: Vec<Unknown>,
    /// What becomes of the starts.
    pub starts: Starts,
}

/// A fit.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Values in the order of the unknowns.
    pub values: Vec<f64>,
    /// Covariance by the information of data and prior.
    pub covariance: DMatrix<f64>,
    /// Share of the information that the prior gives, 0 to 1.
    pub prior_share: Vec<f64>,
    /// Robust cost, with the priors.
    pub cost: f64,
    /// Normal matrix and gradient of data and priors, and the part of each run, at the values.
    pub(super) information: DMatrix<f64>,
    pub(super) parts: Vec<Part>,
}

#[derive(Clone, Debug)]
pub(super) struct Part {
    pub(super) run: usize,
    pub(super) normal: DMatrix<f64>,
    pub(super) gradient: DVector<f64>,
}

struct Shot {
    window: Window,
    measured: VehicleState,
    /// One sigma of what is open of it.
    open: [f64; STARTS],
    deviation: SVector<f64, STARTS>,
}

struct Evaluated {
    normal: DMatrix<f64>,
    gradient: DVector<f64>,
    /// Inverse of the start's normal matrix, its gradient, and its border with the unknowns.
    inverse: SMatrix<f64, STARTS, STARTS>,
    start_gradient: SVector<f64, STARTS>,
    border: DMatrix<f64>,
}

impl Evaluated {
    /// Normal matrix and gradient of the unknowns with the start taken out.
    fn reduced(&self) -> (DMatrix<f64>, DVector<f64>) {
        let normal = &self.normal - &self.border * self.inverse * self.border.transpose();
        (normal, &self.gradient - &self.border * (self.inverse * self.start_gradient))
    }
}

/// The models at some values, and those at each value moved a little, with the size of the move.
type Around = (Vec<RunModel>, Vec<(Vec<RunModel>, f64)>);

impl Problem<'_> {
    /// Fits to the runs that `is_used`, from `start`, with windows that grow to each of `lengths_s`.
    pub fn fit(&self, is_used: &(dyn Fn(usize) -> bool + Sync), start: &[f64], lengths_s: &[f64]) -> Option<Fit> {
        let mut values = DVector::from_column_slice(start);
        let mut last = None;
        let mut at_end = Vec::new();
        for &length_s in lengths_s {
            let mut shots = self.shots(is_used, length_s);
            if shots.is_empty() {
                return None;
            }
            last = Some(self.iterate(&mut values, &mut shots)?);
            at_end = shots;
        }
        let cost = last?;
        // all at the last values: what a run says is part of what all say
        let parts = self.parts(&values, &at_end)?;
        let normal = parts.iter().fold(self.precision(), |sum, part| sum + &part.normal);
        let covariance = normal.clone().cholesky()?.inverse();
        let by_prior = self.precision().cholesky()?.inverse();
        let prior_share = (0..values.len()).map(|i| (covariance[(i, i)] / by_prior[(i, i)]).clamp(0.0, 1.0)).collect();
        let values = values.iter().copied().collect();
        Some(Fit { values, covariance, prior_share, cost, information: normal, parts })
    }

    /// Covariance by the information at some values: starts are settled there, the values stay.
    pub fn covariance_at(
        &self,
        is_used: &(dyn Fn(usize) -> bool + Sync),
        values: &[f64],
        length_s: f64,
    ) -> Option<DMatrix<f64>> {
        let values = DVector::from_column_slice(values);
        let mut shots = self.shots(is_used, length_s);
        let models = self.models_around(&values)?;
        for _ in 0..SETTLING {
            shots.par_iter_mut().for_each(|shot| {
                let at = self.evaluate(&models, shot);
                shot.deviation += at.inverse * at.start_gradient;
            });
        }
        let parts = self.parts(&values, &shots)?;
        let normal = parts.iter().fold(self.precision(), |sum, part| sum + &part.normal);
        Some(normal.cholesky()?.inverse())
    }

    fn prior(&self) -> DVector<f64> {
        DVector::from_iterator(self.unknowns.len(), self.unknowns.iter().map(|unknown| unknown.prior))
    }

    /// Inverse covariance of the prior: of each unknown, and of what a term differs by between two configurations.
    fn precision(&self) -> DMatrix<f64> {
        let of_each = self.unknowns.iter().map(|unknown| unknown.sigma.powi(-2));
        let mut precision = DMatrix::from_diagonal(&DVector::from_iterator(self.unknowns.len(), of_each));
        for (i, one) in self.unknowns.iter().enumerate() {
            for (j, other) in self.unknowns.iter().enumerate().take(i) {
                if let (Place::Of(term, _), Place::Of(same, _)) = (one.place, other.place)
                    && term == same
                {
                    let weight = SPREAD[term].powi(-2);
                    [(i, i), (j, j)].into_iter().for_each(|own| precision[own] += weight);
                    [(i, j), (j, i)].into_iter().for_each(|pair| precision[pair] -= weight);
                }
            }
        }
        precision
    }

    /// What each run says at the values.
    fn parts(&self, values: &DVector<f64>, shots: &[Shot]) -> Option<Vec<Part>> {
        let models = self.models_around(values)?;
        let evaluated: Vec<Evaluated> = shots.par_iter().map(|shot| self.evaluate(&models, shot)).collect();
        let mut parts: Vec<Part> = Vec::new();
        for (shot, one) in shots.iter().zip(&evaluated) {
            let (normal, gradient) = one.reduced();
            match parts.iter_mut().find(|part| part.run == shot.window.run) {
                Some(part) => {
                    part.normal += normal;
                    part.gradient += gradient;
                }
                None => parts.push(Part { run: shot.window.run, normal, gradient }),
            }
        }
        Some(parts)
    }

    fn shots(&self, is_used: &(dyn Fn(usize) -> bool + Sync), length_s: f64) -> Vec<Shot> {
        let wanted = Wanted { depth_m: 0.5, powered: false, speed_mps: 0.4 };
        let windows = windows(self.runs, wanted, length_s, 3.0);
        let used = windows.into_iter().filter(|window| is_used(window.run));
        used.map(|window| Shot {
            window,
            measured: measured_state(&self.runs[window.run], window.first, &self.base.dvl),
            open: match self.starts {
                Starts::Open => open(&self.runs[window.run], window.first),
                Starts::Held => OPEN.map(|(_, sigma)| HELD * sigma),
                Starts::Rows => OF_ROWS,
            },
            deviation: SVector::zeros(),
        })
        .collect()
    }

    /// Steps until the cost settles; the cost at the end.
    fn iterate(&self, values: &mut DVector<f64>, shots: &mut [Shot]) -> Option<f64> {
        let count = self.unknowns.len();
        let (precision, prior) = (self.precision(), self.prior());
        let mut damping = 1e-2;
        let mut cost = self.cost(values, shots, None)?;
        for _ in 0..STEPS {
            let models = self.models_around(values)?;
            let evaluated: Vec<Evaluated> = shots.par_iter().map(|shot| self.evaluate(&models, shot)).collect();
            let mut normal = DMatrix::zeros(count, count);
            let mut gradient = DVector::zeros(count);
            for part in &evaluated {
                let (of_window, by_window) = part.reduced();
                normal += of_window;
                gradient += by_window;
            }
            normal += &precision;
            gradient -= &precision * (&*values - &prior);
            let before = cost;
            let mut has_improved = false;
            for _ in 0..ATTEMPTS {
                let mut damped = normal.clone();
                for i in 0..count {
                    damped[(i, i)] *= 1.0 + damping;
                }
                let step = damped.cholesky()?.solve(&gradient);
                let trial = &*values + &step;
                let deviations: Vec<SVector<f64, STARTS>> = shots
                    .iter()
                    .zip(&evaluated)
                    .map(|(shot, part)| {
                        shot.deviation + part.inverse * (part.start_gradient - part.border.transpose() * &step)
                    })
                    .collect();
                if let Some(lower) = self.cost(&trial, shots, Some(&deviations)).filter(|lower| *lower < cost) {
                    cost = lower;
                    *values = trial;
                    shots.iter_mut().zip(deviations).for_each(|(shot, deviation)| shot.deviation = deviation);
                    damping = (damping * 0.2).max(1e-6);
                    has_improved = true;
                    break;
                }
                damping *= 6.0;
            }
            if !has_improved || before - cost < SETTLED * cost {
                break;
            }
        }
        Some(cost)
    }

    fn models(&self, values: &[f64]) -> Option<Vec<RunModel>> {
        let draft = self.base.with(&self.unknowns, values);
        if draft.outside().is_some() {
            return None;
        }
        draft.models().ok()
    }

    /// The models at the values, and at each value moved a little, with the size of the move.
    fn models_around(&self, values: &DVector<f64>) -> Option<Around> {
        let here = self.models(values.as_slice())?;
        let moved: Option<Vec<_>> = (0..values.len())
            .map(|i| {
                let of = |size: f64| {
                    let mut moved = values.clone();
                    moved[i] += size;
                    self.models(moved.as_slice()).map(|models| (models, size))
                };
                let size = 1e-3 * self.unknowns[i].sigma;
                of(size).or_else(|| of(-size))
            })
            .collect();
        Some((here, moved?))
    }

    fn residuals(&self, models: &[RunModel], shot: &Shot, deviation: &SVector<f64, STARTS>) -> Vec<f64> {
        let run = &self.runs[shot.window.run];
        let model = models.get(run.configuration).unwrap_or(&models[0]);
        // a DVL that reads too much has begun too fast as well
        let surge_factor = (1.0 + self.base.dvl.scale) / (1.0 + model.dvl().scale);
        let readings = model.predict(run, shot.window, &moved(&shot.measured, surge_factor, deviation.as_slice()));
        let (sigma, _) = self.starts.noise();
        errors(run, shot.window, &readings)
            .iter()
            .flat_map(|row| row.iter().zip(sigma).map(|(error, sigma)| error.map_or(0.0, |error| error / sigma)))
            .collect()
    }

    fn evaluate(&self, models: &Around, shot: &Shot) -> Evaluated {
        interrupt::check();
        let (here, moved) = models;
        let (_, correlated) = self.starts.noise();
        let residual = self.residuals(here, shot, &shot.deviation);
        let rows = residual.len();
        let weights: Vec<f64> = residual.iter().map(|r| HUBER / r.abs().max(HUBER) / correlated).collect();
        // columns of −∂r/∂(unknown): what the prediction gains
        let column = |other: &[f64], size: f64| -> Vec<f64> {
            residual.iter().zip(other).map(|(here, other)| (here - other) / size).collect()
        };
        let unknowns: Vec<Vec<f64>> =
            moved.iter().map(|(models, size)| column(&self.residuals(models, shot, &shot.deviation), *size)).collect();
        let starts: Vec<Vec<f64>> = shot
            .open
            .iter()
            .enumerate()
            .map(|(place, sigma)| {
                let size = 1e-2 * sigma;
                let mut deviation = shot.deviation;
                deviation[place] += size;
                column(&self.residuals(here, shot, &deviation), size)
            })
            .collect();
        let product = |a: &[f64], b: &[f64]| -> f64 { (0..rows).map(|k| weights[k] * a[k] * b[k]).sum() };
        let count = unknowns.len();
        let mut normal = DMatrix::zeros(count, count);
        for i in 0..count {
            for j in 0..=i {
                normal[(i, j)] = product(&unknowns[i], &unknowns[j]);
                normal[(j, i)] = normal[(i, j)];
            }
        }
        let gradient = DVector::from_fn(count, |i, _| product(&unknowns[i], &residual));
        let border = DMatrix::from_fn(count, STARTS, |i, j| product(&unknowns[i], &starts[j]));
        let mut own = SMatrix::<f64, STARTS, STARTS>::from_fn(|i, j| product(&starts[i], &starts[j]));
        let mut start_gradient = SVector::<f64, STARTS>::from_fn(|i, _| product(&starts[i], &residual));
        for (i, sigma) in shot.open.iter().enumerate() {
            let weight = sigma.powi(-2);
            own[(i, i)] += weight;
            start_gradient[i] -= weight * shot.deviation[i];
        }
        let inverse = own.cholesky().map_or_else(SMatrix::zeros, |factor| factor.inverse());
        Evaluated { normal, gradient, inverse, start_gradient, border }
    }

    /// Robust cost with the priors of unknowns and starts; `None` where the model is outside its ranges.
    fn cost(&self, values: &DVector<f64>, shots: &[Shot], deviations: Option<&[SVector<f64, STARTS>]>) -> Option<f64> {
        let models = self.models(values.as_slice())?;
        let (_, correlated) = self.starts.noise();
        let each: Vec<f64> = shots
            .par_iter()
            .enumerate()
            .map(|(place, shot)| {
                let deviation = deviations.map_or(&shot.deviation, |all| &all[place]);
                let residual = self.residuals(&models, shot, deviation);
                let data: f64 = residual
                    .iter()
                    .map(|r| if r.abs() <= HUBER { r * r } else { HUBER * (2.0 * r.abs() - HUBER) })
                    .sum();
                let prior: f64 = shot.open.iter().zip(deviation.iter()).map(|(s, d)| (d / s).powi(2)).sum();
                data / correlated + prior
            })
            .collect();
        let off = values - self.prior();
        let cost = each.iter().sum::<f64>() + off.dot(&(self.precision() * &off));
        cost.is_finite().then_some(cost)
    }
}
