//! The whole loop: find, trace, add, and round again.

use crate::bench::{Bench, Joint, Part};
use crate::candidates::{Candidate, Instance, set_of};
use crate::model::Model;
use crate::noise;
use crate::rivals::{self, Rival};
use crate::search::{self, MOST_EFFECTS, Round};
use crate::statistics::chi2_tail;
use crate::structure::{self, Structure};
use crate::waves;
use crate::whitener::{Pass, Residual};
use backseat_core::effects::{EffectSet, ParameterKind};
use backseat_data::stats::{mean_ci95, wilson_ci95};
use rayon::prelude::*;

/// Two-sided 95 % of a normal variable.
const Z_95: f64 = backseat_data::stats::Z_95;

/// What the log says about the declared model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Nothing significant is left by the declared model.
    None,
    /// The effects found account for what it leaves.
    Explained,
    /// They do, but others would as well.
    Ambiguous,
    /// Structure remains that no entry accounts for.
    Unexplained,
}

impl Verdict {
    /// As in the JSON object.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Explained => "explained",
            Self::Ambiguous => "ambiguous",
            Self::Unexplained => "unexplained",
        }
    }
}

/// One parameter of a found effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value {
    /// Name, as in the catalogue.
    pub name: &'static str,
    /// Unit, as in the catalogue.
    pub unit: &'static str,
    /// What kind of number.
    pub kind: ParameterKind,
    /// Fitted on the training blocks.
    pub value: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
}

/// An effect that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// What, with its values.
    pub instance: Instance,
    /// Its parameters with intervals, in the order of the catalogue.
    pub values: Vec<Value>,
    /// Probability of so much evidence where there is none, after the number of hypotheses tried.
    pub p_value: f64,
    /// By how much Σ e² falls by it, over the whole log.
    pub gain: f64,
    /// Gain per held-out block: mean and 95 % interval.
    pub held_gain: Option<(f64, [f64; 2])>,
    /// Entries that the data cannot exclude in its place, best first.
    pub rivals: Vec<Rival>,
}

/// The outcome.
#[derive(Clone, Debug)]
pub struct Diagnosis {
    /// In one word.
    pub verdict: Verdict,
    /// What was found, strongest first.
    pub effects: Vec<Found>,
    /// The ladder of every round.
    pub rounds: Vec<Round>,
    /// Structure beside the effects.
    pub structure: Structure,
    /// Innovations of the declared model and of the augmented one.
    pub before: Pass,
    /// See `before`.
    pub after: Pass,
    /// What could not be judged, and what was assumed.
    pub notes: Vec<String>,
}

impl Diagnosis {
    /// All effects found beside those declared, as the vehicle file holds them.
    #[must_use]
    pub fn set(&self, declared: &EffectSet) -> EffectSet {
        self.effects.iter().fold(*declared, |set, found| found.instance.apply(&set))
    }
}

