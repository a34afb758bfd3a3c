//! The whole loop: find a significant residual, trace it to effects, add them, and repeat.

use crate::alternatives::{self, Alternative};
use crate::borne_out::gain_per_block;
use crate::candidates::{Candidate, Instance, others};
use crate::coloured_noise;
use crate::event_times::{self, Intervals};
pub use crate::found::{FoundEffect, ParameterEstimate};
use crate::full_log::FullLog;
use crate::judged;
use crate::lasting_noise;
use crate::log_effects::Effects;
use crate::prepared_log::{DataPart, JointFit, PreparedLog};
use crate::proposal::{self, ProposedTerm};
use crate::remaining::Remaining;
use crate::samples::ResidualChannel;
use crate::scores::{Whiteness, whiteness, whiteness_p};
use crate::search;
use crate::selection::{self, Ground, Round, Selected};
use crate::statistics::MOST_COLOURED;
use crate::structure::{self, Structure};
use crate::timing;
use crate::verdict::{self, Conditions, LEAST_WHITENESS_P, Verdict};
use crate::whitener::{Pass, Residual};
use backseat_core::effects::ParameterKind;
use backseat_logs::stats::{Z_95, chi_square_tail};
use rayon::prelude::*;

/// The result of a diagnosis.
#[derive(Clone, Debug, Default)]
pub struct Diagnosis {
    /// In one word.
    pub verdict: Verdict,
    /// The condition that decided it.
    pub reason: &'static str,
    /// What it was decided from.
    pub conditions: Conditions,
    /// What is left on data that judges, beside what the sensors can make.
    pub remaining: Vec<Remaining>,
    /// Effects found, strongest first.
    pub effects: Vec<FoundEffect>,
    /// The ladder of every round.
    pub rounds: Vec<Round>,
    /// Structure beside the effects.
    pub structure: Structure,
    /// Terms in no catalogue that would account for it.
    pub proposed: Vec<ProposedTerm>,
    /// Innovations with them.
    pub with_terms: Option<Pass>,
    /// Innovations of the declared model and of the augmented one.
    pub before: Pass,
    /// See `before`.
    pub after: Pass,
    /// What was not tested, and what was assumed.
    pub notes: Vec<String>,
}

impl Diagnosis {
    /// All effects found beside those declared.
    #[must_use]
    pub fn set(&self, declared: &Effects) -> Effects {
        self.effects.iter().fold(*declared, |set, found| found.instance.apply(&set))
    }

    /// Puts the floor under the verdict: what is left, and whether enough judges.
    #[must_use]
    pub fn held_to(mut self, remaining: Vec<Remaining>, is_undecided: bool) -> Self {
        self.conditions.is_implausible |= remaining.iter().any(Remaining::is_beyond);
        self.conditions.is_undecided |= is_undecided;
        self.remaining = remaining;
        let rule = verdict::decide(&self.conditions);
        (self.verdict, self.reason) = (rule.verdict, rule.condition);
        self
    }
}

/// Diagnoses a log; `progress` receives the name of each step.
///
/// `None` if the filter diverges.
#[must_use]
pub fn run(log_data: &mut PreparedLog, mut progress: impl FnMut(&str)) -> Option<Diagnosis> {
    let mut diagnosis = timed(log_data, &mut progress)?;
    propose(log_data, &mut diagnosis);
    diagnosis.notes.extend(coloured_noise::notes(&log_data.setup));
    diagnosis.notes.extend(timing::note(&log_data.timing));
    if diagnosis.effects.iter().any(|found| found.instance.candidate.is_pure_delay()) {
        let note = "beside input_delay a log does not show whether inputs hold or move on between their samples: if they move \
                    on, they are half a sample later than if they hold";
        diagnosis.notes.push(note.to_owned());
    }
    Some(diagnosis)
}

