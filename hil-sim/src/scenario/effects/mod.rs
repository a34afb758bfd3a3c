//! `[effects]`: what the simulated world does that the declared vehicle does not.
//!
//! One table ([`all`]) holds every effect by name: the entries of the project's catalogue with its parameters and
//! signs (biases measured minus true, ratios measured / true − 1), and others that are in no catalogue, so that a
//! diagnosis can be tried on causes it cannot know. Each entry states what it changes in the simulated [`Physics`];
//! nothing of it comes from the backseat's code. To add one: add it to a table and let [`Physics`] have it.

mod analysed;
mod catalogue;
mod draw;
mod faults;
mod outside;
mod physics;
mod read;
mod request;

pub use draw::Draw;
pub use physics::{AcousticChannel, Compass, Instruments, Physics, Waves};
pub use request::Request;

use std::fmt;

/// Names of the fins; the value of a parameter `fin` counts from 1 in this order.
pub const FIN_NAMES: [&str; 4] = ["top", "bottom", "port", "starboard"];

/// What an effect is.
pub struct EffectKind {
    /// Name in files and on the command line.
    pub name: &'static str,
    /// It is an entry of the catalogue; else it is outside of it.
    pub catalogue: bool,
    /// Asked for by name only, never drawn: faults, and what only the analysis of a log has.
    pub by_name_only: bool,
    /// What happens.
    pub about: &'static str,
    /// What quantifies it.
    pub parameters: &'static [ParameterKind],
    /// Changes the world; the values are in the order of `parameters`.
    apply: fn(&mut Physics, &[f64]),
}

/// One parameter of an effect.
#[derive(Debug)]
pub struct ParameterKind {
    /// Name; ends in the unit.
    pub name: &'static str,
    /// Smallest and largest value that is accepted.
    pub range: [f64; 2],
    /// May be left out, and is then zero.
    pub optional: bool,
    /// Where a value comes from when none is given.
    pub draw: Draw,
}

/// Every effect: those of the catalogue, those outside of it, faults, those of the analysis alone; each in the order in
/// which they apply.
pub fn all() -> impl Iterator<Item = &'static EffectKind> {
    catalogue::ENTRIES.iter().chain(outside::ENTRIES).chain(faults::ENTRIES).chain(analysed::ENTRIES)
}

/// The effect of that name.
#[must_use]
pub fn find(name: &str) -> Option<&'static EffectKind> {
    all().find(|kind| kind.name == name)
}

impl fmt::Debug for EffectKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl EffectKind {
    /// Place of a parameter.
    fn parameter(&self, name: &str) -> Option<usize> {
        self.parameters.iter().position(|parameter| parameter.name == name)
    }
}

impl EffectKind {
    /// Of numbers given, by place: an event ends after it begins, or not at all.
    fn check_times(&self, given: &[Option<f64>]) -> Result<(), String> {
        let number = |name: &str| self.parameter(name).and_then(|place| given[place]);
        match (number("time_s"), number("until_s")) {
            (Some(time_s), Some(until_s)) if until_s != 0.0 && until_s <= time_s => {
                Err(format!("{}.until_s: {until_s} s is not after time_s: {time_s} s", self.name))
            }
            _ => Ok(()),
        }
    }
}

impl ParameterKind {
    /// It names a fin.
    pub fn is_fin(&self) -> bool {
        self.draw == Draw::Fin
    }

    /// The value as it is written.
    pub fn text(&self, value: f64) -> String {
        if self.is_fin() { FIN_NAMES[value as usize - 1].to_owned() } else { value.to_string() }
    }

    /// Reads what [`ParameterKind::text`] writes.
    fn parse(&self, text: &str) -> Result<f64, String> {
        if self.is_fin() {
            let place = FIN_NAMES.iter().position(|name| *name == text);
            return place.map(|place| (place + 1) as f64).ok_or_else(|| format!("{text}: {}", FIN_NAMES.join(", ")));
        }
        self.check(text.parse().map_err(|_| format!("{text} is not a number"))?)
    }

