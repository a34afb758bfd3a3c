//! Separability of a true effect, computed from the same log without noise.

use backseat_core::effects::{self, Enters, ParameterKind};
use backseat_data::VehicleFile;
use backseat_diagnose::candidates::{Candidate, Instance, Span};
use backseat_diagnose::log_effects::Effects;
use backseat_diagnose::prepared_log::{DataPart, PreparedLog};
use backseat_diagnose::search;
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
    let alternatives: Vec<_> =
        round.ladder.iter().filter(|e| e.instance.candidate.effect != own && e.gain > 0.0).collect();
    let top = alternatives.iter().map(|e| e.gain).fold(0.0, f64::max);
    let close = alternatives.into_iter().filter(|e| e.gain > top - SHORT.0 - SHORT.1 * top).take(COMPETITORS);
    let fitted = close.filter_map(|e| {
        let mut joint = others.clone();
        joint.push(e.instance.clone());
        let fitted = log_data.fit(&joint, DataPart::Whole)?;
        Some((fitted.whole_square, e.instance.candidate.effect))
    });
    let (best, competitor) = fitted.fold((without, "none"), |best, next| if next.0 < best.0 { next } else { best });
    Some(Separability {
        effect: own.to_owned(),
        value: digits((best - declared_square).max(0.0).sqrt()),
        competitor: competitor.to_owned(),
    })
}

/// Σ e² with a set of effects.
fn square(log_data: &PreparedLog, set: &Effects) -> Option<f64> {
    Some(log_data.pass(set, &[])?.normal.sum(|_| true).square)
}

/// A true effect as a hypothesis with its values; `None` for an entry of noise.
fn instance(effect: &Effect) -> Option<Instance> {
    let info = effects::find_of_log(effect.name()).filter(|info| info.enters != Enters::Noise)?;
    let of = |kind: ParameterKind| info.parameters.iter().find(|p| p.kind == kind).and_then(|p| effect.get(p.name));
    let sizes = info.parameters.iter().filter(|p| p.kind == ParameterKind::Size);
    let candidate = Candidate {
        effect: info.name,
        fin: of(ParameterKind::Fin).and_then(effects::fin_index),
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
