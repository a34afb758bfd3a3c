//! What hypotheses are worth beside each other, on the normal equations of one pass.

use super::fit::Fitting;
use super::model::{LogModel, catalogue_range};
use crate::candidates::{Hypothesis, Instance};
use crate::linear::{self, Fit};
use crate::normal_equations::{Column, NormalEquations};
use crate::search::tail;
use crate::selection::Evidence;
use crate::split::DataPart;
use crate::whitener::Pass;
use backseat_logs::stats::Z_95;

/// A pass about θ, with its normal equations: with what is known before on the data that fit, and on those that fit and
/// choose; of those that choose alone without it.
pub(super) struct Linearised<'a, M> {
    pub fitting: &'a Fitting<'a, M>,
    pub theta: Vec<f64>,
    pub pass: Pass,
    pub train: NormalEquations,
    pub choose: NormalEquations,
    pub seen: NormalEquations,
}

/// What columns add to others.
#[derive(Clone, Debug)]
pub(super) struct Added {
    pub gain: f64,
    pub inflation: f64,
    /// Probability of such a gain by chance.
    pub p: f64,
    /// Step from θ of all columns, those of the others first.
    theta: Vec<f64>,
    /// One sigma of each by the Hessian.
    sigmas: Vec<f64>,
}

impl<'a, M: LogModel> Linearised<'a, M> {
    pub fn new(fitting: &'a Fitting<'a, M>, theta: Vec<f64>, pass: Pass) -> Self {
        let [train, seen] = [DataPart::Train, DataPart::Seen].map(|part| fitting.equations(&pass, &theta, part));
        let choose = pass.normal.sum(fitting.is_in(DataPart::Choose));
        Self { fitting, theta, pass, train, choose, seen }
    }

    /// Columns of θ that are not free are taken away.
    fn away(&self, free: &[Column]) -> Vec<(Column, f64)> {
        let places = self.theta.iter().enumerate().filter(|(_, value)| **value != 0.0);
        let taken = places.map(|(column, value)| (Column::from(column), -value));
        taken.filter(|(column, _)| !free.contains(column)).collect()
    }

    /// Step from θ with these columns free and the others zero, on the data that fit and choose.
    pub fn fit(&self, free: &[Column]) -> Option<Fit> {
        linear::fit(&self.seen, free, &self.away(free))
    }

    /// What `own` adds to `others`.
    pub fn added(&self, own: &[Column], others: &[Column], degrees: usize) -> Option<Added> {
        let with: Vec<Column> = others.iter().chain(own).copied().collect();
        let (base, fit) = (self.fit(others)?, self.fit(&with)?);
        let gain = fit.gain - base.gain;
        let (inflation, blocks) = self.inflation(own, others, &with, &fit);
        let sigmas = (0..with.len()).map(|i| fit.sigma(i)).collect();
        Some(Added { gain, inflation, p: tail(gain, inflation, blocks, degrees), theta: fit.theta, sigmas })
    }

    /// By how much the blocks' scores scatter more than the Hessian says in what `own` adds to `others`, and the number
    /// of blocks that were seen.
    fn inflation(&self, own: &[Column], others: &[Column], with: &[Column], fit: &Fit) -> (f64, usize) {
        let seen = self.fitting.is_in(DataPart::Seen);
        let away = self.away(with);
        let (all, blocks) = linear::inflation(&self.pass.normal, &seen, with, fit, &away);
        let hessian: Vec<f64> = (0..with.len()).map(|i| fit.sigma(i)).collect();
        let sigmas = linear::sigmas(&self.pass.normal, &seen, with, fit, &away);
        let shares = (others.len()..with.len()).map(|i| (sigmas[i] / hessian[i].max(f64::MIN_POSITIVE)).powi(2));
        let mean = shares.sum::<f64>() / own.len().max(1) as f64;
        (mean.max(all.min(1.0)).max(0.5), blocks)
    }

    /// Gain on the data that choose of what `own` adds to `others`, fitted on those that fit.
    pub fn chosen_gain(&self, own: &[Column], others: &[Column]) -> f64 {
        let value = |free: &[Column]| {
            let away = self.away(free);
            linear::fit(&self.train, free, &away)
                .map_or(f64::NEG_INFINITY, |fit| linear::gain_of(&self.choose, free, &fit.theta, &away))
        };
        let with: Vec<Column> = others.iter().chain(own).copied().collect();
        let base = value(others);
        if base.is_finite() { value(&with) - base } else { f64::NEG_INFINITY }
    }

    /// What a hypothesis is worth beside `others`, and beside the entry whose higher order it is; `None` where it
    /// leaves no trace of its own. It is determined where the log says more of its sizes than what is plausible of
    /// them.
    pub fn evidence(&self, hypothesis: &Hypothesis, others: &[Column]) -> Option<Evidence> {
        let (own, degrees) = (columns(&hypothesis.free), hypothesis.free.len());
        let added = self.added(&own, others, degrees)?;
        let sizes = hypothesis.free.iter().zip(&added.theta[others.len()..]);
        let sizes = sizes.map(|(column, step)| self.theta[*column] + step).collect();
        let mut beside = others.to_vec();
        beside.extend(columns(&hypothesis.lower).into_iter().filter(|column| !others.contains(column)));
        let lower = if beside.len() == others.len() { Some(added.clone()) } else { self.added(&own, &beside, degrees) };
        let within = |fit: &Added| {
            fit.sigmas[beside.len()..].iter().enumerate().all(|(place, sigma)| {
                let [low, high] = catalogue_range(hypothesis.candidate.effect, place);
                2.0 * Z_95 * sigma < high - low
            })
        };
        let is_determined = lower.as_ref().is_some_and(within);
        Some(Evidence {
            instance: Instance { candidate: hypothesis.candidate, sizes },
            gain: added.gain,
            inflation: added.inflation,
            degrees,
            held_gain: self.chosen_gain(&own, others),
            p: added.p,
            p_beside_lower: lower.filter(|_| is_determined).map_or(1.0, |lower| lower.p),
            is_determined,
        })
    }
}

/// Places of θ as columns.
pub(super) fn columns(places: &[usize]) -> Vec<Column> {
    places.iter().copied().map(Column::from).collect()
}

/// What the search for effects has come to.
pub(super) struct Chosen {
    pub hypotheses: Vec<Hypothesis>,
    pub theta: Vec<f64>,
    /// Entries that were significant and yet are no explanation, with the reason.
    pub refused: Vec<(&'static str, String)>,
}

/// Columns free with all chosen but one.
pub(super) fn free(calibrated: &[Column], chosen: &[Hypothesis], but: Option<usize>) -> Vec<Column> {
    let rest = chosen.iter().enumerate().filter(|(place, _)| Some(*place) != but).flat_map(|(_, h)| columns(&h.free));
    calibrated.iter().copied().chain(rest).collect()
}
