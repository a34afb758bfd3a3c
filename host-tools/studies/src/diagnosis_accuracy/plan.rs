//! The log that belongs to a seed: class, effects, manoeuvres, noise.

use backseat_core::effects::{CATALOGUE, EffectInfo};
use backseat_data::VehicleFile;
use hil_sim::dataset::{Shape, Spec};
use hil_sim::noise::NoiseKind;
use hil_sim::scenario::Request;
use serde::{Deserialize, Serialize};

/// The kind of effects that a run injects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Class {
    /// One entry of the catalogue.
    Single,
    /// Two of them.
    Pair,
    /// Nothing.
    None,
    /// An effect outside the catalogue.
    Outside,
}

/// Of twenty seeds in a row: ten single effects, four pairs, four with nothing, two out of catalogue.
const ORDER: [Class; 20] = {
    use Class::{None as N, Outside as O, Pair as P, Single as S};
    [S, N, S, P, S, O, S, N, S, P, S, N, S, P, S, O, S, N, S, P]
};

/// The class and the log of a seed.
///
/// Runs of a class go through its effects in turn, and those of an effect through manoeuvres, noise and DVL, so that
/// any number of runs is balanced.
pub fn of(seed: u64) -> (Class, Spec) {
    let (turn, place) = (seed / ORDER.len() as u64, (seed % ORDER.len() as u64) as usize);
    let class = ORDER[place];
    let of_class = |places: &[Class]| places.iter().filter(|other| **other == class).count() as u64;
    let index = turn * of_class(&ORDER) + of_class(&ORDER[..place]);
    let mut spec = Spec::new(VehicleFile::reference());
    let (names, round) = match class {
        Class::Single => single(index),
        Class::Pair => pair(index),
        Class::None => (Vec::new(), index),
        Class::Outside => (Vec::new(), index),
    };
    spec.effects = match class {
        Class::Outside => vec![Request::RandomOutside],
        _ => names.iter().filter_map(|name| Request::named(name).ok()).collect(),
    };
    let has = |wanted: &[&str]| names.iter().any(|name| wanted.contains(name));
    spec.shape = if round.is_multiple_of(2) { Shape::Excite } else { Shape::Lawnmower };
    spec.noise = if (round / 2).is_multiple_of(2) { NoiseKind::Coloured } else { NoiseKind::White };
    // Effects that only a DVL or a CTD shows are injected where there is one.
    spec.dvl = has(&["dvl_scale", "dvl_misalignment", "waves"]) || (round / 4).is_multiple_of(2);
    spec.ctd = has(&["water_density"]);
    (class, spec)
}

/// The effect of a run, and how often it was flown before, counted from its place in the catalogue: so the effects of
/// one round differ in manoeuvres and noise.
fn single(index: u64) -> (Vec<&'static str>, u64) {
    let count = CATALOGUE.len() as u64;
    let entry = index % count;
    (vec![CATALOGUE[entry as usize].name], index / count + entry)
}

/// Two entries of those that every log can judge; the distance between them changes from one round to the next.
fn pair(index: u64) -> (Vec<&'static str>, u64) {
    let open: Vec<&EffectInfo> = CATALOGUE.iter().filter(|info| info.name != "depth_bias").collect();
    let count = open.len() as u64;
    let (round, first) = (index / count, index % count);
    let second = (first + 1 + (7 * round + 4) % (count - 1)) % count;
    (vec![open[first as usize].name, open[second as usize].name], round + first)
}
