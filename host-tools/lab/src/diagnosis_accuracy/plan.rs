//! The log that belongs to a seed: class, effects, manoeuvres, noise, how its inputs move.

use backseat_core::effects::{CATALOGUE, EffectInfo, LOG_CATALOGUE, ParameterKind};
use backseat_logs::VehicleFile;
use hil_sim::dataset::{Shape, Spec};
use hil_sim::noise::NoiseKind;
use hil_sim::scenario::Request;
use serde::{Deserialize, Serialize};

/// The kind of effects that a run injects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Class {
    /// One entry of the catalogue.
    Single,
    /// Two of them.
    Pair,
    /// Three.
    Triple,
    /// Nothing.
    #[value(alias = "clean")]
    None,
    /// An effect outside the catalogue.
    Outside,
}

/// Of twenty seeds in a row: eight single effects, three pairs, two triples, four with nothing, three out of catalogue.
const ORDER: [Class; 20] = {
    use Class::{None as N, Outside as O, Pair as P, Single as S, Triple as T};
    [S, N, S, P, S, O, T, N, S, P, S, N, S, O, S, T, S, N, O, P]
};
/// Entries that only the analysis of a log has, and that the model of the vehicle's dynamics tests.
const OF_LOGS: [&str; 8] = [
    "heading_lag",
    "dvl_delay",
    "dvl_lever_arm",
    "soft_iron",
    "depth_scale",
    "propeller_torque",
    "gnss_lever_arm",
    "transducer_lever_arm",
];

/// Every entry that is injected.
pub fn entries() -> impl Iterator<Item = &'static EffectInfo> {
    CATALOGUE.iter().chain(LOG_CATALOGUE.iter().filter(|info| OF_LOGS.contains(&info.name)))
}

/// The class of a seed.
pub fn class_of(seed: u64) -> Class {
    ORDER[(seed % ORDER.len() as u64) as usize]
}

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
        Class::Pair => several(index, 2),
        Class::Triple => several(index, 3),
        Class::None => (Vec::new(), index),
        Class::Outside => (Vec::new(), index),
    };
    spec.effects = match class {
        Class::Outside => vec![Request::RandomOutside],
        _ => names.iter().filter_map(|name| request(name, seed, spec.duration_s).ok()).collect(),
    };
    let has = |wanted: &[&str]| names.iter().any(|name| wanted.contains(name));
    spec.shape = if round.is_multiple_of(2) { Shape::Excite } else { Shape::Lawnmower };
    spec.noise = if (round / 2).is_multiple_of(2) { NoiseKind::Coloured } else { NoiseKind::White };
    // Effects that only a DVL or a CTD shows are injected where there is one.
    spec.dvl =
        has(&["dvl_scale", "dvl_misalignment", "dvl_delay", "dvl_lever_arm", "waves"]) || (round / 4).is_multiple_of(2);
    spec.ctd = has(&["water_density"]);
    spec.ramps = drawn(seed, 0) < 0.5;
    (class, spec)
}

/// The effect of a run, and how often it was flown before, counted from its place in the catalogue: so the effects of
/// one round differ in manoeuvres and noise.
fn single(index: u64) -> (Vec<&'static str>, u64) {
    let all: Vec<&EffectInfo> = entries().collect();
    let count = all.len() as u64;
    let entry = index % count;
    (vec![all[entry as usize].name], index / count + entry)
}

/// Two or three entries of those that every log can judge; the distance between them changes from one round to the next.
fn several(index: u64, how_many: u64) -> (Vec<&'static str>, u64) {
    let open: Vec<&EffectInfo> = entries().filter(|info| info.name != "depth_bias").collect();
    let count = open.len() as u64;
    let (round, first) = (index / count, index % count);
    let apart = 1 + (7 * round + 4) % (count / how_many);
    ((0..how_many).map(|k| open[((first + k * apart) % count) as usize].name).collect(), round + first)
}

/// The entry with all its numbers drawn. Half of the events end: after a sixth to a half of the log.
fn request(name: &str, seed: u64, duration_s: f64) -> Result<Request, String> {
    let is_event = entries().any(|e| e.name == name && e.parameters.iter().any(|p| p.kind == ParameterKind::End));
    if !is_event || drawn(seed, 1) < 0.5 {
        return Request::named(name);
    }
    let onset_s = duration_s * (0.15 + 0.35 * drawn(seed, 2));
    let end_s = onset_s + duration_s * (1.0 / 6.0 + drawn(seed, 3) / 3.0);
    Request::parse(&format!("{name}:time_s={onset_s:.1},until_s={end_s:.1}"))
}

/// A number between 0 and 1 for one purpose of a seed.
fn drawn(seed: u64, purpose: u64) -> f64 {
    // the finaliser of splitmix64
    let mut x = seed.wrapping_mul(8).wrapping_add(purpose).wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is injected is compared with what is found by name: a number of another name would count as zero.
    #[test]
    fn every_number_of_an_entry_is_injected_under_its_name() {
        for info in entries() {
            let effect = &Request::resolve(&[Request::named(info.name).unwrap()], 1, 1800.0)[0];
            for parameter in info.parameters {
                assert!(effect.get(parameter.name).is_some(), "{} {}", info.name, parameter.name);
            }
        }
    }
}
