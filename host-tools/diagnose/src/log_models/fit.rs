//! θ by Gauss and Newton on whitened rows, with what is known of it before.

use super::layout::Layout;
use super::model::{LogModel, Row, catalogue_range};
use super::noise::{self, HUBER, Noise};
use crate::candidates::Hypothesis;
use crate::linear::{self, Fit};
use crate::normal_equations::{BlockEquations, BlockEquationsBuilder, NormalEquations};
use crate::split::DataPart;
use crate::whitener::{Pass, Residual};
use backseat_logs::interrupt;

/// Steps of Gauss and Newton: the models are linear or nearly so.
const STEPS: usize = 12;
/// Share added to the information of each column: columns that a precise log does not tell apart stay where they are.
const RIDGE: f64 = 1e-8;
/// Rounds in which noise and θ follow each other.
const ROUNDS: usize = 4;

/// A column of θ from an onset on: zero before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    pub column: usize,
    pub onset_s: f64,
}

/// A model with the blocks of its log, its noise, and what is known of its columns before the log.
pub(super) struct Fitting<'a, M> {
    pub model: &'a M,
    pub layout: Layout,
    pub noise: Vec<Noise>,
    /// Mean and 1/σ² of every column.
    prior: Vec<[f64; 2]>,
}

impl<'a, M: LogModel> Fitting<'a, M> {
    /// With its noise, and θ with every entry fitted together on the data that fit and choose.
    pub fn new(model: &'a M, layout: Layout) -> Option<(Self, Vec<f64>)> {
        let mut prior = vec![[0.0, 0.0]; model.columns()];
        let mut columns = model.calibrated();
        for (entry, own) in model.entries() {
            for (place, column) in own.iter().enumerate() {
                let [low, high] = catalogue_range(entry, place);
                let sigma = 0.5 * (high - low);
                prior[*column] = [0.0, if sigma.is_finite() { sigma.powi(-2) } else { 0.0 }];
            }
            columns.extend(own);
        }
        columns.sort_unstable();
        columns.dedup();
        for (column, prior) in prior.iter_mut().enumerate() {
            if let Some([mean, sigma]) = model.prior(column) {
                *prior = [mean, sigma.powi(-2)];
            }
        }
        let mut theta = model.guess();
        let rows = model.rows(&theta);
        let is_summed = |channel| model.is_summed(channel);
        let noise = noise::estimate(&rows, &layout, is_summed, 0);
        let mut fitting = Self { model, layout, noise, prior };
        if model.guess().iter().any(|value| *value != 0.0) {
            // What a guess leaves is the effects themselves: it says nothing of the noise's memory.
            fitting.noise.iter_mut().for_each(|noise| {
                noise.white = noise.white.hypot(noise.slow);
                noise.slow = 0.0;
            });
        }
        for _ in 0..ROUNDS {
            theta = fitting.solve(&columns, &theta, DataPart::Seen)?;
            let rows = model.rows(&theta);
            fitting.noise = noise::estimate(&rows, &fitting.layout, is_summed, columns.len());
        }
        theta = fitting.solve(&columns, &theta, DataPart::Seen)?;
        for _ in 0..ROUNDS {
            let Some(better) = fitting.other_start(&columns, &theta) else { break };
            theta = better;
            fitting.noise = noise::estimate(&model.rows(&theta), &fitting.layout, is_summed, columns.len());
            theta = fitting.solve(&columns, &theta, DataPart::Seen)?;
        }
        let theta = fitting.model.of_those_alike(theta);
        Some((fitting, theta))
    }

