//! Separability of a true effect, computed from the same log without noise.

use backseat_core::effects::{self, Enters, ParameterKind};
use backseat_diagnose::candidates::{Candidate, Instance, Span};
use backseat_diagnose::log_effects::Effects;
use backseat_diagnose::prepared_log::{DataPart, PreparedLog};
use backseat_diagnose::search;
use backseat_diagnose::selection::Round;
use backseat_logs::VehicleFile;
use hil_sim::dataset::{self, Spec};
use hil_sim::noise::NoiseKind;
use hil_sim::scenario::Effect;
use serde::{Deserialize, Serialize};

/// Competitors on the linearised problem that are fitted in full.
const COMPETITORS: usize = 3;
/// By how much their gain may fall short of the best one's there: a number, and a share.
const SHORT: (f64, f64) = (60.0, 0.2);

/// Distance of a true effect from its closest competitor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Separability {
    /// The effect.
    pub effect: String,
    /// √χ² between it and its best-fitting competitor.
    pub value: f64,
    /// The competitor; `none` if the declared model comes closest.
    pub competitor: String,
}

/// Of every true effect that enters the model; an entry of noise has no equations to compete in.
pub fn of(spec: &Spec, seed: u64) -> Vec<Separability> {
    let mut spec = spec.clone();
    spec.noise = NoiseKind::Off;
    let data = dataset::simulate(&spec, seed);
    let Some(log_data) = PreparedLog::new(&data.log, &spec.vehicle, spec.dvl) else { return Vec::new() };
    let all = truth(&spec.vehicle, &data.effects);
    let Some(declared_square) = square(&log_data, &all) else { return Vec::new() };
    let one = |place: usize| one(&log_data, &spec.vehicle, &data.effects, place, declared_square);
    (0..data.effects.len()).filter_map(one).collect()
}

fn one(
    log_data: &PreparedLog,
    vehicle: &VehicleFile,
    effects: &[Effect],
    place: usize,
    declared_square: f64,
) -> Option<Separability> {
    let own = effects[place].name();
    let others: Vec<Instance> =
        effects.iter().enumerate().filter(|(i, _)| *i != place).filter_map(|(_, other)| instance(other)).collect();
    let round = search::round(log_data, &others)?;
    // An entry of noise, or one that such a log cannot show, has no competitors.
    round.ladder.iter().find(|e| e.instance.candidate.effect == own)?;
    let rest: Vec<Effect> = effects.iter().enumerate().filter(|(i, _)| *i != place).map(|(_, e)| e.clone()).collect();
    let without = square(log_data, &truth(vehicle, &rest))?;
    Some(closest(log_data, &others, own, &round, without).apart(own, declared_square))
}

/// Of a cause that is no entry: how far it is from every entry, and from the entries `named` together, if any were. Where
/// it is near, it *is* an entry as far as this log can say, and that entry is the right answer.
pub fn of_outside(spec: &Spec, seed: u64, named: &[Instance]) -> Option<Separability> {
    let mut spec = Spec { noise: NoiseKind::Off, ..spec.clone() };
    let ready = |spec: &Spec| {
        let data = dataset::simulate(spec, seed);
        Some((PreparedLog::new(&data.log, &spec.vehicle, spec.dvl)?, data.effects))
    };
    let (log_data, effects) = ready(&spec)?;
    spec.effects.clear();
    // What the model leaves of the same flight without the cause.
    let clean = ready(&spec)?.0;
    let floor = clean.seen_square(&clean.declared);
    let without = log_data.seen_square(&log_data.declared);
    let round = search::round(&log_data, &[])?;
    let mut best = closest(&log_data, &[], "", &round, without);
    let fits_model = |one: &&Instance| one.candidate.info().enters != Enters::Noise;
    let named: Vec<Instance> = named.iter().filter(fits_model).cloned().collect();
    if let Some(fitted) = log_data.fit(&named, DataPart::Seen).filter(|_| !named.is_empty()) {
        let names: Vec<&str> = named.iter().map(|one| one.candidate.effect).collect();
        best = best.or(fitted.seen_square, names.join(" and "));
    }
    Some(best.apart(effects.first()?.name(), floor))
}

/// The competitor that leaves least.
struct Competitor {
    /// Σ e² with it.
    square: f64,
    name: String,
}

impl Competitor {
    fn or(self, square: f64, name: impl Into<String>) -> Self {
        if square < self.square { Self { square, name: name.into() } } else { self }
    }

    /// How far it is from `effect`, with which Σ e² is `least`.
    fn apart(self, effect: &str, least: f64) -> Separability {
        Separability {
            effect: effect.to_owned(),
            value: digits((self.square - least).max(0.0).sqrt()),
            competitor: self.name,
        }
    }
}

/// The best of the entries but `own`, beside `others`; without any, Σ e² is `without`.
fn closest(log_data: &PreparedLog, others: &[Instance], own: &str, round: &Round, without: f64) -> Competitor {
    let alternatives: Vec<_> =
        round.ladder.iter().filter(|e| e.instance.candidate.effect != own && e.gain > 0.0).collect();
    let top = alternatives.iter().map(|e| e.gain).fold(0.0, f64::max);
    let close = alternatives.into_iter().filter(|e| e.gain > top - SHORT.0 - SHORT.1 * top).take(COMPETITORS);
    let none = Competitor { square: without, name: "none".to_owned() };
    close.fold(none, |best, e| {
        let mut joint = others.to_vec();
        joint.push(e.instance.clone());
        match log_data.fit(&joint, DataPart::Seen) {
            Some(fitted) => best.or(fitted.seen_square, e.instance.candidate.effect),
            None => best,
        }
    })
}

/// Σ e² with a set of effects.
fn square(log_data: &PreparedLog, set: &Effects) -> Option<f64> {
    Some(log_data.seen_square(&log_data.pass(set, &[])?))
}

/// A true effect as a hypothesis with its values; `None` for an entry of noise.
fn instance(effect: &Effect) -> Option<Instance> {
    let info = effects::find_of_log(effect.name()).filter(|info| info.enters != Enters::Noise)?;
    let of = |kind: ParameterKind| info.parameters.iter().find(|p| p.kind == kind).and_then(|p| effect.get(p.name));
    let sizes = info.parameters.iter().filter(|p| p.kind == ParameterKind::Size);
    let candidate = Candidate {
        effect: info.name,
        member: of(ParameterKind::Fin)
            .and_then(effects::fin_index)
            .or_else(|| of(ParameterKind::Transponder).map(|number| number as usize)),
        span: of(ParameterKind::Onset)
            .map(|onset_s| Span { onset_s, end_s: of(ParameterKind::End).filter(|end_s| *end_s > 0.0) }),
    };
    Some(Instance { candidate, sizes: sizes.map(|p| effect.get(p.name).unwrap_or(0.0)).collect() })
}

/// What was declared, with the entries injected.
pub fn truth(vehicle: &VehicleFile, injected: &[Effect]) -> Effects {
    injected.iter().fold(Effects::from(vehicle.effects.set), |set, effect| {
        let Some(info) = effects::find_of_log(effect.name()) else { return set };
        let values: Vec<f64> = info.parameters.iter().map(|p| effect.get(p.name).unwrap_or(0.0)).collect();
        set.with(info.name, &values).unwrap_or(set)
    })
}

/// Seven significant digits: a line is half as long.
pub fn digits(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}
