//! What a diagnosis says of an effect that was put in.

use super::inject::Injection;
use backseat_core::effects::ParameterKind;
use backseat_diagnose::diagnosis::{FoundEffect, ParameterEstimate};
use backseat_diagnose::log_models::LogModelDiagnosis;
use backseat_diagnose::verdict::Verdict;
use backseat_logs::stats::Z_95;
use serde::{Deserialize, Serialize};

/// Sigmas from which on an effect should be named.
const SIGMAS: f64 = 3.0;

/// A log as it was recorded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Base {
    pub duration_s: f64,
    pub verdict: String,
    pub named: Vec<String>,
}

/// One effect in one log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scored {
    pub name: String,
    /// The entry; none: a cause in no entry.
    pub effect: Option<String>,
    pub from_middle: bool,
    pub verdict: String,
    pub named: Vec<String>,
    /// Size, with that of the log itself, over the sigma that the log has for it with every other entry fitted beside it, the
    /// largest of its parameters; none: the log does not tell it from others.
    pub sigmas: Option<f64>,
    pub is_named: bool,
    /// Whether it stands among what could take the place of what is named.
    pub is_listed: bool,
    /// Intervals of its parameters, and how many hold the truth: what was put in and what the log itself was found to hold.
    pub intervals: usize,
    pub hold: usize,
    /// The same, if what the log itself may hold without its being significant is part of the truth.
    pub hold_with_own: usize,
    /// Of each: its name, its 95 % interval and the truth.
    pub sizes: Vec<(String, [f64; 2], f64)>,
    /// Called explained, by a name that is neither what was put in nor what the log itself was found to hold.
    pub is_wrong: bool,
}

impl Base {
    pub fn of(found: &LogModelDiagnosis, duration_s: f64) -> Self {
        Self { duration_s, verdict: found.diagnosis.verdict.name().to_owned(), named: names(found) }
    }
}

/// Whether a log of this kind has the entry.
pub fn tests(found: &LogModelDiagnosis, effect: &str) -> bool {
    found.not_named.iter().any(|entry| entry.effect == effect) || names(found).iter().any(|name| name == effect)
}

/// Scores a log with an effect put in, beside the log as it was recorded.
pub fn of(injection: &Injection, base: &LogModelDiagnosis, found: &LogModelDiagnosis) -> Scored {
    let effect = injection.effect.unwrap_or_default();
    let named = effect_of(found, effect);
    let own = effect_of(base, effect);
    let tested = found.not_named.iter().find(|entry| entry.effect == effect && !entry.values.is_empty());
    let values = named.map(|named| &named.values).or(tested.map(|entry| &entry.values));
    let is_size =
        |value: &&ParameterEstimate| value.kind == ParameterKind::Size && value.ci95.iter().all(|end| end.is_finite());
    let of_log = |own: Option<&Vec<ParameterEstimate>>, name: &str| {
        own.and_then(|own| own.iter().find(|other| other.name == name)).map_or(0.0, |of_log| of_log.value)
    };
    let truth = |value: &ParameterEstimate| injection.size(value.name) + of_log(own.map(|own| &own.values), value.name);
    let allowed = base.not_named.iter().find(|entry| entry.effect == effect).map(|entry| &entry.values);
    let with_own = |value: &ParameterEstimate| truth(value) + of_log(allowed, value.name);
    // The sigma of a diagnosis takes what it did not choose as absent: beside all it is larger.
    let beside_all = found.sigmas_beside_all.iter().find(|(name, _)| *name == effect).map(|(_, sigmas)| sigmas);
    let sigmas = values.map(|values| {
        let of = |(place, value): (usize, &ParameterEstimate)| {
            let own = (value.ci95[1] - value.ci95[0]) / (2.0 * Z_95);
            let sigma = beside_all.and_then(|all| all.get(place)).map_or(own, |all| own.max(*all));
            truth(value).abs() / sigma.max(f64::MIN_POSITIVE)
        };
        values.iter().filter(is_size).enumerate().map(of).fold(0.0, f64::max)
    });
    // A log that holds the entry all along has no other size of it from the middle on.
    let sized = named.filter(|_| !(injection.from_middle && own.is_some()));
    let sizes: Vec<&ParameterEstimate> = sized.iter().flat_map(|named| named.values.iter().filter(is_size)).collect();
    let holds = |value: &ParameterEstimate, truth: f64| (value.ci95[0]..=value.ci95[1]).contains(&truth);
    let base_names = names(base);
    let is_foreign = |found: &FoundEffect| {
        let name = found.instance.candidate.effect;
        name != effect && !base_names.iter().any(|other| other == name)
    };
    let could_be = |found: &FoundEffect| {
        found.possible_alternatives().any(|alternative| alternative.instance.candidate.effect == effect)
    };
    Scored {
        name: injection.name.clone(),
        effect: injection.effect.map(ToOwned::to_owned),
        from_middle: injection.from_middle,
        verdict: found.diagnosis.verdict.name().to_owned(),
        named: names(found),
        sigmas,
        is_named: named.is_some(),
        is_listed: found.diagnosis.effects.iter().any(could_be),
        intervals: sizes.len(),
        hold: sizes.iter().filter(|value| holds(value, truth(value))).count(),
        hold_with_own: sizes.iter().filter(|value| holds(value, with_own(value))).count(),
        sizes: sizes.iter().map(|value| (value.name.to_owned(), value.ci95, truth(value))).collect(),
        is_wrong: found.diagnosis.verdict == Verdict::Explained && found.diagnosis.effects.iter().any(is_foreign),
    }
}

impl Scored {
    /// Whether it should be named.
    pub fn is_beyond(&self) -> bool {
        self.effect.is_some() && self.sigmas.is_some_and(|sigmas| sigmas >= SIGMAS)
    }
}

fn effect_of<'a>(found: &'a LogModelDiagnosis, effect: &str) -> Option<&'a FoundEffect> {
    found.diagnosis.effects.iter().find(|found| found.instance.candidate.effect == effect)
}

fn names(found: &LogModelDiagnosis) -> Vec<String> {
    found.diagnosis.effects.iter().map(|found| found.instance.candidate.effect.to_owned()).collect()
}