/// Fits the terms of what remains unexplained where no entry is named.
fn propose(log_data: &mut PreparedLog, diagnosis: &mut Diagnosis) {
    if diagnosis.verdict == Verdict::Unexplained
        && diagnosis.effects.is_empty()
        && let Some((terms, after)) = proposal::fit(log_data, &diagnosis.structure)
    {
        let of = judged::of_terms(log_data, &diagnosis.before, &after);
        if of.is_refuted() {
            diagnosis.notes.push(format!("the data that judge do not bear out the proposed terms ({of})"));
        }
        (diagnosis.proposed, diagnosis.with_terms) = (terms, Some(after));
    }
}

/// Selects; where what is left is not white, noise that lasts is estimated beside what was found, and the selection begins
/// again against that noise. What effects hide from each other is looked for in the end: lasting noise looks like it.
fn select(
    log_data: &mut PreparedLog,
    progress: &mut dyn FnMut(&str),
) -> Option<(Selected<JointFit>, Vec<FoundEffect>)> {
    let mut log = FullLog { log_data, noise_effects: Vec::new(), has_events: true, barred: Vec::new() };
    let mut selected = log.select(progress)?;
    if exceeds_noise(log.log_data, &selected.fit.pass) {
        selected = selection::in_another_order(&mut log, selected, progress)?;
    }
    if !log.log_data.is_noise_estimated && coloured_noise::is_suspected(log.log_data, &selected.fit.pass) {
        log.log_data.is_noise_estimated = true;
        let spans = selected.accepted.iter().filter_map(|instance| instance.candidate.span);
        log.log_data.event_times_s = spans.flat_map(|span| [Some(span.onset_s), span.end_s]).flatten().collect();
        // Noise that lasts is a hump in the spectrum of innovations, as waves are: waves are what stands beside it, and are
        // then kept out of it.
        let is_swell = lasting_noise::has_waves(&log.noise_effects);
        for is_swell_kept in [false, true] {
            progress("noise that lasts");
            if !lasting_noise::take(log.log_data, &selected.accepted, is_swell_kept)? {
                break;
            }
            selected = log.select(progress)?;
            if !is_swell || !lasting_noise::has_waves(&log.noise_effects) {
                break;
            }
        }
    }
    let selected = selection::in_another_order(&mut log, selected, progress)?;
    Some((selected, log.noise_effects))
}

/// Once, and again where the inputs act at other times than was taken.
fn timed(log_data: &mut PreparedLog, mut progress: impl FnMut(&str)) -> Option<Diagnosis> {
    let (mut diagnosis, mut accepted) = once(log_data, &mut progress)?;
    // Beside an effect that is not named after all, the noise is not what it is.
    let is_named = |effect: &&str| accepted.iter().any(|instance| instance.candidate.effect == *effect);
    let is_other_noise = diagnosis.conditions.is_coloured || diagnosis.conditions.exceeds_noise;
    if is_other_noise && !log_data.noise_beside.iter().all(is_named) {
        progress("noise that lasts");
        if lasting_noise::take(log_data, &accepted, lasting_noise::has_waves(&diagnosis.effects))? {
            (diagnosis, accepted) = once(log_data, &mut progress)?;
        }
    }
    if retimed(log_data, &accepted)? {
        (diagnosis, accepted) = once(log_data, &mut progress)?;
        if log_data.retime_beside_lag(&accepted)? {
            (diagnosis, _) = once(log_data, &mut progress)?;
        }
    }
    Some(diagnosis)
}

/// Whether the inputs act at other times than was taken. What effects leave shows the timing better than what the declared
/// model leaves; but a lag takes up the half sample between held and moving inputs, so that beside one the two are fitted
/// anew.
fn retimed(log_data: &mut PreparedLog, accepted: &[Instance]) -> Option<bool> {
    let is_late = accepted.iter().any(|instance| instance.candidate.is_lag());
    let is_retimed = !accepted.is_empty() && !is_late && log_data.retime(accepted)?;
    Some(is_retimed || log_data.retime_beside_lag(accepted)?)
}

