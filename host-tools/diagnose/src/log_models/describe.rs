//! What was found, with intervals and alternatives, and what remains.

use super::fit::{self, Noise, free};
use super::model::LogModel;
use crate::alternatives::{Alternative, manoeuvre};
use crate::candidates::{Hypothesis, Instance, continued_by};
use crate::diagnosis::{FoundEffect, ParameterEstimate};
use crate::linear::{self, Fit};
use crate::prepared_log::{DataPart, PreparedLog};
use crate::search;
use crate::structure::NamedTerm;
use crate::whitener::Pass;
use backseat_core::effects::ParameterKind;
use backseat_logs::stats::{Z_95, chi_square_tail, mean_ci95};

/// Probability by chance, all terms counted, below which a term outside the catalogue is reported.
const OUTSIDE: f64 = 2e-3;
/// Most terms outside the catalogue that are reported.
const MOST_OUTSIDE: usize = 3;

pub(super) struct Described<'a, M> {
    pub model: &'a M,
    pub log_data: &'a PreparedLog,
    pub noise: &'a [Noise],
    /// Fitted on the training blocks.
    pub theta: &'a [f64],
    /// At `theta`.
    pub after: &'a Pass,
}

impl<M: LogModel> Described<'_, M> {
    /// Effects with their values on the training blocks and alternatives on all of them; one sigma of every column.
    pub(super) fn effects(
        &self,
        calibrated: &[usize],
        chosen: &[Hypothesis],
        all: &[Hypothesis],
        tried: f64,
    ) -> Option<(Vec<FoundEffect>, Vec<f64>)> {
        let free = free(calibrated, chosen);
        let mut sigmas = vec![0.0; self.theta.len()];
        for (column, sigma) in free.iter().zip(self.sigmas(&free)?) {
            sigmas[*column] = sigma;
        }
        let whole = self.after.normal.sum(|_| true);
        let mut effects = Vec::new();
        for hypothesis in chosen {
            let candidate = hypothesis.candidate;
            let others: Vec<usize> = free.iter().copied().filter(|column| !hypothesis.free.contains(column)).collect();
            // Taken away again: its columns at minus what was fitted.
            let away: Vec<(usize, f64)> =
                hypothesis.free.iter().map(|column| (*column, -self.theta[*column])).collect();
            let base = linear::fit(&whole, &others, &away).map_or(0.0, |fit| fit.gain);
            let gain = linear::fit(&whole, &free, &[])?.gain - base;
            let mut alternatives = Vec::new();
            // What continues an entry is none that could stand in its place.
            let is_other = |h: &&Hypothesis| continued_by(h.candidate.effect) != Some(candidate.effect);
            for alternative in all.iter().filter(|h| !chosen.contains(h)).filter(is_other) {
                let columns: Vec<usize> = others.iter().chain(&alternative.free).copied().collect();
                let Some(alone) = linear::fit(&whole, &columns, &away) else { continue };
                let both: Vec<usize> = columns.iter().chain(&hypothesis.free).copied().collect();
                let deficit = gain + base - alone.gain;
                let p = match linear::fit(&whole, &both, &[]) {
                    Some(together) => {
                        let (inflation, count) = linear::inflation(&self.after.normal, |_| true, &both, &together, &[]);
                        search::tail(together.gain - alone.gain, inflation, count, candidate.degrees())
                    }
                    // The two are one and the same to the log.
                    None => chi_square_tail(deficit, candidate.degrees()),
                };
                alternatives.push(Alternative {
                    instance: Instance {
                        candidate: alternative.candidate,
                        sizes: alone.theta[others.len()..].to_vec(),
                    },
                    deficit,
                    p,
                    is_separable: alternative.lower.is_empty(),
                    separating_manoeuvre: manoeuvre(&candidate, &alternative.candidate),
                });
            }
            alternatives.sort_by(|a, b| a.deficit.total_cmp(&b.deficit));
            let values = self.values(hypothesis, &sigmas);
            let p_value = (chi_square_tail(gain, candidate.degrees()) * tried).min(1.0);
            let held_gain = self.held_gain(&others, hypothesis);
            effects.push(FoundEffect {
                instance: self.instance(hypothesis),
                values,
                p_value,
                gain,
                held_gain,
                alternatives,
            });
        }
        Some((effects, sigmas))
    }

    /// One sigma of the free columns on the training blocks.
    pub(super) fn sigmas(&self, free: &[usize]) -> Option<Vec<f64>> {
        if free.is_empty() {
            return Some(Vec::new());
        }
        let train = self.after.normal.sum(|block| self.log_data.is_in(DataPart::Train, block));
        let covariance = linear::fit(&train, free, &[])?.covariance;
        let at = Fit { gain: 0.0, theta: vec![0.0; free.len()], covariance };
        Some(linear::sigmas(&self.after.normal, |block| self.log_data.is_in(DataPart::Train, block), free, &at, &[]))
    }

    fn values(&self, hypothesis: &Hypothesis, sigmas: &[f64]) -> Vec<ParameterEstimate> {
        let parameters = hypothesis.candidate.info().parameters.iter().zip(&hypothesis.free);
        parameters
            .map(|(parameter, column)| {
                let (value, half) = (self.theta[*column], Z_95 * sigmas[*column]);
                let ci95 = [value - half, value + half];
                ParameterEstimate { name: parameter.name, unit: parameter.unit, kind: ParameterKind::Size, value, ci95 }
            })
            .collect()
    }

    /// As the vehicle file takes it: what was found, within what is plausible.
    fn instance(&self, hypothesis: &Hypothesis) -> Instance {
        let bounds = hypothesis.candidate.bounds();
        let mut sizes: Vec<f64> = hypothesis.free.iter().map(|column| self.theta[*column]).collect();
        // A DVL's pitch is not seen from above.
        sizes.resize(bounds.len(), 0.0);
        for (size, [low, high]) in sizes.iter_mut().zip(bounds) {
            *size = size.clamp(low, high);
        }
        Instance { candidate: hypothesis.candidate, sizes }
    }

    /// By how much Σ e² of a held-out block falls by it: mean and interval.
    fn held_gain(&self, others: &[usize], hypothesis: &Hypothesis) -> Option<(f64, [f64; 2])> {
        let mut start = self.theta.to_vec();
        for column in &hypothesis.free {
            start[*column] = 0.0;
        }
        let without = fit::solve(self.model, self.log_data, self.noise, others, &start, DataPart::Train)?;
        let blocks = self.log_data.gains(DataPart::Judge, &fit::pass(self.model, self.noise, &without), self.after);
        let (low, high) = mean_ci95(&blocks)?;
        Some((blocks.iter().sum::<f64>() / blocks.len() as f64, [low, high]))
    }

    /// Entries that were not accepted, fitted beside those that were: an interval for how large they may be.
    pub(super) fn open<'h>(&self, free: &[usize], left: impl Iterator<Item = &'h Hypothesis>) -> Vec<String> {
        let whole = self.after.normal.sum(|_| true);
        let tell = |h: &Hypothesis| {
            let columns: Vec<usize> = free.iter().chain(&h.free).copied().collect();
            let name = h.candidate.effect;
            let Some(fit) = linear::fit(&whole, &columns, &[]) else {
                return format!(
                    "{name} cannot be separated from the effects found: both change this log in the same way"
                );
            };
            let at = Fit { gain: 0.0, ..fit.clone() };
            let sigmas = linear::sigmas(&self.after.normal, |_| true, &columns, &at, &[]);
            let parameters =
                h.candidate.info().parameters.iter().enumerate().take(h.free.len()).map(|(i, parameter)| {
                    let (value, half) = (fit.theta[free.len() + i], Z_95 * sigmas[free.len() + i]);
                    let unit = if parameter.unit == "1" { String::new() } else { format!(" {}", parameter.unit) };
                    format!("{} {value:.3} (±{half:.3}){unit}", parameter.name)
                });
            format!("{name} not significant: {}", parameters.collect::<Vec<_>>().join(", "))
        };
        left.map(tell).collect()
    }

    /// Columns without a name beside everything found, one after the other, best first.
    pub(super) fn nameless(&self, free: &[usize]) -> Vec<NamedTerm> {
        let sum = |part| self.after.normal.sum(|block| self.log_data.is_in(part, block));
        let (train, held, whole) = (sum(DataPart::Train), sum(DataPart::Choose), sum(DataPart::Seen));
        let gain = |columns: &[usize]| linear::fit(&whole, columns, &[]).map_or(0.0, |fit| fit.gain);
        let held_gain = |columns: &[usize]| {
            linear::fit(&train, columns, &[]).map_or(0.0, |fit| linear::gain_of(&held, columns, &fit.theta, &[]))
        };
        let all = self.model.nameless();
        let mut columns = free.to_vec();
        let mut found: Vec<NamedTerm> = Vec::new();
        while found.len() < MOST_OUTSIDE {
            let (base, held_base) = (gain(&columns), held_gain(&columns));
            let left = all.iter().filter(|(name, _)| found.iter().all(|term| term.name != *name));
            let best = left
                .filter_map(|(name, own)| {
                    let with: Vec<usize> = columns.iter().chain(own).copied().collect();
                    let fit = linear::fit(&whole, &with, &[])?;
                    let (inflation, blocks) = linear::inflation(&self.after.normal, |_| true, &with, &fit, &[]);
                    let p = search::tail(fit.gain - base, inflation, blocks, own.len()) * all.len() as f64;
                    let held_gain = held_gain(&with) - held_base;
                    let values = fit.theta[columns.len()..].to_vec();
                    Some((
                        with,
                        NamedTerm { name, values, ci95: Vec::new(), gain: fit.gain - base, held_gain, p: p.min(1.0) },
                    ))
                })
                .filter(|(_, term)| term.p < OUTSIDE && term.held_gain > 0.0)
                .min_by(|a, b| a.1.p.total_cmp(&b.1.p).then(b.1.gain.total_cmp(&a.1.gain)));
            let Some((with, term)) = best else { break };
            columns = with;
            found.push(term);
        }
        found
    }
}
