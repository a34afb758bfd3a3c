//! The log that belongs to a seed: class, effects, manoeuvres, noise, how its inputs move.

use backseat_core::effects::{CATALOGUE, EffectInfo, LOG_CATALOGUE, ParameterKind};
use backseat_logs::VehicleFile;
use hil_sim::dataset::{Shape, Spec};
use hil_sim::noise::NoiseKind;
use hil_sim::rng::{Source, Stream};
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
const OF_LOGS: [&str; 16] = [
    "thrust_change",
    "current_change",
    "heading_change",
    "buoyancy_change",
    "pitch_change",
    "dvl_change",
    "clock_change",
    "fin_bias_change",
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
    let mut random = Stream::new(seed, Source::Study);
    spec.ramps = random.uniform() < 0.5;
    let ending = Ending::drawn(&mut random);
    let (names, round) = match class {
        Class::Single => single(index),
        Class::Pair => several(index, 2),
        Class::Triple => several(index, 3),
        Class::None => (Vec::new(), index),
        Class::Outside => (Vec::new(), index),
    };
    spec.effects = match class {
        Class::Outside => vec![Request::RandomOutside],
        _ => names.iter().filter_map(|name| request(name, &ending, spec.duration_s).ok()).collect(),
    };
    let has = |wanted: &[&str]| names.iter().any(|name| wanted.contains(name));
    spec.shape = if round.is_multiple_of(2) { Shape::Excite } else { Shape::Lawnmower };
    spec.noise = if (round / 2) % 4 == 3 { NoiseKind::White } else { NoiseKind::Mixed };
    // Effects that only a DVL or a CTD shows are injected where there is one.
    spec.dvl =
        has(&["dvl_scale", "dvl_misalignment", "dvl_delay", "dvl_lever_arm", "waves"]) || (round / 4).is_multiple_of(2);
    spec.ctd = has(&["water_density"]);
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

/// When the events of a log begin and end, if they do: half of them, after a sixth to a half of the log.
struct Ending {
    ends: bool,
    /// Shares of the log.
    onset: f64,
    lasts: f64,
}

impl Ending {
    fn drawn(random: &mut Stream) -> Self {
        let ends = random.uniform() >= 0.5;
        Self { ends, onset: 0.15 + 0.35 * random.uniform(), lasts: (1.0 + 2.0 * random.uniform()) / 6.0 }
    }
}

/// The entry with all its numbers drawn.
fn request(name: &str, ending: &Ending, duration_s: f64) -> Result<Request, String> {
    let is_event = entries().any(|e| e.name == name && e.parameters.iter().any(|p| p.kind == ParameterKind::End));
    if !is_event || !ending.ends {
        return Request::named(name);
    }
    let onset_s = duration_s * ending.onset;
    let end_s = onset_s + duration_s * ending.lasts;
    Request::parse(&format!("{name}:time_s={onset_s:.1},until_s={end_s:.1}"))
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