/// With the timing of the inputs as it is; beside the diagnosis the entries accepted, even where they do not explain all.
fn once(log_data: &mut PreparedLog, mut progress: impl FnMut(&str)) -> Option<(Diagnosis, Vec<Instance>)> {
    let (Selected { fit, mut rounds, .. }, mut noise_effects) = select(log_data, &mut progress)?;
    let (mut accepted, mut unfounded, mut grounds, mut swaps) = (fit.instances, Vec::new(), Vec::new(), 0);
    let (mut has_events, mut barred) = (true, Vec::new());
    let (alternatives, joint, without, times) = loop {
        // The values that are reported are of all that does not judge.
        let joint = log_data.fit(&accepted, DataPart::Seen)?;
        accepted.clone_from(&joint.instances);
        let times = event_times(log_data, &accepted);
        log_data.split.except(times.iter().flatten().flatten().copied().collect());
        let without = judged::without_each(log_data, &joint, DataPart::Seen)?;
        // The data that judge choose no other model: their word is the verdict's.
        let refusal = match judged::founded(log_data, &joint) {
            Ok(chosen) => judged::refuted(log_data, &joint, &without, &chosen),
            Err(unfounded) => Some(unfounded),
        };
        if let Some(refusal) = refusal {
            let refused = accepted.remove(refusal.place).candidate;
            grounds.push(refusal.ground);
            unfounded.push(refusal.note);
            // What a model that is wrong for seconds made of them stood before what lasts; and what does not hold where it
            // is chosen by stood before what does. For what lasts the data that judge have no other cause sought.
            has_events &= refused.span.is_none();
            if refused.span.is_some() || refusal.ground == Ground::Unfounded {
                barred.push(refused.effect);
                let mut log = FullLog { log_data, noise_effects, has_events, barred };
                let others = log.go_on(accepted, &mut progress)?;
                (accepted, noise_effects, barred) = (others.accepted, log.noise_effects, log.barred);
                rounds.extend(others.rounds);
            }
        } else {
            progress("alternatives");
            match alternatives_to(log_data, &accepted, &rounds)? {
                (_, Some((Some(place), instance))) if swaps < MOST_SWAPS => accepted[place] = instance,
                (_, Some((None, instance))) if swaps < MOST_SWAPS => accepted.push(instance),
                (alternatives, _) => break (alternatives, joint, without, times),
            }
            swaps += 1;
        }
    };
    progress("structure");
    let swell = lasting_noise::has_waves(&noise_effects);
    let against_declared = || if accepted.is_empty() { None } else { structure::find(log_data, &[], swell) };
    let ((left, against_declared), found) = rayon::join(
        || rayon::join(|| structure::find(log_data, &accepted, swell), against_declared),
        || describe(log_data, &accepted, alternatives, &joint, (&without, times, &rounds)),
    );
    let (mut left, found) = (left?, found?);
    let refuted_terms = left.drop_if_refuted();
    let explained: f64 = log_data.seen_square(&log_data.declared) - joint.seen_square;
    let structure_remains = !left.hints.is_empty() && left.gain > tolerated(explained);
    let whitenesses = whiteness(log_data, &joint.pass, DataPart::Judge);
    let errs_on_held_out = noise_effects.is_empty() && errs_in_a_channel(&whitenesses, structure::FAMILY_ERROR);
    let jumps = lasting_noise::jumps_left(&joint.pass, &log_data.split);
    let exceeds_noise = exceeds_noise(log_data, &joint.pass) || errs_on_held_out || !jumps.is_empty();
    let impossible = rounds.last().map_or_else(Vec::new, |last| judged::impossible(log_data, &joint, last));
    let conditions = Conditions {
        // What the data that judge do not bear out, and do not miss, is not there.
        is_refuted: grounds.contains(&Ground::Refuted) && errs_in_a_channel(&whitenesses, MISSED),
        is_impossible: grounds.contains(&Ground::Impossible) || !impossible.is_empty(),
        structure_remains,
        exceeds_noise,
        generic_terms_fit_better: !accepted.is_empty()
            && generic_is_better(log_data, against_declared.as_ref()?, accepted.len(), explained),
        is_coloured: is_coloured(&whitenesses, !log_data.setup.colours.is_empty()),
        has_effects: !(found.is_empty() && noise_effects.is_empty()),
        has_alternatives: found.iter().any(|found| found.possible_alternatives().next().is_some()),
        ..Conditions::default()
    };
    let rule = verdict::decide(&conditions);
    let generic_gain = against_declared.as_ref().map_or(0.0, |structure| structure.gain);
    let stand_in = conditions.generic_terms_fit_better
        || conditions.is_impossible
        || structure_remains && left.gain > LEFT_BESIDE * explained && generic_gain > explained;
    let (mut found, mut structure) = (found, left);
    if rule.verdict == Verdict::Unexplained && stand_in {
        // The entries stood in for something else: the terms reported are those against the declared model.
        found.clear();
        structure = against_declared.unwrap_or(structure);
    } else {
        found.extend(noise_effects);
        found.sort_by(|a, b| a.p_value.total_cmp(&b.p_value).then(b.gain.total_cmp(&a.gain)));
    }
    let after = if found.is_empty() { log_data.declared.clone() } else { joint.pass };
    let notes = crate::candidates::beyond(&log_data.scope)
        .into_iter()
        .map(|(effect, reason)| format!("{effect} was not tested: {reason}"))
        .chain(search::undetermined(&rounds))
        .chain(unfounded)
        .chain(impossible)
        .chain(refuted_terms)
        .chain(jumps)
        .chain(scale_notes(log_data))
        .chain(whitenesses.iter().filter_map(Whiteness::colour_note))
        .collect();
    let diagnosis = Diagnosis {
        verdict: rule.verdict,
        reason: rule.condition,
        conditions,
        effects: found,
        rounds,
        structure,
        before: log_data.declared.clone(),
        after,
        notes,
        ..Diagnosis::default()
    };
    Some((diagnosis, accepted))
}

