//! What each hypothesis of the catalogue is worth beside the effects accepted, and when events begin and end.

use crate::candidates::{self, Candidate, Hypothesis, Instance, Span, set_of};
use crate::linear;
use crate::normal_equations::{Column, NormalEquations};
use crate::prepared_log::{DataPart, PreparedLog};
use crate::selection::{Evidence, FAMILY_ERROR, Round};
use crate::whitener::Pass;
use backseat_logs::stats::{Z_95, chi_square_tail, f_tail};
use rayon::prelude::*;

/// Times tried at first for the onset and the end of an event.
const TIMES: usize = 11;
/// What an end must gain to be believed, χ² of one number: by chance once in 1 / [`FAMILY_ERROR`] logs over the 55 pairs
/// of times.
pub const END_GAIN: f64 = 17.0;

/// Notes on entries that would explain much, but that the log does not separate from the one whose higher order they are.
#[must_use]
pub fn undetermined(rounds: &[Round]) -> Vec<String> {
    let Some(round) = rounds.first() else { return Vec::new() };
    let stands = |e: &&Evidence| !e.is_determined && e.p * (round.tried as f64) < FAMILY_ERROR;
    let note = |e: &Evidence| candidates::inseparable(e.instance.candidate.effect);
    round.ladder.iter().filter(stands).filter_map(note).collect()
}

/// Times of the first search, in the part of a log in which an event may begin or end.
#[must_use]
pub fn coarse_times(duration_s: f64) -> Vec<f64> {
    (0..TIMES).map(|k| duration_s * (0.1 + 0.8 * k as f64 / (TIMES - 1) as f64)).collect()
}

/// Onsets and ends are searched to within this, s: a good compass that jumps shows it to the sample, and a model that jumps
/// a sample earlier is wrong by all of it there.
const FINEST_S: f64 = 0.2;

/// From the first to the next of them, s.
#[must_use]
pub fn coarse_step_s(duration_s: f64) -> f64 {
    0.8 * duration_s / (TIMES - 1) as f64
}

/// Every onset, to the end of the log and to every later time.
#[must_use]
pub fn open_or_until(onsets: &[f64], times: &[f64]) -> Vec<Span> {
    let ends: Vec<Option<f64>> = std::iter::once(None).chain(times.iter().copied().map(Some)).collect();
    spans(onsets, &ends)
}

/// An event lasts so long at least, s: where fins are thrown over, a servo's rate makes a model wrong for less.
const SHORTEST_S: f64 = 10.0;

/// Every onset with every end that is late enough.
#[must_use]
pub fn spans(onsets: &[f64], ends: &[Option<f64>]) -> Vec<Span> {
    let pairs = onsets.iter().flat_map(|onset_s| ends.iter().map(|end_s| Span { onset_s: *onset_s, end_s: *end_s }));
    pairs.filter(|span| span.end_s.is_none_or(|end_s| end_s > span.onset_s + SHORTEST_S)).collect()
}

/// Judges every hypothesis beside the accepted effects.
#[must_use]
pub fn round(log_data: &PreparedLog, accepted: &[Instance]) -> Option<Round> {
    let mut times = coarse_times(log_data.samples.duration_s);
    times.extend(&log_data.event_times_s);
    times.sort_by(f64::total_cmp);
    let spans = open_or_until(&times, &times);
    let (terms, hypotheses, nuisance) = candidates::catalogue(&log_data.scope, accepted, &spans);
    let pass = log_data.pass(&set_of(&log_data.scope.declared, accepted), &terms)?;
    Some(judge(log_data, &pass, &hypotheses, &nuisance))
}

/// Judges hypotheses on the normal equations of one pass; `nuisance` columns are refitted with each.
#[must_use]
pub fn judge(log_data: &PreparedLog, pass: &Pass, hypotheses: &[Hypothesis], nuisance: &[usize]) -> Round {
    let sum = |part| pass.normal.sum(|block| log_data.is_in(part, block));
    let (train, held, whole) = (sum(DataPart::Train), sum(DataPart::Choose), sum(DataPart::Seen));
    let base = |sum: &NormalEquations| linear::fit(sum, nuisance, &[]).map_or(0.0, |fit| fit.gain);
    let (base_whole, base_held) = (base(&whole), {
        let fit = linear::fit(&train, nuisance, &[]);
        fit.map_or(0.0, |fit| linear::gain_of(&held, nuisance, &fit.theta, &[]))
    });
    let seen = log_data.seen();
    let judged: Vec<Option<Evidence>> = hypotheses
        .par_iter()
        .map(|hypothesis| {
            evidence((pass, &seen), hypothesis, nuisance, [&train, &held, &whole], [base_whole, base_held])
        })
        .collect();
    let mut best: Vec<Evidence> = Vec::new();
    for found in judged.into_iter().flatten() {
        let (own, ends) = (found.instance.candidate, found.instance.candidate.ends());
        let same = |e: &&mut Evidence| is_same(&e.instance.candidate, &own) && e.instance.candidate.ends() == ends;
        match best.iter_mut().find(same) {
            Some(other) if other.gain >= found.gain => {}
            Some(other) => *other = found,
            None => best.push(found),
        }
    }
    best.sort_by(|a, b| b.score().total_cmp(&a.score()));
    let events = best.iter().filter(|e| e.instance.candidate.span.is_some()).cloned().collect();
    Round { ladder: with_ends_where_they_count(best), events, tried: hypotheses.len() }
}

