//! One run of the study: a simulated log, the verdict of `diagnose`, and the filter's error with the diagnosed vehicle.

use super::plan::Class;
use super::separability::{self, Separability, digits, truth};
use anyhow::{Context, anyhow};
use backseat_core::effects::ParameterKind;
use backseat_diagnose::candidates::{Candidate, Instance, beyond};
use backseat_diagnose::diagnosis::{self, Diagnosis, FoundEffect};
use backseat_diagnose::floor;
use backseat_diagnose::log_effects::Effects;
use backseat_diagnose::prepared_log::PreparedLog;
use backseat_diagnose::scores::{self, Scores};
use backseat_diagnose::verdict::Verdict;
use backseat_diagnose::whitener::Pass;
use hil_sim::dataset::{self, Dataset, Shape, Spec};
use hil_sim::noise::NoiseKind;
use hil_sim::scenario::Effect;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A finished run, as it is kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DiagnosedLog {
    /// Kept beside the run, not in it.
    #[serde(skip)]
    pub seed: u64,
    pub class: Class,
    /// Manoeuvres that excite; else lines to and fro.
    pub excite: bool,
    /// Noise as sensors have it, drawn from the seed; else white as it is declared.
    pub mixed: bool,
    pub dvl: bool,
    /// Inputs move on between their samples; else they are held.
    #[serde(default)]
    pub ramps: bool,
    pub injected: Vec<Injected>,
    /// Why a log of this kind cannot judge an effect injected.
    pub not_judged: Option<String>,
    pub verdict: String,
    /// Effects found, the strongest first.
    pub found: Vec<Named>,
    /// Of every true effect that has one; of a cause that is no entry, from all entries.
    pub separability: Vec<Separability>,
    /// Errors on held-out blocks: of the declared model, with the effects found, and with the effects injected (out of
    /// catalogue: of the declared model on the same log flown without the effect).
    pub declared: HeldOutErrors,
    pub after: HeldOutErrors,
    pub declaring_truth: HeldOutErrors,
    /// First term on which the unexplained residual depends.
    pub hint: Option<String>,
}

/// An effect injected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Injected {
    pub effect: String,
    /// Numbers by name; of a fin its place from 1.
    pub parameters: BTreeMap<String, f64>,
}

/// An effect found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Named {
    pub effect: String,
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub fin: Option<String>,
    pub parameters: BTreeMap<String, SizeEstimate>,
    /// Entries that the data leave possible in its place, with the fin where there is one.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub ambiguous_with: Vec<String>,
}

/// A value with its interval, if a finite one was given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SizeEstimate {
    pub value: f64,
    pub ci95: Option<[f64; 2]>,
}

/// Root mean squares on held-out blocks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeldOutErrors {
    /// Horizontal position of the flight filter against the truth, m.
    pub position_m: Option<f64>,
    /// Velocity after ten seconds of prediction, m/s.
    pub velocity_mps: Option<f64>,
    /// Prediction over ten seconds against the readings: roll, pitch, heading in rad, rates in rad/s, depth in m.
    pub predicted: Vec<Option<f64>>,
    /// Largest root mean square of any channel's normalised innovations.
    pub innovation: f64,
}