/// Whether innovations are not white on the data that judges. Beside noise that was estimated, what is left is that the
/// noise has another spectrum than two processes: neighbours that have this share of the stated variance in common are
/// tolerated, however small their p. Errors of fixes last by themselves, and are held to their size alone.
fn is_coloured(whitenesses: &[Whiteness], is_noise_estimated: bool) -> bool {
    const TOLERATED: f64 = 0.15;
    let is_small = |w: &Whiteness| is_noise_estimated && w.correlation.iter().all(|r| r.abs() * w.nis < TOLERATED);
    let is_fix = |w: &Whiteness| matches!(w.channel, ResidualChannel::GnssX | ResidualChannel::GnssY);
    let counted: Vec<Whiteness> = whitenesses.iter().filter(|w| !is_small(w) && !is_fix(w)).cloned().collect();
    whiteness_p(&counted) < LEAST_WHITENESS_P
}

/// Probability by chance below which the data that judge are taken to miss an effect that they do not bear out.
const MISSED: f64 = 1e-2;

/// So often an alternative takes an effect's place.
const MOST_SWAPS: usize = 2;

/// Structure beside the accepted effects is tolerated up to this share of their gain, and up to this much.
const TOLERATED: (f64, f64) = (5e-4, 60.0);

/// Entries are named beside structure that gains less than this part of what they explain, or where they explain more than
/// any structure does in their place.
const LEFT_BESIDE: f64 = 0.2;

fn tolerated(explained: f64) -> f64 {
    (TOLERATED.0 * explained).min(TOLERATED.1)
}

