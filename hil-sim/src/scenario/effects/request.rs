//! Effects as they are asked for: by name, with or without numbers, or by chance.

use super::{Effect, EffectKind, all, find, unknown};
use crate::rng::{Source, Stream};

/// An effect asked for.
#[derive(Clone, Debug)]
pub enum Request {
    /// This one; what has no number draws one.
    Named {
        /// The effect.
        kind: &'static EffectKind,
        /// Numbers given, by place.
        given: Vec<Option<f64>>,
    },
    /// Any entry of the catalogue.
    Random,
    /// Anything that is not in the catalogue, faults apart.
    RandomOutside,
}

impl Request {
    /// Reads `NAME`, `NAME:parameter=value,…`, `random` or `random-outside`.
    ///
    /// A name alone draws all its numbers; where some are given, of the others those that may be left out are zero
    /// and only the rest is drawn (a time, a fin).
    ///
    /// # Errors
    /// In one line: an unknown name, a number out of its range.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "random" => return Ok(Self::Random),
            "random-outside" => return Ok(Self::RandomOutside),
            _ => {}
        }
        let (name, numbers) = text.split_once(':').map_or((text, None), |(name, numbers)| (name, Some(numbers)));
        let kind = find(name).ok_or_else(|| unknown(name))?;
        let mut given = vec![None; kind.parameters.len()];
        for pair in numbers.into_iter().flat_map(|numbers| numbers.split(',')) {
            let (key, value) = pair.split_once('=').ok_or_else(|| format!("{pair}: parameter=value is needed"))?;
            let place = kind.parameter(key).ok_or_else(|| kind.unknown_parameter(key))?;
            let value = kind.parameters[place].parse(value).map_err(|error| format!("{name}.{key}: {error}"))?;
            given[place] = Some(value);
        }
        kind.check_times(&given)?;
        if numbers.is_some() {
            for (given, parameter) in given.iter_mut().zip(kind.parameters) {
                if given.is_none() && parameter.optional {
                    *given = Some(0.0);
                }
            }
        }
        Ok(Self::Named { kind, given })
    }

    /// An effect by name that draws all its numbers.
    ///
    /// # Errors
    /// If no effect has that name.
    pub fn named(name: &str) -> Result<Self, String> {
        let kind = find(name).ok_or_else(|| unknown(name))?;
        Ok(Self::Named { kind, given: vec![None; kind.parameters.len()] })
    }

    /// The effects asked for, their open numbers drawn by the seed. Two requests for chance get different effects.
    #[must_use]
    pub fn resolve(requests: &[Self], seed: u64, duration_s: f64) -> Vec<Effect> {
        let mut random = Stream::new(seed, Source::Effects);
        let named = |request: &Self| match request {
            Self::Named { kind, .. } => Some(kind.name),
            _ => None,
        };
        let mut taken: Vec<&str> = requests.iter().filter_map(named).collect();
        let mut effects = Vec::new();
        for request in requests {
            let effect = match request {
                Self::Named { kind, given } => Effect::drawn(kind, given, &mut random, duration_s),
                Self::Random | Self::RandomOutside => {
                    let catalogue = matches!(request, Self::Random);
                    let open: Vec<_> = all()
                        .filter(|k| k.catalogue == catalogue && !k.by_name_only && !taken.contains(&k.name))
                        .collect();
                    let Some(kind) = open.get((open.len() as f64 * random.uniform()) as usize) else { continue };
                    taken.push(kind.name);
                    Effect::drawn(kind, &vec![None; kind.parameters.len()], &mut random, duration_s)
                }
            };
            effects.push(effect);
        }
        effects
    }
}