/// Simulates, diagnoses and compares.
pub fn run(class: Class, spec: &Spec, seed: u64) -> anyhow::Result<DiagnosedLog> {
    let data = dataset::simulate(spec, seed);
    let mut log_data = ready(&data, spec)?;
    let declared_set = Effects::from(spec.vehicle.effects.set);
    let d = diagnosis::run(&mut log_data, |_| {})
        .context("a state of the filter is not finite: check the units and signs of the log")?;
    let all_scores = |log_data: &PreparedLog, data: &Dataset, pass: &Pass, set: &Effects| {
        let scores = scores::of(log_data, pass, set, &data.log, &spec.vehicle, Some(&data.truth), spec.dvl);
        scores.map_err(|error| anyhow!("{error}"))
    };
    let score = |log_data: &PreparedLog, data: &Dataset, pass: &Pass, set: &Effects| -> anyhow::Result<HeldOutErrors> {
        Ok(HeldOutErrors::of(&all_scores(log_data, data, pass, set)?))
    };
    let declared = score(&log_data, &data, &d.before, &declared_set)?;
    let set = d.set(&declared_set);
    let proposed = match &d.with_terms {
        Some(pass) => all_scores(&log_data, &data, pass, &declared_set)?,
        None => all_scores(&log_data, &data, &d.after, &set)?,
    };
    let after = if set == declared_set { declared.clone() } else { score(&log_data, &data, &d.after, &set)? };
    let d = floor::under(d, &log_data, &proposed);
    let declaring_truth = match class {
        Class::None => declared.clone(),
        Class::Single | Class::Pair | Class::Triple => {
            let set = truth(&spec.vehicle, &data.effects);
            let pass = log_data.pass(&set, &[]).context("the truth is impossible for the model")?;
            score(&log_data, &data, &pass, &set)?
        }
        Class::Outside => {
            let clean = Spec { effects: Vec::new(), ..spec.clone() };
            let data = dataset::simulate(&clean, seed);
            let log_data = ready(&data, spec)?;
            score(&log_data, &data, &log_data.declared, &declared_set)?
        }
    };
    let skipped = beyond(&log_data.scope);
    let reason = |effect: &Effect| skipped.iter().find(|(name, _)| *name == effect.name());
    Ok(DiagnosedLog {
        seed,
        class,
        excite: spec.shape == Shape::Excite,
        mixed: spec.noise == NoiseKind::Mixed,
        dvl: spec.dvl,
        ramps: spec.ramps,
        injected: data.effects.iter().map(Injected::of).collect(),
        not_judged: data.effects.iter().find_map(reason).map(|(name, reason)| format!("{name}: {reason}")),
        verdict: d.verdict.name().to_owned(),
        found: d.effects.iter().map(Named::of).collect(),
        separability: match class {
            Class::Outside => {
                let named: Vec<Instance> = d.effects.iter().map(|found| found.instance.clone()).collect();
                separability::of_outside(spec, seed, &named).into_iter().collect()
            }
            _ => separability::of(spec, seed),
        },
        declared,
        after,
        declaring_truth,
        hint: hint(&d),
    })
}

fn ready(data: &Dataset, spec: &Spec) -> anyhow::Result<PreparedLog> {
    PreparedLog::new(&data.log, &spec.vehicle, spec.dvl).context("the filter cannot start")
}

fn hint(d: &Diagnosis) -> Option<String> {
    let is_shown = matches!(d.verdict, Verdict::Unexplained | Verdict::Implausible);
    d.structure.hints.first().filter(|_| is_shown).map(|hint| hint.generic.name())
}

impl Injected {
    fn of(effect: &Effect) -> Self {
        let parameters = effect.parameters().map(|(parameter, value)| (parameter.name.to_owned(), digits(value)));
        Self { effect: effect.name().to_owned(), parameters: parameters.collect() }
    }
}

impl Named {
    fn of(found: &FoundEffect) -> Self {
        let own = &found.instance.candidate;
        let value = |value: &diagnosis::ParameterEstimate| {
            let ci95 = value.ci95.iter().all(|end| end.is_finite()).then_some(value.ci95.map(digits));
            (value.name.to_owned(), SizeEstimate { value: digits(value.value), ci95 })
        };
        let mut ambiguous_with: Vec<String> = Vec::new();
        for alternative in found.alternatives.iter().filter(|alternative| alternative.is_possible()) {
            ambiguous_with.push(alternative.instance.candidate.label());
        }
        Self {
            effect: own.effect.to_owned(),
            fin: fin(own),
            parameters: found.values.iter().filter(|value| value.kind != ParameterKind::Fin).map(value).collect(),
            ambiguous_with,
        }
    }
}

fn fin(candidate: &Candidate) -> Option<String> {
    candidate.member.map(|place| candidate.which(place))
}

impl HeldOutErrors {
    fn of(scores: &Scores) -> Self {
        Self {
            position_m: scores.position_rmse_m.map(digits),
            velocity_mps: scores.velocity_rmse_mps.map(digits),
            predicted: scores.prediction.iter().skip(3).map(|row| row[scores::VELOCITY_HORIZON].map(digits)).collect(),
            innovation: digits(scores.whiteness.iter().map(|w| w.nis.sqrt()).fold(0.0, f64::max)),
        }
    }
}