/// Whether Σ e² is larger than noise of the declared size makes it: what is left may be too slow or too irregular for
/// any term to stand out against its own scatter.
fn exceeds_noise(log_data: &PreparedLog, pass: &Pass) -> bool {
    /// What an inexact step of integration or declared noise a percent too small may add.
    const SLACK: f64 = 0.02;
    const SIGMAS: f64 = 6.0;
    let counts =
        |r: &&Residual| [DataPart::Seen, DataPart::Judge].iter().any(|part| log_data.split.is_at(*part, r.t_s));
    let e: Vec<f64> = pass.telling().filter(counts).map(Residual::normalised).collect();
    let count = e.len() as f64;
    e.iter().map(|e| e * e).sum::<f64>() > count * (1.0 + SLACK) + SIGMAS * (2.0 * count).sqrt()
}

/// Whether on held-out blocks some channel errs by more than its noise: what is said of the log is not so there. A sum
/// over all channels hides the hundred ranges of a log behind some ten thousand readings of attitude. Outliers and waves
/// make such errors themselves. By chance it is so with the probability `level`.
fn errs_in_a_channel(whitenesses: &[Whiteness], level: f64) -> bool {
    let errs = |w: &Whiteness| {
        let square = w.nis * w.count as f64 / (1.0 + MOST_COLOURED);
        chi_square_tail(square, w.count) * (whitenesses.len() as f64) < level
    };
    whitenesses.iter().any(errs)
}

/// By how much as many generic terms as entries must explain more to take their place: chance gives them no more than
/// this where the entries are right: a number and a part. An entry's derivative acts on the innovations' variance as
/// well, a generic term's does not; and drag by the square of speed is nearly thrust lost with speed.
const BETTER: (f64, f64) = (10.0, 0.005);
/// What fewer generic terms than entries may explain less and still take their place, likewise.
const WORSE: (f64, f64) = (10.0, 0.005);

/// Whether as many generic terms explain more than the entries, or fewer as much: then the entries stand in for
/// something that is not theirs. A derivative promises more than a large effect explains: terms that seem better are
/// fitted before they count.
fn generic_is_better(log_data: &mut PreparedLog, alternative: &Structure, accepted: usize, explained: f64) -> bool {
    let explain_more = |gain: f64| gain > explained + BETTER.0 + BETTER.1 * explained;
    let explain_as_much = |gain: f64| gain > explained - WORSE.0 - WORSE.1 * explained;
    let promised = |terms: usize| alternative.hints.iter().take(terms).map(|hint| hint.gain).sum::<f64>();
    let declared = log_data.seen_square(&log_data.declared);
    let mut fitted = |terms: usize| {
        let hints = alternative.hints.iter().take(terms).cloned().collect();
        let fit = proposal::fit(log_data, &Structure { hints, ..Structure::default() });
        fit.map_or(0.0, |(_, pass)| declared - log_data.seen_square(&pass))
    };
    let fewer = accepted - 1;
    (fewer > 0 && explain_as_much(promised(fewer)) && explain_as_much(fitted(fewer)))
        || (explain_more(promised(accepted)) && explain_more(fitted(accepted)))
}

