//! Which effects are present, and how large they are.

use super::{CATALOGUE, EffectInfo, ParameterInfo};
use core::fmt;

/// Number of parameters of the whole catalogue.
pub const PARAMETERS: usize = OFFSETS[CATALOGUE.len()];

/// Where each entry's first parameter stands among all.
const OFFSETS: [usize; CATALOGUE.len() + 1] = {
    let mut offsets = [0; CATALOGUE.len() + 1];
    let mut i = 0;
    while i < CATALOGUE.len() {
        offsets[i + 1] = offsets[i] + CATALOGUE[i].parameters.len();
        i += 1;
    }
    offsets
};

/// The first parameter of all.
const FIRST: &ParameterInfo = &CATALOGUE[0].parameters[0];

/// One parameter of one entry of the catalogue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParameterId {
    effect: u8,
    parameter: u8,
}

impl ParameterId {
    /// By names, e.g. `water_current`, `north_mps`.
    #[must_use]
    pub fn find(effect: &str, parameter: &str) -> Option<Self> {
        parameters().find(|id| id.effect().name == effect && id.info().name == parameter)
    }

    /// By its place among all parameters of the catalogue; the last one beyond.
    #[must_use]
    pub const fn at(place: usize) -> Self {
        let mut effect = 0;
        while effect + 1 < CATALOGUE.len() && OFFSETS[effect + 1] <= place {
            effect += 1;
        }
        let parameter = place - OFFSETS[effect];
        let last = CATALOGUE[effect].parameters.len() - 1;
        Self { effect: effect as u8, parameter: if parameter < last { parameter } else { last } as u8 }
    }

    /// The entry it belongs to.
    #[must_use]
    pub const fn effect(self) -> &'static EffectInfo {
        let last = CATALOGUE.len() - 1;
        &CATALOGUE[if (self.effect as usize) < last { self.effect as usize } else { last }]
    }

    /// What it is.
    #[must_use]
    pub const fn info(self) -> &'static ParameterInfo {
        let parameters = self.effect().parameters;
        if (self.parameter as usize) < parameters.len() { &parameters[self.parameter as usize] } else { FIRST }
    }

    /// Place of its entry in the catalogue.
    #[must_use]
    pub fn effect_index(self) -> usize {
        usize::from(self.effect)
    }

    /// Place in its entry.
    #[must_use]
    pub fn index(self) -> usize {
        usize::from(self.parameter)
    }

    /// Place among all parameters of the catalogue.
    #[must_use]
    pub fn place(self) -> usize {
        OFFSETS.get(usize::from(self.effect)).copied().unwrap_or(0) + usize::from(self.parameter)
    }
}

/// Every parameter of the catalogue, in its order.
pub fn parameters() -> impl Iterator<Item = ParameterId> {
    CATALOGUE.iter().zip(0..).flat_map(|(info, effect)| {
        (0..info.parameters.len()).map(move |parameter| ParameterId { effect, parameter: parameter as u8 })
    })
}

/// Why a set was refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EffectError {
    /// There is no such effect, or it has no such parameter.
    Unknown,
    /// The value is not plausible.
    OutOfRange {
        /// The effect.
        effect: &'static str,
        /// Its parameter.
        parameter: &'static str,
        /// Smallest plausible value.
        min: f64,
        /// Largest plausible value.
        max: f64,
    },
}

impl fmt::Display for EffectError {
    /// Names only: formatting of floats is left to the host.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => f.write_str("no such effect or parameter"),
            Self::OutOfRange { effect, parameter, .. } => write!(f, "{effect}.{parameter} is outside its range"),
        }
    }
}

impl core::error::Error for EffectError {}

/// The value of every parameter of the catalogue; all zero is the declared model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectSet {
    values: [f64; PARAMETERS],
}

impl Default for EffectSet {
    fn default() -> Self {
        Self::NONE
    }
}

impl EffectSet {
    /// The declared model.
    pub const NONE: Self = Self { values: [0.0; PARAMETERS] };

