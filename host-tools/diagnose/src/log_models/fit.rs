//! θ by Gauss and Newton on whitened rows, and the noise that whitens them.

use super::model::{Entry, LogModel, Row};
use crate::candidates::Hypothesis;
use crate::linear;
use crate::normal_equations::{BlockEquations, BlockEquationsBuilder};
use crate::prepared_log::{DataPart, PreparedLog};
use crate::samples::ResidualChannel;
use crate::whitener::{Pass, Residual};
use backseat_logs::stats::median;

/// Steps of Gauss and Newton: the models are linear or nearly so.
const STEPS: usize = 8;
/// A gap longer than this many memories starts a sequence afresh.
const GAP_MEMORIES: f64 = 5.0;
/// Correlation of neighbours below which they are taken as independent.
const LEAST_CORRELATION: f64 = 0.15;
/// Readings below which a median says little of their scatter.
const FEW: usize = 20;
/// By how much other columns may widen a column's variance before the two are taken as one.
const MOST_INFLATED: f64 = 30.0;
/// The same where effects are known to be coupled, by the numbers that are always fitted above all.
const MOST_INFLATED_COUPLED: f64 = 1e7;
/// Longest memory that is taken as noise, s: what is slower is structure.
const LONGEST_MEMORY_S: f64 = 120.0;

/// First-order Gauss-Markov noise of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Which.
    pub channel: ResidualChannel,
    /// Its standard deviation, in the channel's unit.
    pub sigma: f64,
    /// Its correlation time, s; zero if white.
    pub memory_s: f64,
}

impl Noise {
    /// As a note.
    #[must_use]
    pub fn describe(&self) -> String {
        let (name, unit) = (self.channel.name(), self.channel.unit());
        let memory = match self.memory_s {
            0.0 => "white".to_owned(),
            memory_s => format!("correlated over {memory_s:.0} s"),
        };
        format!("{name}: noise of {:.2e} {unit}, {memory}, estimated from the log", self.sigma)
    }

    /// Share of the last residual that this one holds, and standard deviation of the rest.
    fn step(&self, dt_s: f64) -> (f64, f64) {
        if self.memory_s <= 0.0 || dt_s > GAP_MEMORIES * self.memory_s {
            return (0.0, self.sigma);
        }
        let share = (-dt_s / self.memory_s).exp();
        (share, self.sigma * (1.0 - share * share).sqrt())
    }
}

/// Noise of every channel, from what remains with every separable entry fitted to all of the log; and that fit.
pub(super) fn noise(
    model: &impl LogModel,
    log_data: &PreparedLog,
    calibrated: &[usize],
) -> Option<(Vec<Noise>, Vec<f64>)> {
    let guess = model.guess();
    let rows = model.rows(&guess);
    let mut noise: Vec<Noise> = Vec::new();
    for row in &rows {
        if noise.iter().all(|noise| noise.channel != row.channel) {
            let mut first = of_channel(&rows, row.channel);
            if model.is_coupled() {
                // What a guess leaves is the effects themselves: it says nothing of the noise's memory.
                first.memory_s = 0.0;
            }
            noise.push(first);
        }
    }
    let separable = separable(model, &noise, calibrated);
    let columns: Vec<usize> = calibrated.iter().chain(separable.iter().flat_map(|(_, own)| own)).copied().collect();
    // The weights move the fit and the fit the weights.
    let mut theta = vec![0.0; model.columns()];
    for (column, guess) in guess.into_iter().enumerate().filter(|(column, _)| columns.contains(column)) {
        theta[column] = guess;
    }
    for _ in 0..3 {
        theta = solve(model, log_data, &noise, &columns, &theta, DataPart::Seen)?;
        let rows = model.rows(&theta);
        for noise in &mut noise {
            *noise = of_channel(&rows, noise.channel);
        }
    }
    Some((noise, theta))
}

/// Entries without those that are nearly the same as others to the log.
pub(super) fn separable(model: &impl LogModel, noise: &[Noise], calibrated: &[usize]) -> Vec<Entry> {
    let sum = pass(model, noise, &model.guess()).normal.sum(|_| true);
    let most = if model.is_coupled() { MOST_INFLATED_COUPLED } else { MOST_INFLATED };
    let (mut columns, mut entries) = (calibrated.to_vec(), Vec::new());
    for (name, own) in model.entries() {
        let with: Vec<usize> = columns.iter().chain(&own).copied().collect();
        let Some(fit) = linear::fit(&sum, &with, &[]) else { continue };
        let by_others = |(i, column): (usize, &usize)| fit.sigma(i).powi(2) * sum.information(*column, *column);
        if with.iter().enumerate().map(by_others).fold(0.0, f64::max) < most {
            columns = with;
            entries.push((name, own));
        }
    }
    entries
}