/// Alternatives to every accepted effect, and one that explains more, with the place that it takes; none if what stands
/// there explains something else, so that both are there.
#[allow(clippy::type_complexity)] // used once
fn alternatives_to(
    log_data: &PreparedLog,
    accepted: &[Instance],
    rounds: &[Round],
) -> Option<(Vec<Vec<Alternative>>, Option<(Option<usize>, Instance)>)> {
    let found: Option<Vec<Vec<Alternative>>> = (0..accepted.len())
        .into_par_iter()
        .map(|place| {
            let others = others(accepted, place);
            match rounds.first() {
                Some(first) if others.is_empty() => Some(alternatives::find(log_data, accepted, place, first)),
                _ => Some(alternatives::find(log_data, accepted, place, &search::round(log_data, &others)?)),
            }
        })
        .collect();
    let alternatives = found?;
    let swap = alternatives.iter().enumerate().find_map(|(place, alternatives)| {
        let better = alternatives.iter().find(|alternative| alternative.is_separable)?;
        let degrees = |candidate: &Candidate| candidate.degrees() as f64;
        let cost = 2.0 * (degrees(&better.instance.candidate) - degrees(&accepted[place].candidate));
        let mut with = accepted.to_vec();
        let taken = better.is_possible().then_some(place);
        match taken {
            Some(place) => with[place] = better.instance.clone(),
            None => with.push(better.instance.clone()),
        }
        // What would be refused there takes no place.
        let stands = |with| Some(judged::founded(log_data, &log_data.fit(with, DataPart::Seen)?).is_ok());
        (better.deficit + cost < -1.0 && stands(&with)?).then(|| (taken, better.instance.clone()))
    });
    Some((alternatives, swap))
}

/// Intervals of onset and end of every effect that has them.
fn event_times(log_data: &PreparedLog, accepted: &[Instance]) -> Vec<Intervals> {
    let of = |place: usize| event_times::intervals(log_data, &others(accepted, place), &accepted[place]);
    (0..accepted.len()).into_par_iter().map(of).collect()
}

fn describe(
    log_data: &PreparedLog,
    accepted: &[Instance],
    alternatives: Vec<Vec<Alternative>>,
    joint: &JointFit,
    (without_each, times, rounds): (&[Pass], Vec<Intervals>, &[Round]),
) -> Option<Vec<FoundEffect>> {
    let mut found = Vec::new();
    let each = accepted.iter().zip(alternatives).zip(without_each.iter().zip(times));
    for (place, ((instance, alternatives), (without, times))) in each.enumerate() {
        let gain = log_data.seen_square(without) - joint.seen_square;
        let held_gain = gain_per_block(without, &joint.pass, |block| log_data.is_in(DataPart::Judge, block));
        let tried = rounds.first().map_or(1, |round| round.tried) as f64;
        let p_value = (chi_square_tail(gain, instance.candidate.degrees()) * tried).min(1.0);
        let values = values(&instance.candidate, &instance.sizes, joint.sigmas_of(place), times);
        found.push(FoundEffect { instance: instance.clone(), values, p_value, gain, held_gain, alternatives });
    }
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    Some(found)
}

/// The estimates of an effect; an end only where it has one.
fn values(candidate: &Candidate, sizes: &[f64], sigmas: &[f64], [onset, end]: Intervals) -> Vec<ParameterEstimate> {
    const UNKNOWN: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

    let mut place = 0;
    let all = candidate.values(sizes);
    candidate
        .info()
        .parameters
        .iter()
        .zip(all)
        .filter(|(parameter, _)| parameter.kind != ParameterKind::End || candidate.ends())
        .map(|(parameter, value)| {
            let ci95 = match parameter.kind {
                ParameterKind::Size => {
                    let half = Z_95 * sigmas[place];
                    place += 1;
                    [value - half, value + half]
                }
                ParameterKind::Onset => onset.unwrap_or(UNKNOWN),
                ParameterKind::End => end.unwrap_or(UNKNOWN),
                ParameterKind::Fin | ParameterKind::Transponder | ParameterKind::Shape => [value, value],
            };
            ParameterEstimate { name: parameter.name, unit: parameter.unit, kind: parameter.kind, value, ci95 }
        })
        .collect()
}

fn scale_notes(log_data: &PreparedLog) -> Vec<String> {
    let channels = ResidualChannel::ALL.into_iter();
    channels
        .filter(|channel| log_data.setup.scale[*channel as usize] > 1.0)
        .map(|channel| {
            let scale = log_data.setup.scale[channel as usize];
            format!("{}: the noise is {scale:.2} times the declared noise; the larger value is used", channel.name())
        })
        .collect()
}