    /// Whether no effect is present.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.values.iter().all(|value| *value == 0.0)
    }

    /// The entries present: their place in the catalogue, what they are, their values.
    pub fn active(&self) -> impl Iterator<Item = (usize, &'static EffectInfo, &[f64])> {
        let all = CATALOGUE.iter().enumerate().map(|(i, info)| (i, info, self.values(i)));
        all.filter(|(_, _, values)| values.iter().any(|value| *value != 0.0))
    }

    /// The values of the entry at `index` of the catalogue.
    #[must_use]
    pub fn values(&self, index: usize) -> &[f64] {
        match (OFFSETS.get(index), OFFSETS.get(index + 1)) {
            (Some(&from), Some(&to)) => self.values.get(from..to).unwrap_or_default(),
            _ => &[],
        }
    }

    /// One value.
    #[must_use]
    pub fn get(&self, id: ParameterId) -> f64 {
        self.values.get(id.place()).copied().unwrap_or(0.0)
    }

    /// Sets one value, plausible or not: see [`EffectSet::validate`].
    pub fn set(&mut self, id: ParameterId, value: f64) {
        if let Some(place) = self.values.get_mut(id.place()) {
            *place = value;
        }
    }

    /// This set with all values of one entry, in the order of its parameters, plausible or not.
    ///
    /// # Errors
    /// [`EffectError::Unknown`]: no such entry, or another number of parameters.
    pub fn with(mut self, effect: &str, values: &[f64]) -> Result<Self, EffectError> {
        let index = CATALOGUE.iter().position(|info| info.name == effect).ok_or(EffectError::Unknown)?;
        let (from, to) = (OFFSETS[index], OFFSETS[index + 1]);
        match self.values.get_mut(from..to) {
            Some(places) if places.len() == values.len() => {
                for (place, value) in places.iter_mut().zip(values) {
                    *place = *value;
                }
                Ok(self)
            }
            _ => Err(EffectError::Unknown),
        }
    }

    /// Checks every value; a set of its entry's that is all zero is no effect and always right.
    ///
    /// # Errors
    /// The first value that is not plausible.
    pub fn validate(&self) -> Result<(), EffectError> {
        let mut all = parameters().map(|id| (id, self.get(id)));
        match all.find(|(id, value)| !id.info().admits(*value)) {
            None => Ok(()),
            Some((id, _)) => {
                let (effect, ParameterInfo { name, min, max, .. }) = (id.effect().name, *id.info());
                Err(EffectError::OutOfRange { effect, parameter: name, min, max })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::ParameterKind;

    #[test]
    fn every_parameter_is_found_set_and_read_by_itself() {
        assert_eq!(parameters().count(), PARAMETERS);
        for id in parameters() {
            assert_eq!(ParameterId::find(id.effect().name, id.info().name), Some(id));
            assert_eq!(ParameterId::at(id.place()), id);
            let mut set = EffectSet::NONE;
            set.set(id, id.info().max);
            assert_eq!(set.get(id), id.info().max);
            assert_eq!(set.values(id.effect_index())[id.index()], id.info().max);
            assert_eq!(parameters().filter(|other| set.get(*other) != 0.0).count(), 1);
            assert!(set.active().map(|(index, ..)| index).eq([id.effect_index()]));
            assert!(set.validate().is_ok());
            let beyond = if id.info().kind == ParameterKind::Fin { 2.5 } else { 1.001 * id.info().max };
            set.set(id, beyond);
            assert!(set.validate().is_err(), "{}.{}", id.effect().name, id.info().name);
        }
        assert_eq!(ParameterId::find("water_current", "up_mps"), None);
    }

    #[test]
    fn by_name_all_values_or_none() {
        let set = EffectSet::NONE.with("water_current", &[0.1, -0.2]).unwrap();
        assert!(!set.is_empty() && EffectSet::NONE.is_empty());
        assert_eq!(set.active().next().map(|(_, info, values)| (info.name, values[1])), Some(("water_current", -0.2)));
        assert_eq!(set.with("water_current", &[0.1]), Err(EffectError::Unknown));
        assert_eq!(set.with("none", &[]), Err(EffectError::Unknown));
        let wrong = set.with("dvl_scale", &[f64::NAN]).unwrap().validate();
        assert!(matches!(wrong, Err(EffectError::OutOfRange { effect: "dvl_scale", parameter: "ratio", .. })));
    }
}
