//! Reading `[effects.NAME]`, so that an error knows line and key.

use super::{Effect, EffectKind, Effects, ParameterKind, find, unknown};
use serde::de::{Deserialize, DeserializeSeed, Deserializer, Error, MapAccess, Visitor};
use std::fmt;

impl<'de> Deserialize<'de> for Effects {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(TableOfEffects)
    }
}

struct TableOfEffects;

impl<'de> Visitor<'de> for TableOfEffects {
    type Value = Effects;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a table of effects")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Effects, A::Error> {
        let mut effects = Effects::default();
        while let Some(kind) = map.next_key_seed(EffectName)? {
            effects.push(map.next_value_seed(Numbers(kind))?);
        }
        Ok(effects)
    }
}

struct EffectName;

impl<'de> DeserializeSeed<'de> for EffectName {
    type Value = &'static EffectKind;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        let name = String::deserialize(deserializer)?;
        find(&name).ok_or_else(|| D::Error::custom(unknown(&name)))
    }
}

/// The numbers of an effect.
struct Numbers(&'static EffectKind);

impl<'de> DeserializeSeed<'de> for Numbers {
    type Value = Effect;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Effect, D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Numbers {
    type Value = Effect;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the numbers of {}", self.0.name)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Effect, A::Error> {
        let kind = self.0;
        let mut given = vec![None; kind.parameters.len()];
        while let Some(place) = map.next_key_seed(ParameterName(kind))? {
            given[place] = Some(map.next_value_seed(Number(&kind.parameters[place]))?);
        }
        Effect::complete(kind, &given).map_err(A::Error::custom)
    }
}

struct ParameterName(&'static EffectKind);

impl<'de> DeserializeSeed<'de> for ParameterName {
    type Value = usize;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<usize, D::Error> {
        let name = String::deserialize(deserializer)?;
        self.0.parameter(&name).ok_or_else(|| D::Error::custom(self.0.unknown_parameter(&name)))
    }
}

struct Number(&'static ParameterKind);

impl<'de> DeserializeSeed<'de> for Number {
    type Value = f64;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<f64, D::Error> {
        if self.0.is_fin() {
            self.0.parse(&String::deserialize(deserializer)?).map_err(D::Error::custom)
        } else {
            self.0.check(f64::deserialize(deserializer)?).map_err(D::Error::custom)
        }
    }
}