/// Each event once: with its end if that is significant, else without.
fn with_ends_where_they_count(all: Vec<Evidence>) -> Vec<Evidence> {
    let other = |e: &Evidence| {
        let own = e.instance.candidate;
        all.iter().find(|o| is_same(&o.instance.candidate, &own) && o.instance.candidate.ends() != own.ends())
    };
    let has_end = |with: &Evidence, without: &Evidence| with.gain > without.gain + END_GAIN * with.inflation.max(1.0);
    let stays = |e: &&Evidence| match other(e) {
        Some(other) if e.instance.candidate.ends() => has_end(e, other),
        Some(other) => !has_end(other, e),
        None => true,
    };
    all.iter().filter(stays).cloned().collect()
}

/// Events that come near the lasting effects' best score `least`, with their times refined: between the times of the
/// first search, which are a twelfth of the log apart, a short event loses most of its gain.
#[must_use]
pub fn refined_events(log_data: &PreparedLog, accepted: &[Instance], round: &Round, least: f64) -> Vec<Evidence> {
    // Half a step off at both ends, a span of two steps keeps about half of its gain; a jump of the compass, of which lasting
    // noise takes up what is not at its instant, a quarter.
    const NEAR: f64 = 0.2;
    const MOST: usize = 4;
    let is_near = |e: &&Evidence| {
        e.score() > NEAR * least && chi_square_tail(e.gain, e.degrees) * (round.tried as f64) < FAMILY_ERROR
    };
    let near = round.events.iter().filter(is_near).take(MOST);
    let near: Vec<Instance> = near.map(|e| e.instance.clone()).collect();
    with_ends_where_they_count(refine_spans(log_data, accepted, &near).into_iter().flatten().collect())
}

fn evidence(
    (pass, seen): (&Pass, &impl Fn(usize) -> bool),
    hypothesis: &Hypothesis,
    nuisance: &[usize],
    [train, held, whole]: [&NormalEquations; 3],
    [base_whole, base_held]: [f64; 2],
) -> Option<Evidence> {
    let columns = hypothesis.columns();
    let nuisance_columns: Vec<Column> = nuisance.iter().copied().map(Column::from).collect();
    let within: Vec<_> = columns.iter().copied().zip(hypothesis.candidate.bounds()).collect();
    let bounded = |sum: &NormalEquations| linear::fit_within(sum, &nuisance_columns, &within, &hypothesis.fixed());
    let (fit, left, at) = bounded(whole)?;
    let (trained, trained_left, trained_at) = bounded(train)?;
    let (inflation, blocks) = linear::inflation(&pass.normal, seen, &left, &fit, &at);
    let gain = fit.gain - base_whole;
    let held_gain = linear::gain_of(held, &trained_left, &trained.theta, &trained_at) - base_held;
    let degrees = hypothesis.candidate.degrees().max(hypothesis.free.len());
    let sizes = columns
        .iter()
        .map(|column| match left.iter().position(|c| c == column) {
            Some(place) => fit.theta[place],
            None => at.iter().find(|(c, _)| c == column).map_or(0.0, |(_, value)| *value),
        })
        .collect();
    let instance = Instance { candidate: hypothesis.candidate, sizes };
    let p = tail(gain, inflation, blocks, degrees);
    let (p_beside_lower, is_determined) = beside_lower((pass, seen), hypothesis, nuisance, whole);
    Some(Evidence { instance, gain, inflation, degrees, held_gain, p, p_beside_lower, is_determined })
}

/// Probability under the null of what a higher order adds to the lower one, and whether the log determines it there.
fn beside_lower(
    (pass, seen): (&Pass, &impl Fn(usize) -> bool),
    hypothesis: &Hypothesis,
    nuisance: &[usize],
    whole: &NormalEquations,
) -> (f64, bool) {
    if hypothesis.lower.is_empty() {
        return (0.0, true);
    }
    let lower: Vec<usize> = nuisance.iter().chain(&hypothesis.lower).copied().collect();
    let all: Vec<usize> = lower.iter().chain(&hypothesis.free).copied().collect();
    let fits = (linear::fit(whole, &lower, &[]), linear::fit(whole, &all, &[]));
    let (Some(base), Some(fit)) = fits else { return (1.0, false) };
    let (inflation, blocks) = linear::inflation(&pass.normal, seen, &all, &fit, &[]);
    let is_within =
        |(i, [low, high]): (usize, [f64; 2])| 2.0 * Z_95 * fit.sigma(lower.len() + i) * inflation.sqrt() < high - low;
    let is_determined = hypothesis.candidate.bounds().into_iter().enumerate().all(is_within);
    (tail(fit.gain - base.gain, inflation, blocks, hypothesis.free.len()), is_determined)
}