/// Diagnoses a log; `progress` is told what is being done.
///
/// `None` if the numbers leave the finite.
#[must_use]
pub fn run(bench: &mut Bench, mut progress: impl FnMut(&str)) -> Option<Diagnosis> {
    progress("noise");
    let mut noise_effects = noise_effects(bench, &bench.declared.residuals.clone())?;
    let (mut accepted, mut rounds): (Vec<Instance>, Vec<Round>) = (Vec::new(), Vec::new());
    let mut joint = None;
    while accepted.len() <= MOST_EFFECTS {
        progress(&format!("hypotheses, round {}", accepted.len() + 1));
        let round = search::round(bench, &accepted)?;
        let next = if accepted.len() < MOST_EFFECTS { choose(bench, &accepted, &round) } else { None };
        rounds.push(round);
        let Some(next) = next else { break };
        accepted.push(next);
        progress("refit");
        let Some(refitted) = search::refit(bench, &accepted) else {
            // No values of it are possible on the training blocks.
            accepted.pop();
            break;
        };
        let fitted = joint.insert(refitted);
        accepted = fitted.instances.clone();
        let kept = still_needed(fitted);
        if kept.iter().any(|kept| !kept) {
            let mut flags = kept.iter();
            accepted.retain(|_| flags.next().copied().unwrap_or(true));
            joint = None;
            // What is dropped would be found again: this is the end of the ladder.
            break;
        }
        // Outliers and waves show better once the rest is explained.
        noise_effects = self::noise_effects(bench, &fitted.pass.residuals)?;
    }
    progress("rivals");
    let (accepted, rivals, joint) = settle(bench, accepted, joint, &rounds)?;
    progress("structure");
    let swell = noise_effects.iter().any(|found| found.instance.candidate.effect == "waves");
    let left = structure::find(bench, &accepted, swell)?;
    let found = describe(bench, &accepted, rivals, &joint, &rounds)?;
    let explained: f64 = bench.declared.normal.sum(|_| true).square - joint.whole_square;
    let mut found = found;
    let is_structured = (!left.hints.is_empty() && left.gain > tolerated(explained)) || exceeds_noise(&joint.pass);
    let is_usurped = !accepted.is_empty() && !is_structured && generic_is_better(bench, &accepted, explained, swell)?;
    let mut verdict = if is_structured || is_usurped { Verdict::Unexplained } else { Verdict::None };
    let structure = if verdict == Verdict::Unexplained && !accepted.is_empty() {
        // What the entries took was not theirs: the hints are against the declared model.
        found.clear();
        structure::find(bench, &[], swell)?
    } else {
        left
    };
    if verdict != Verdict::Unexplained {
        found.extend(noise_effects);
        found.sort_by(|a, b| a.p_value.total_cmp(&b.p_value).then(b.gain.total_cmp(&a.gain)));
    }
    if verdict != Verdict::Unexplained && !found.is_empty() {
        let is_ambiguous = found.iter().any(|found| {
            found
                .rivals
                .iter()
                .any(|rival| rival.is_possible() && rival.instance.candidate.effect != found.instance.candidate.effect)
        });
        verdict = if is_ambiguous { Verdict::Ambiguous } else { Verdict::Explained };
    }
    let after = if found.is_empty() { bench.declared.clone() } else { joint.pass };
    let notes = crate::candidates::beyond(&bench.scope)
        .into_iter()
        .map(|(effect, reason)| format!("{effect} not judged: {reason}"))
        .chain(scale_notes(bench))
        .collect();
    Some(Diagnosis { verdict, effects: found, rounds, structure, before: bench.declared.clone(), after, notes })
}

/// Structure beside the accepted effects is tolerated up to this part of what they explain, and up to this much.
const TOLERATED: (f64, f64) = (5e-4, 60.0);

fn tolerated(explained: f64) -> f64 {
    (TOLERATED.0 * explained).min(TOLERATED.1)
}

/// Whether Σ e² is larger than noise of the declared size makes it: what is left may be too slow or too irregular for
/// any term to stand out against its own scatter.
fn exceeds_noise(pass: &Pass) -> bool {
    /// What an inexact step of integration or declared noise a percent too small may add.
    const SLACK: f64 = 0.02;
    const SIGMAS: f64 = 6.0;
    let sum = pass.normal.sum(|_| true);
    let count = sum.count as f64;
    sum.square > count * (1.0 + SLACK) + SIGMAS * (2.0 * count).sqrt()
}
/// By how much as many generic terms as entries must explain more to take their place: chance gives them no more than
/// this where the entries are right.
const BETTER: f64 = 10.0;
/// What fewer generic terms than entries may explain less and still take their place: a number and a part.
const WORSE: (f64, f64) = (10.0, 0.005);