    fn check(&self, value: f64) -> Result<f64, String> {
        let [min, max] = self.range;
        if (min..=max).contains(&value) { Ok(value) } else { Err(format!("{value} is outside {min} to {max}")) }
    }
}

/// An effect with its numbers.
#[derive(Clone, Debug)]
pub struct Effect {
    kind: &'static EffectKind,
    values: Vec<f64>,
}

impl PartialEq for Effect {
    fn eq(&self, other: &Self) -> bool {
        self.kind.name == other.kind.name && self.values == other.values
    }
}

impl Effect {
    /// An effect by name and numbers; what is left out and may be is zero.
    ///
    /// # Errors
    /// In one line: an unknown name, a number missing or out of its range.
    pub fn new(name: &str, values: &[(&str, f64)]) -> Result<Self, String> {
        let kind = find(name).ok_or_else(|| unknown(name))?;
        let mut given = vec![None; kind.parameters.len()];
        for &(parameter, value) in values {
            let place = kind.parameter(parameter).ok_or_else(|| kind.unknown_parameter(parameter))?;
            let checked =
                kind.parameters[place].check(value).map_err(|error| format!("{name}.{parameter}: {error}"))?;
            given[place] = Some(checked);
        }
        Self::complete(kind, &given)
    }

    /// What is left out is zero where it may be left out.
    fn complete(kind: &'static EffectKind, given: &[Option<f64>]) -> Result<Self, String> {
        kind.check_times(given)?;
        let values = kind.parameters.iter().zip(given).map(|(parameter, value)| {
            let missing = || format!("{}: {} is missing", kind.name, parameter.name);
            value.or(parameter.optional.then_some(0.0)).ok_or_else(missing)
        });
        Ok(Self { kind, values: values.collect::<Result<_, _>>()? })
    }

    /// What it is.
    pub fn kind(&self) -> &'static EffectKind {
        self.kind
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        self.kind.name
    }

    /// A number by its name.
    pub fn get(&self, parameter: &str) -> Option<f64> {
        self.kind.parameter(parameter).map(|place| self.values[place])
    }

    /// Its parameters in order, with their numbers.
    pub fn parameters(&self) -> impl Iterator<Item = (&'static ParameterKind, f64)> + '_ {
        self.kind.parameters.iter().zip(self.values.iter().copied())
    }
}

impl fmt::Display for Effect {
    /// As on the command line: `name:parameter=value,…`; an end that does not come is left out.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let numbers: Vec<String> = self
            .parameters()
            .filter(|(parameter, value)| parameter.draw != Draw::Never || *value != 0.0)
            .map(|(parameter, value)| format!("{}={}", parameter.name, parameter.text(value)))
            .collect();
        write!(f, "{}:{}", self.kind.name, numbers.join(","))
    }
}

/// `[effects]`: any number of effects.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Effects(Vec<Effect>);

impl Effects {
    /// Adds an effect; some can be there more than once (two fins).
    pub fn push(&mut self, effect: Effect) {
        self.0.push(effect);
    }

    /// The effects in the order in which they were given.
    pub fn as_slice(&self) -> &[Effect] {
        &self.0
    }

    /// Changes the world, in the order of [`all`].
    pub(super) fn apply(&self, physics: &mut Physics) {
        for kind in all() {
            for effect in self.0.iter().filter(|effect| effect.kind.name == kind.name) {
                (kind.apply)(physics, &effect.values);
            }
        }
    }
}

impl FromIterator<Effect> for Effects {
    fn from_iter<I: IntoIterator<Item = Effect>>(effects: I) -> Self {
        Self(effects.into_iter().collect())
    }
}

impl EffectKind {
    fn unknown_parameter(&self, name: &str) -> String {
        let names: Vec<_> = self.parameters.iter().map(|parameter| parameter.name).collect();
        format!("{} has no {name}; it has {}", self.name, names.join(", "))
    }
}

fn unknown(name: &str) -> String {
    let names: Vec<_> = all().map(|kind| kind.name).collect();
    format!("no effect {name}; there are {}", names.join(", "))
}