/// Probability of a gain under the null: by the declared noise, or by the scatter of the blocks where that is larger.
#[must_use]
pub fn tail(gain: f64, inflation: f64, blocks: usize, degrees: usize) -> f64 {
    // Neighbouring blocks share half their weight: two thirds of them are independent.
    let free = (blocks as f64 * 2.0 / 3.0).max(2.0);
    let scattered = f_tail(gain / inflation / degrees as f64, degrees as f64, free);
    chi_square_tail(gain, degrees).max(scattered)
}

/// Refines onset and end of each of several events by ever finer searches, in passes that they share; the values follow.
/// `None` in the place of one that the log does not determine.
#[must_use]
pub fn refine_spans(log_data: &PreparedLog, others: &[Instance], found: &[Instance]) -> Vec<Option<Evidence>> {
    let mut refined: Vec<Option<Evidence>> = vec![None; found.len()];
    let mut best: Vec<Option<Instance>> = found.iter().cloned().map(Some).collect();
    let set = set_of(&log_data.scope.declared, others);
    let nuisance: Vec<usize> = (0..others.iter().map(|other| other.sizes.len()).sum()).collect();
    let mut cell_s = coarse_step_s(log_data.samples.duration_s);
    while cell_s > FINEST_S && best.iter().any(Option::is_some) {
        let about =
            |instance: &Instance| Some((instance.candidate, spans_about(log_data, &instance.candidate, cell_s)?));
        let events: Vec<_> = best.iter().map(|instance| instance.as_ref().and_then(about)).collect();
        let (terms, hypotheses) = candidates::events(&log_data.scope, others, &events);
        let Some(pass) = log_data.pass(&set, &terms) else { return vec![None; found.len()] };
        for ((best, refined), hypotheses) in best.iter_mut().zip(&mut refined).zip(hypotheses) {
            *refined = judge(log_data, &pass, &hypotheses, &nuisance).ladder.into_iter().next();
            *best = refined.as_ref().map(|evidence| evidence.instance.clone());
        }
        cell_s /= 8.0;
    }
    refined
}

/// The spans that begin and end within `cell_s` of those of an event, in steps of an eighth of it.
fn spans_about(log_data: &PreparedLog, event: &Candidate, cell_s: f64) -> Option<Vec<Span>> {
    let Span { onset_s, end_s } = event.span?;
    // An event in the first or last part of a log is no event: it was always, or never, there.
    let duration_s = log_data.samples.duration_s;
    let within = |t_s: &f64| (0.08 * duration_s..=0.92 * duration_s).contains(t_s);
    let about = |centre: f64| (-8..=8).map(move |k| centre + cell_s * f64::from(k) / 8.0).filter(within);
    let onsets: Vec<f64> = about(onset_s).collect();
    let ends: Vec<Option<f64>> = end_s.map_or_else(|| vec![None], |end_s| about(end_s).map(Some).collect());
    Some(spans(&onsets, &ends))
}

/// Gain of an event over each of several spans, less where the blocks' scores scatter more than the noise explains.
#[must_use]
pub fn span_gains(log_data: &PreparedLog, others: &[Instance], event: &Candidate, spans: &[Span]) -> Option<Vec<f64>> {
    let (terms, hypotheses) = candidates::event(&log_data.scope, others, event, spans);
    let pass = log_data.pass(&set_of(&log_data.scope.declared, others), &terms)?;
    let sum = pass.normal.sum(log_data.seen());
    let nuisance: Vec<usize> = (0..others.iter().map(|other| other.sizes.len()).sum()).collect();
    let free = |hypothesis: &Hypothesis| -> Vec<Column> {
        nuisance.iter().copied().map(Column::from).chain(hypothesis.columns()).collect()
    };
    let fits = hypotheses.iter().map(|hypothesis| linear::fit(&sum, &free(hypothesis), &hypothesis.fixed()));
    let fits: Vec<Option<linear::Fit>> = fits.collect();
    let best = hypotheses
        .iter()
        .zip(&fits)
        .filter_map(|(hypothesis, fit)| Some((hypothesis, fit.as_ref()?)))
        .max_by(|a, b| a.1.gain.total_cmp(&b.1.gain))?;
    let (inflation, _) = linear::inflation(&pass.normal, log_data.seen(), &free(best.0), best.1, &best.0.fixed());
    Some(fits.iter().map(|fit| fit.as_ref().map_or(f64::NEG_INFINITY, |fit| fit.gain / inflation.max(1.0))).collect())
}

/// Whether two instances are the same cause.
#[must_use]
pub fn is_same(a: &Candidate, b: &Candidate) -> bool {
    a.effect == b.effect && a.member == b.member
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_is_no_moment() {
        let found = spans(&[100.0, 105.0], &[None, Some(100.1), Some(112.0), Some(400.0)]);
        let ends: Vec<_> = found.iter().map(|span| (span.onset_s, span.end_s)).collect();
        let [first, second] = [100.0, 105.0];
        assert_eq!(
            ends,
            [(first, None), (first, Some(112.0)), (first, Some(400.0)), (second, None), (second, Some(400.0))]
        );
    }
}