/// Whether as many generic terms explain more than the entries, or fewer as much: then the entries stand in for
/// something that is not theirs.
fn generic_is_better(bench: &Bench, accepted: &[Instance], explained: f64, swell: bool) -> Option<bool> {
    let rival = structure::find(bench, &[], swell)?;
    let gain = |terms: usize| rival.hints.iter().take(terms).map(|hint| hint.gain).sum::<f64>();
    let is_simpler = accepted.len() > 1 && gain(accepted.len() - 1) > explained - WORSE.0 - WORSE.1 * explained;
    Some(is_simpler || gain(accepted.len()) > explained + BETTER)
}

/// The best hypothesis of a round that stands, fitted in full where several come close.
fn choose(bench: &Bench, accepted: &[Instance], round: &Round) -> Option<Instance> {
    const CLOSE: (f64, f64) = (40.0, 0.1);
    const MOST: usize = 4;
    // Linear fits may leave what a vehicle can be (a drag that drives).
    let is_possible = |instance: &Instance| {
        let set = instance.apply(&set_of(&bench.scope.declared, accepted));
        Model::new(&bench.setup.parameters, &set).is_some()
    };
    let standing: Vec<_> = round
        .ladder
        .iter()
        .filter(|e| round.is_significant(e) && e.instance.is_resolved() && is_possible(&e.instance))
        .collect();
    let top = standing.first()?.score();
    let close: Vec<_> = standing.iter().filter(|e| e.score() > top - CLOSE.0 - CLOSE.1 * top).take(MOST).collect();
    let refined = |found: &Instance| {
        let has_onset = found.candidate.onset_s.is_some();
        if has_onset { search::refine_onset(bench, accepted, found) } else { Some(found.clone()) }
    };
    if close.len() == 1 {
        return refined(&close[0].instance);
    }
    close
        .iter()
        .filter_map(|e| {
            let mut instances = accepted.to_vec();
            instances.push(refined(&e.instance)?);
            let joint = bench.fit(&instances, Part::Whole)?;
            Some((joint.whole_square + 2.0 * e.degrees as f64, joint.instances.last()?.clone()))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, instance)| instance)
}

/// Whether each effect is still significant beside the others (Wald's test at the joint fit).
fn still_needed(joint: &Joint) -> Vec<bool> {
    if joint.instances.len() < 2 {
        return vec![true; joint.instances.len()];
    }
    let mut at = 0;
    joint
        .instances
        .iter()
        .map(|instance| {
            let sizes = instance.sizes.len();
            let square: f64 =
                instance.sizes.iter().zip(&joint.sigmas[at..at + sizes]).map(|(x, s)| (x / s).powi(2)).sum();
            at += sizes;
            // A joint test would need their covariance; the sum bounds it well enough to drop what is nothing.
            instance.candidate.fin.is_some() && instance.candidate.onset_s.is_some() || chi2_tail(square, sizes) < 1e-3
        })
        .collect()
}

/// Rivals of every accepted effect; one that explains more takes the effect's place.
#[allow(clippy::type_complexity)] // used once
fn settle(
    bench: &Bench,
    accepted: Vec<Instance>,
    joint: Option<Joint>,
    rounds: &[Round],
) -> Option<(Vec<Instance>, Vec<Vec<Rival>>, Joint)> {
    let (mut accepted, mut joint) = (accepted, joint);
    for _ in 0..2 {
        let found: Option<Vec<Vec<Rival>>> = (0..accepted.len())
            .into_par_iter()
            .map(|place| {
                let others = without(&accepted, place);
                match rounds.first() {
                    Some(first) if others.is_empty() => Some(rivals::find(bench, &accepted, place, first)),
                    _ => Some(rivals::find(bench, &accepted, place, &search::round(bench, &others)?)),
                }
            })
            .collect();
        let rivals = found?;
        let swap = rivals.iter().enumerate().find_map(|(place, rivals)| {
            let better = rivals.first()?;
            let degrees = |candidate: &Candidate| candidate.degrees() as f64;
            let cost = 2.0 * (degrees(&better.instance.candidate) - degrees(&accepted[place].candidate));
            (better.deficit + cost < -1.0).then(|| (place, better.instance.clone()))
        });
        match swap {
            None => {
                let joint = match joint.take() {
                    Some(joint) => joint,
                    None => search::refit(bench, &accepted)?,
                };
                return Some((joint.instances.clone(), rivals, joint));
            }
            Some((place, instance)) => accepted[place] = instance,
        }
        joint = None;
    }
    let joint = search::refit(bench, &accepted)?;
    let rivals = vec![Vec::new(); accepted.len()];
    Some((joint.instances.clone(), rivals, joint))
}