    /// Where a fit from another start of a column ends, if the data say so clearly.
    fn other_start(&self, columns: &[usize], theta: &[f64]) -> Option<Vec<f64>> {
        /// By chance the cost of one of ten starts does not fall by so much.
        const CLEARLY: f64 = 10.0;
        let cost = |theta: &[f64]| {
            let pass = self.pass(&self.model.rows(theta), &[]);
            let left = self.cost(&pass, theta, DataPart::Seen);
            (pass, left)
        };
        let starts = self.model.starts();
        let mut nowhere = theta.to_vec();
        starts.iter().for_each(|(column, _)| nowhere[*column] = 0.0);
        let starts = starts.iter().flat_map(|(column, values)| values.iter().map(move |value| (*column, *value)));
        // one step from each tells which is worth more
        let foreseen = starts.filter_map(|(column, value)| {
            // the others of them begin at none: only what they differ by may show
            let mut start = nowhere.clone();
            start[column] = value;
            let (pass, left) = cost(&start);
            let fit = linear::fit(&self.equations(&pass, &start, DataPart::Seen), columns, &[])?;
            Some((left - fit.gain, start))
        });
        let (_, start) = foreseen.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let moved = self.solve(columns, &start, DataPart::Seen)?;
        (cost(&moved).1 < cost(theta).1 - CLEARLY).then_some(moved)
    }