/// Scatter by the median, so that outliers count for little; memory by the correlation of neighbours.
fn of_channel(rows: &[Row], channel: ResidualChannel) -> Noise {
    let of: Vec<(f64, f64)> = rows.iter().filter(|r| r.channel == channel).map(|r| (r.t_s, r.residual)).collect();
    let middle = median(&of.iter().map(|(_, e)| *e).collect::<Vec<_>>()).unwrap_or(0.0);
    let deviations: Vec<f64> = of.iter().map(|(_, e)| (e - middle).abs()).collect();
    let mut sigma = (1.482_602 * median(&deviations).unwrap_or(1.0)).max(1e-9);
    if of.len() < FEW {
        // Most of what they scattered went into the fit.
        let free = of.len().saturating_sub(4).max(1) as f64;
        sigma = sigma.max((of.iter().map(|(_, e)| e * e).sum::<f64>() / free).sqrt());
    }
    let clipped: Vec<(f64, f64)> =
        of.iter().map(|(t, e)| (*t, (e - middle).clamp(-3.0 * sigma, 3.0 * sigma))).collect();
    let steps: Vec<f64> = clipped.windows(2).map(|w| w[1].0 - w[0].0).collect();
    let step_s = median(&steps).unwrap_or(0.0);
    let (mut both, mut square) = (0.0, 0.0);
    for w in clipped.windows(2).filter(|w| w[1].0 - w[0].0 < 2.0 * step_s.max(1e-3)) {
        both += w[0].1 * w[1].1;
        square += 0.5 * (w[0].1 * w[0].1 + w[1].1 * w[1].1);
    }
    let correlation = if square > 0.0 { both / square } else { 0.0 };
    let memory_s = if correlation > LEAST_CORRELATION && clipped.len() > 10 {
        (-step_s / correlation.min(0.999).ln()).min(LONGEST_MEMORY_S)
    } else {
        0.0
    };
    Noise { channel, sigma, memory_s }
}

/// Whitened residuals and normal equations at θ.
pub(super) fn pass(model: &impl LogModel, noise: &[Noise], theta: &[f64]) -> Pass {
    let columns = model.columns();
    let block_s = model.block_s();
    let rows = model.rows(theta);
    let mut whitened: Vec<(Residual, Vec<f64>)> = Vec::with_capacity(rows.len());
    for noise in noise {
        let mut last: Option<&Row> = None;
        for row in rows.iter().filter(|row| row.channel == noise.channel) {
            let dt_s = last.map_or(f64::INFINITY, |last| row.t_s - last.t_s);
            let (share, sigma) = noise.step(dt_s);
            let (mut innovation, mut slopes) = (row.residual, row.slopes.clone());
            if let Some(last) = last.filter(|_| share > 0.0) {
                innovation -= share * last.residual;
                for (slope, before) in slopes.iter_mut().zip(&last.slopes) {
                    *slope -= share * before;
                }
            }
            let residual = Residual { t_s: row.t_s, channel: row.channel, innovation, sigma, alike: 1.0, used: true };
            whitened.push((residual, slopes));
            last = Some(row);
        }
    }
    whitened.sort_by(|a, b| a.0.t_s.total_cmp(&b.0.t_s));
    let mut blocks = Vec::new();
    rayon::in_place_scope(|scope| {
        let mut builder = BlockEquationsBuilder::new(columns, block_s, scope);
        for (r, slopes) in &whitened {
            builder.row(r.t_s, r.normalised(), slopes, -1.0 / r.sigma);
        }
        blocks = builder.finish();
    });
    let residuals = whitened.into_iter().map(|(residual, _)| residual).collect();
    Pass { residuals, normal: BlockEquations::collect(columns, blocks), ..Pass::default() }
}

/// Columns free together.
pub(super) fn free(calibrated: &[usize], chosen: &[Hypothesis]) -> Vec<usize> {
    calibrated.iter().copied().chain(chosen.iter().flat_map(|h| h.free.clone())).collect()
}

/// Fits the `free` columns on a part from `start`; the others stay.
pub(super) fn solve(
    model: &impl LogModel,
    log_data: &PreparedLog,
    noise: &[Noise],
    free: &[usize],
    start: &[f64],
    part: DataPart,
) -> Option<Vec<f64>> {
    /// A step below this many sigmas changes nothing.
    const SMALL: f64 = 1e-3;
    /// What Σ e² may rise by rounding and still be no worse.
    const ROUNDING: f64 = 1e-9;
    /// Shortest part of a step that is tried.
    const LEAST_SHARE: f64 = 0.02;
    let mut theta = start.to_vec();
    if free.is_empty() {
        return Some(theta);
    }
    let sum_at = |theta: &[f64]| pass(model, noise, theta).normal.sum(|block| log_data.is_in(part, block));
    let mut sum = sum_at(&theta);
    for _ in 0..STEPS {
        let fit = linear::fit(&sum, free, &[])?;
        let mut share = 1.0;
        let (moved, fresh) = loop {
            let mut moved = theta.clone();
            for (column, step) in free.iter().zip(&fit.theta) {
                moved[*column] += share * step;
            }
            let fresh = sum_at(&moved);
            if fresh.square <= sum.square * (1.0 + ROUNDING) {
                break (moved, fresh);
            }
            share *= 0.5;
            if share < LEAST_SHARE {
                return Some(theta);
            }
        };
        (theta, sum) = (moved, fresh);
        let is_small = |(i, step): (usize, &f64)| step.abs() < SMALL * fit.sigma(i);
        if fit.theta.iter().enumerate().all(is_small) {
            break;
        }
    }
    theta.iter().all(|value| value.is_finite()).then_some(theta)
}
