//! What else it could be: entries that explain the same residual as well as an accepted one.

use crate::candidates::{self, Candidate, Instance, Span, set_of};
use crate::linear;
use crate::normal_equations::Column;
use crate::prepared_log::{DataPart, PreparedLog};
use crate::search::{self, is_same, tail};
use crate::selection::{Evidence, Round};
use backseat_logs::stats::chi_square_tail;
use rayon::prelude::*;

/// An entry adds nothing beside an alternative if the data would do so by chance with this probability: then the
/// alternative cannot be excluded.
const UNDECIDED: f64 = 2e-3;
/// Alternatives that are fitted in full.
const MOST_ALTERNATIVES: usize = 5;
/// By how much an alternative's gain on the linearised problem may fall short to be fitted in full: a number, and a
/// share of the gain for what linearisation is worth.
const SHORT: (f64, f64) = (60.0, 0.03);

/// An entry that could stand in for an accepted one.
#[derive(Clone, Debug, PartialEq)]
pub struct Alternative {
    /// What, and with which values.
    pub instance: Instance,
    /// By how much its Σ e² is larger than the accepted one's.
    pub deficit: f64,
    /// Probability of the gain that the accepted one adds to it, under the null.
    pub p: f64,
    /// Whether it could be named itself: it is significant, and a higher order explains something beside the entry that it
    /// continues.
    pub is_separable: bool,
    /// What to fly to tell the two apart, where the catalogue knows.
    pub separating_manoeuvre: Option<&'static str>,
}

impl Alternative {
    /// Whether the data leave it possible.
    #[must_use]
    pub fn is_possible(&self) -> bool {
        self.p > UNDECIDED
    }
}

/// Every entry fitted in the place of `accepted[place]`, best first; `round` is the ladder beside the others.
#[must_use]
pub fn find(log_data: &PreparedLog, accepted: &[Instance], place: usize, round: &Round) -> Vec<Alternative> {
    let accepted_one = &accepted[place];
    let others = candidates::others(accepted, place);
    let own_gain = round
        .ladder
        .iter()
        .find(|e| is_same(&e.instance.candidate, &accepted_one.candidate))
        .map_or(f64::INFINITY, |e| e.gain);
    let top = round.ladder.iter().map(|e| e.gain).fold(0.0, f64::max).min(own_gain);
    let close = round.ladder.iter().filter(|e| {
        !is_same(&e.instance.candidate, &accepted_one.candidate)
            && !others.iter().any(|other| other.candidate.effect == e.instance.candidate.effect)
            && e.gain > 0.0
            && e.gain > top - SHORT.0 - SHORT.1 * top
    });
    let close: Vec<_> = close.take(MOST_ALTERNATIVES).collect();
    if close.is_empty() {
        return Vec::new();
    }
    let Some(own) = log_data.fit(accepted, DataPart::Seen) else { return Vec::new() };
    let is_event = |e: &&&Evidence| e.instance.candidate.span.is_some();
    let events: Vec<Instance> = close.iter().filter(is_event).map(|e| e.instance.clone()).collect();
    let mut refined = search::refine_spans(log_data, &others, &events).into_iter();
    let begun: Vec<_> = close
        .into_iter()
        .filter_map(|e| match e.instance.candidate.span {
            Some(_) => Some((e, refined.next()??.instance)),
            None => Some((e, e.instance.clone())),
        })
        .collect();
    let mut alternatives: Vec<Alternative> = begun
        .into_par_iter()
        .filter_map(|(e, begun)| {
            let is_separable = e.p_beside_lower < UNDECIDED && round.is_significant(e);
            let found = alternative(log_data, accepted_one, &others, begun, own.seen_square)?;
            Some(Alternative { is_separable, ..found })
        })
        .collect();
    alternatives.sort_by(|a, b| a.deficit.total_cmp(&b.deficit));
    alternatives
}

fn alternative(
    log_data: &PreparedLog,
    accepted_one: &Instance,
    others: &[Instance],
    found: Instance,
    own: f64,
) -> Option<Alternative> {
    let mut instances = others.to_vec();
    instances.push(found);
    let joint = log_data.fit(&instances, DataPart::Seen)?;
    let deficit = joint.seen_square - own;
    let instance = joint.instances.last()?.clone();
    // What the accepted entry adds to its alternative, the rest refitted.
    let degrees = accepted_one.candidate.degrees();
    let p = if instance.candidate.effect == accepted_one.candidate.effect {
        chi_square_tail(deficit, degrees)
    } else {
        let set = set_of(&log_data.scope.declared, &joint.instances);
        let (terms, hypotheses) = added(log_data, &joint.instances, &accepted_one.candidate);
        let pass = log_data.pass(&set, &terms)?;
        let sum = pass.normal.sum(log_data.seen());
        let nuisance: Vec<usize> = (0..joint.instances.iter().map(|i| i.sizes.len()).sum()).collect();
        let base = linear::fit(&sum, &nuisance, &[])?.gain;
        let hypothesis = hypotheses.first()?;
        let free: Vec<Column> = nuisance.iter().copied().map(Column::from).chain(hypothesis.columns()).collect();
        let fixed = hypothesis.fixed();
        match linear::fit(&sum, &free, &fixed) {
            Some(fit) => {
                let (inflation, blocks) = linear::inflation(&pass.normal, log_data.seen(), &free, &fit, &fixed);
                tail((fit.gain - base).max(deficit), inflation, blocks, degrees)
            }
            // The two are one and the same to working precision.
            None => chi_square_tail(deficit, degrees),
        }
    };
    let separating_manoeuvre = manoeuvre(&accepted_one.candidate, &instance.candidate);
    Some(Alternative { instance, deficit, p, is_separable: true, separating_manoeuvre })
}

fn added(
    log_data: &PreparedLog,
    instances: &[Instance],
    candidate: &Candidate,
) -> (Vec<crate::regressors::Regressor>, Vec<candidates::Hypothesis>) {
    candidates::event(&log_data.scope, instances, candidate, &[candidate.span.unwrap_or(Span::ALWAYS)])
}

/// What separates two entries, as either of them says.
#[must_use]
pub fn manoeuvre(a: &Candidate, b: &Candidate) -> Option<&'static str> {
    let of = |a: &Candidate, b: &Candidate| {
        a.info().confused_with.iter().find(|c| c.effect == b.effect).map(|c| c.separating_manoeuvre)
    };
    of(a, b).or_else(|| of(b, a))
}