    /// Whether a block belongs to a part.
    pub fn is_in(&self, part: DataPart) -> impl Fn(usize) -> bool + '_ {
        move |block| self.layout.is_in(part, block)
    }

    /// Whitened residuals and normal equations at θ; the columns of `steps` stand behind those of θ.
    pub fn pass(&self, rows: &[Row], steps: &[Step]) -> Pass {
        interrupt::check();
        let count = rows.first().map_or(self.model.columns(), |row| row.slopes.len()) + steps.len();
        let origins = self.origins(rows, steps);
        let slopes = |place: usize| -> Vec<f64> {
            let row = &rows[place];
            let of_steps = steps.iter().enumerate().map(|(i, step)| {
                if row.t_s < step.onset_s {
                    return 0.0;
                }
                row.slopes[step.column] - origins.get(&(row.sequence, row.channel, i)).copied().unwrap_or(0.0)
            });
            row.slopes.iter().copied().chain(of_steps).collect()
        };
        let mut whitened: Vec<(usize, Residual, f64, Vec<f64>)> = Vec::with_capacity(rows.len());
        for noise in &self.noise {
            for w in noise.whiten(rows, &self.layout, &slopes) {
                let row = &rows[w.row];
                let residual = Residual {
                    t_s: row.t_s,
                    channel: row.channel,
                    innovation: w.e * w.sigma,
                    sigma: w.sigma,
                    alike: 1.0,
                    used: true,
                    station: None,
                    is_moved_by_waves: false,
                };
                let weight = (HUBER / w.e.abs()).min(1.0).sqrt();
                whitened.push((self.layout.block(row.t_s), residual, weight, w.slopes));
            }
        }
        whitened.sort_by(|a, b| {
            (a.0, a.1.t_s, a.1.channel).partial_cmp(&(b.0, b.1.t_s, b.1.channel)).unwrap_or(std::cmp::Ordering::Equal)
        });
        let mut blocks = Vec::new();
        rayon::in_place_scope(|scope| {
            let mut builder = BlockEquationsBuilder::new(count, 1.0, scope);
            for (block, r, weight, slopes) in &whitened {
                builder.row(*block as f64 + 0.5, weight * r.normalised(), slopes, -weight);
            }
            blocks = builder.finish();
        });
        let residuals = whitened.into_iter().map(|(_, residual, ..)| residual).collect();
        Pass { residuals, normal: BlockEquations::collect(count, blocks), ..Pass::default() }
    }

    /// Of summed channels, the derivative at the last row before an onset in its sequence: what is added counts from there.
    fn origins(
        &self,
        rows: &[Row],
        steps: &[Step],
    ) -> std::collections::BTreeMap<(u32, crate::samples::ResidualChannel, usize), f64> {
        let mut origins = std::collections::BTreeMap::new();
        for row in rows.iter().filter(|row| self.model.is_summed(row.channel)) {
            for (i, step) in steps.iter().enumerate().filter(|(_, step)| row.t_s < step.onset_s) {
                origins.insert((row.sequence, row.channel, i), row.slopes[step.column]);
            }
        }
        origins
    }

    /// Normal equations of a part of a pass about θ, with what is known before.
    pub fn equations(&self, pass: &Pass, theta: &[f64], part: DataPart) -> NormalEquations {
        let sum = pass.normal.sum(self.is_in(part));
        let count = pass.normal.columns;
        let mut information = Vec::with_capacity(count * (count + 1) / 2);
        for i in 0..count {
            information.extend((0..=i).map(|j| sum.information(i, j)));
            let known = self.prior.get(i).map_or(0.0, |[_, precision]| *precision);
            if let Some(own) = information.last_mut() {
                *own += known + RIDGE * *own;
            }
        }
        let score = (0..count)
            .map(|i| {
                let prior = self.prior.get(i).zip(theta.get(i));
                sum.score(i) + prior.map_or(0.0, |([mean, precision], at)| precision * (mean - at))
            })
            .collect();
        let mut equations = NormalEquations::new(information, score);
        (equations.square, equations.count) = (sum.square, sum.count);
        equations
    }

    /// What the data say against θ: Huber's sum over a part, and the prior's.
    pub fn cost(&self, pass: &Pass, theta: &[f64], part: DataPart) -> f64 {
        let is_in = self.is_in(part);
        // An outlier that is left out costs what it would at the limit: else a wrong θ that loses rows looked better.
        let data: f64 = pass
            .residuals
            .iter()
            .filter(|r| is_in(self.layout.block(r.t_s)))
            .map(|r| noise::loss(r.normalised()) - noise::loss(noise::OUTLIER))
            .sum();
        let known: f64 =
            self.prior.iter().zip(theta).map(|([mean, precision], at)| precision * (at - mean).powi(2)).sum();
        data + known
    }

    /// Fits the `free` columns on a part from `start`; the others stay.
    pub fn solve(&self, free: &[usize], start: &[f64], part: DataPart) -> Option<Vec<f64>> {
        /// A step below this many sigmas changes nothing that matters.
        const SMALL: f64 = 0.01;
        const ROUNDING: f64 = 1e-9;
        const LEAST_SHARE: f64 = 1e-3;
        let mut theta = start.to_vec();
        if free.is_empty() {
            return Some(theta);
        }
        let mut pass = self.pass(&self.model.rows(&theta), &[]);
        let mut cost = self.cost(&pass, &theta, part);
        for _ in 0..STEPS {
            let fit = linear::fit(&self.equations(&pass, &theta, part), free, &[])?;
            let mut share = 1.0;
            let step = loop {
                let mut moved = theta.clone();
                for (column, step) in free.iter().zip(&fit.theta) {
                    moved[*column] += share * step;
                }
                let fresh = self.pass(&self.model.rows(&moved), &[]);
                let fresh_cost = self.cost(&fresh, &moved, part);
                if fresh_cost <= cost + ROUNDING * cost.abs() {
                    break Some((moved, fresh, fresh_cost));
                }
                share *= 0.5;
                if share < LEAST_SHARE {
                    break None;
                }
            };
            let Some((moved, fresh, fresh_cost)) = step else { break };
            (theta, pass, cost) = (moved, fresh, fresh_cost);
            if fit.theta.iter().enumerate().all(|(i, step)| step.abs() < SMALL * fit.sigma(i)) {
                break;
            }
        }
        theta.iter().all(|value| value.is_finite()).then_some(theta)
    }

    /// Fits what is chosen; the rest is zero.
    pub fn refit(&self, chosen: &[Hypothesis], from: &[f64]) -> Option<Vec<f64>> {
        let free: Vec<usize> =
            self.model.calibrated().into_iter().chain(chosen.iter().flat_map(|h| h.free.clone())).collect();
        let guess = self.model.guess();
        let start: Vec<f64> = (0..from.len())
            .map(|column| match (free.contains(&column), from[column] != 0.0) {
                (true, true) => from[column],
                (true, false) => guess[column],
                (false, _) => 0.0,
            })
            .collect();
        self.solve(&free, &start, DataPart::Seen)
    }

    /// One sigma of free columns on the data that fit and choose: the larger of the Hessian's and the scatter's over
    /// blocks.
    pub fn sigmas(&self, pass: &Pass, equations: &NormalEquations, free: &[usize]) -> Option<Vec<f64>> {
        if free.is_empty() {
            return Some(Vec::new());
        }
        let covariance = linear::fit(equations, free, &[])?.covariance;
        let at = Fit { gain: 0.0, theta: vec![0.0; free.len()], covariance };
        Some(linear::sigmas(&pass.normal, self.is_in(DataPart::Seen), free, &at, &[]))
    }
}