/// The others.
fn without(accepted: &[Instance], place: usize) -> Vec<Instance> {
    accepted.iter().enumerate().filter(|(i, _)| *i != place).map(|(_, other)| other.clone()).collect()
}

fn describe(
    bench: &Bench,
    accepted: &[Instance],
    rivals: Vec<Vec<Rival>>,
    joint: &Joint,
    rounds: &[Round],
) -> Option<Vec<Found>> {
    let alone: Option<Vec<(Pass, Option<[f64; 2]>)>> = (0..accepted.len())
        .into_par_iter()
        .map(|place| {
            let others = without(accepted, place);
            let onset = onset_interval(bench, &others, &accepted[place]);
            let pass = if others.is_empty() { bench.declared.clone() } else { bench.fit(&others, Part::Train)?.pass };
            Some((pass, onset))
        })
        .collect();
    let mut at = 0;
    let mut found = Vec::new();
    for ((instance, rivals), (without, onset)) in accepted.iter().zip(rivals).zip(alone?) {
        let gain = without.normal.sum(|_| true).square - joint.whole_square;
        let blocks = bench.held_gain(&without, &joint.pass);
        let held_gain =
            mean_ci95(&blocks).map(|(low, high)| (blocks.iter().sum::<f64>() / blocks.len() as f64, [low, high]));
        let sigmas = &joint.sigmas[at..at + instance.sizes.len()];
        at += instance.sizes.len();
        let tried = rounds.first().map_or(1, |round| round.tried) as f64;
        let p_value = (chi2_tail(gain, instance.candidate.degrees()) * tried).min(1.0);
        let values = values(&instance.candidate, &instance.sizes, sigmas, onset);
        found.push(Found { instance: instance.clone(), values, p_value, gain, held_gain, rivals });
    }
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    Some(found)
}

/// Times about the onset at which Σ e² is within 3.84 of its least: the interval, s.
fn onset_interval(bench: &Bench, others: &[Instance], instance: &Instance) -> Option<[f64; 2]> {
    let centre = instance.candidate.onset_s?;
    let mut step_s = 0.25;
    for _ in 0..5 {
        let onsets: Vec<f64> = (-12..=12).map(|k| centre + step_s * f64::from(k)).collect();
        let gains = search::onset_gains(bench, others, &instance.candidate, &onsets)?;
        let top = gains.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let inside: Vec<usize> = (0..gains.len()).filter(|i| gains[*i] > top - Z_95 * Z_95).collect();
        let (first, last) = (*inside.first()?, *inside.last()?);
        if first > 0 && last + 1 < gains.len() {
            return Some([onsets[first] - step_s, onsets[last] + step_s]);
        }
        step_s *= 4.0;
    }
    None
}

fn values(candidate: &Candidate, sizes: &[f64], sigmas: &[f64], onset: Option<[f64; 2]>) -> Vec<Value> {
    let mut place = 0;
    let all = candidate.values(sizes);
    candidate
        .info()
        .parameters
        .iter()
        .zip(all)
        .map(|(parameter, value)| {
            let ci95 = match parameter.kind {
                ParameterKind::Size => {
                    let half = Z_95 * sigmas[place];
                    place += 1;
                    [value - half, value + half]
                }
                ParameterKind::Onset => onset.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]),
                ParameterKind::Fin | ParameterKind::Shape => [value, value],
            };
            Value { name: parameter.name, unit: parameter.unit, kind: parameter.kind, value, ci95 }
        })
        .collect()
}

/// Outliers and waves in the innovations of a pass; what is found changes the bench's noise.
fn noise_effects(bench: &mut Bench, residuals: &[Residual]) -> Option<Vec<Found>> {
    let mut found = Vec::new();
    let before = (bench.setup.outliers.clone(), bench.setup.scale);
    bench.setup.scale = bench.own_scale;
    let flags = noise::flags(&bench.samples, residuals);
    if flags.contains(&true) || bench.setup.outliers.contains(&true) {
        bench.setup.outliers = flags;
    }
    let judged = noise::outliers(residuals);
    let hits = judged.iter().filter(|(_, is_out)| *is_out).count();
    let p_value = noise::outlier_tail(hits, judged.len());
    if p_value < search::FAMILY_ERROR / 10.0 {
        let share = hits as f64 / judged.len() as f64;
        let (low, high) = wilson_ci95(hits as u64, judged.len() as u64).unwrap_or((0.0, 1.0));
        found.push(noise_found("range_outliers", &[(share, [low, high])], p_value));
    }
    if let Some(waves) = waves::find(&bench.samples, residuals).filter(is_swell) {
        let interval = |value: f64, sigma: f64| (value, [value - Z_95 * sigma, value + Z_95 * sigma]);
        let sizes =
            [interval(waves.amplitude_mps, waves.amplitude_sigma_mps), interval(waves.period_s, waves.period_sigma_s)];
        let declared = bench.setup.sensors.dvl_mps;
        let scale = (1.0 + 0.5 * (waves.amplitude_mps / declared).powi(2)).sqrt();
        for channel in [crate::samples::Channel::DvlU, crate::samples::Channel::DvlV, crate::samples::Channel::DvlW] {
            bench.setup.scale[channel as usize] = bench.setup.scale[channel as usize].max(scale);
        }
        // Carried up and down, the vehicle's depth swings as well.
        let swing_m = waves.amplitude_mps * waves.period_s / std::f64::consts::TAU;
        let depth = (1.0 + 0.5 * (swing_m / bench.setup.sensors.depth_m).powi(2)).sqrt();
        let scale = &mut bench.setup.scale[crate::samples::Channel::Depth as usize];
        *scale = scale.max(depth);
        found.push(noise_found("waves", &sizes, waves.p));
    }
    if before != (bench.setup.outliers.clone(), bench.setup.scale) {
        bench.declared = bench.pass(&bench.scope.declared, &[])?;
    }
    Some(found)
}

/// A peak that is unlikely by chance, and an amplitude that the velocities themselves show.
fn is_swell(waves: &waves::Waves) -> bool {
    waves.p < search::FAMILY_ERROR / 10.0 && waves.amplitude_mps > 3.0 * waves.amplitude_sigma_mps
}

fn noise_found(effect: &'static str, sizes: &[(f64, [f64; 2])], p_value: f64) -> Found {
    let candidate = Candidate { effect, fin: None, onset_s: None };
    let parameters = candidate.info().parameters.iter().zip(sizes);
    let values = parameters
        .map(|(p, (value, ci95))| Value { name: p.name, unit: p.unit, kind: p.kind, value: *value, ci95: *ci95 })
        .collect();
    let sizes = sizes.iter().map(|(value, _)| *value).collect();
    Found { instance: Instance { candidate, sizes }, values, p_value, gain: 0.0, held_gain: None, rivals: Vec::new() }
}

fn scale_notes(bench: &Bench) -> Vec<String> {
    let channels = crate::samples::Channel::ALL.into_iter();
    channels
        .filter(|channel| bench.setup.scale[*channel as usize] > 1.0)
        .map(|channel| {
            let scale = bench.setup.scale[channel as usize];
            format!("{}: noise taken as {scale:.2} times the declared one", channel.name())
        })
        .collect()
}
