//! Effects whose size the filter estimates.

use super::ConfigError;
use super::layout::MAX_EFFECTS;
use crate::effects::ParameterId;

/// One parameter of an effect as a state: a random walk that starts at its value in the effect set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectState {
    /// Which.
    pub parameter: ParameterId,
    /// One sigma at initialisation, in the parameter's unit.
    pub initial_sigma: f64,
    /// √PSD of the random walk, in the parameter's unit per √s.
    pub random_walk_per_sqrt_s: f64,
}

/// The effect states, in the order of the catalogue.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EffectStates {
    states: [Option<EffectState>; MAX_EFFECTS],
}

impl EffectStates {
    /// None.
    pub const NONE: Self = Self { states: [None; MAX_EFFECTS] };

    /// `water_current` as two states: steady but for `random_walk_mps_per_sqrt_s`, by which a tide turns.
    #[must_use]
    pub fn water_current(initial_sigma_mps: f64, random_walk_mps_per_sqrt_s: f64) -> Self {
        let with = |states: Self, axis| {
            states.with("water_current", axis, initial_sigma_mps, random_walk_mps_per_sqrt_s).unwrap_or(states)
        };
        with(with(Self::NONE, "north_mps"), "east_mps")
    }

    /// These and one more.
    ///
    /// # Errors
    /// [`ConfigError::NotAState`] if there is no such parameter, the filter cannot estimate it or does already;
    /// [`ConfigError::TooManyEffectStates`].
    pub fn with(
        self,
        effect: &'static str,
        parameter: &'static str,
        initial_sigma: f64,
        random_walk_per_sqrt_s: f64,
    ) -> Result<Self, ConfigError> {
        let refused = ConfigError::NotAState { effect, parameter };
        let id = ParameterId::find(effect, parameter).filter(|id| id.effect().hooks.may_be_state()).ok_or(refused)?;
        if self.iter().any(|state| state.parameter == id) {
            return Err(refused);
        }
        let mut moving = Some(EffectState { parameter: id, initial_sigma, random_walk_per_sqrt_s });
        let mut states = self;
        for place in &mut states.states {
            let behind = |state: EffectState| moving.is_some_and(|m| m.parameter.place() < state.parameter.place());
            if place.is_none_or(behind) {
                core::mem::swap(place, &mut moving);
            }
        }
        if moving.is_some() { Err(ConfigError::TooManyEffectStates) } else { Ok(states) }
    }

    /// How many.
    #[must_use]
    pub fn len(&self) -> usize {
        self.iter().count()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All, in the order in which they stand behind the vehicle's states.
    pub fn iter(&self) -> impl Iterator<Item = &EffectState> {
        self.states.iter().flatten()
    }

    /// North of `water_current`, if it is estimated.
    #[must_use]
    pub fn current(&self) -> Option<&EffectState> {
        self.iter().next().filter(|state| state.parameter.effect().hooks.water.is_some())
    }

    /// The same parameters as states.
    pub(super) fn alike(&self, other: &Self) -> bool {
        self.iter().map(|state| state.parameter).eq(other.iter().map(|state| state.parameter))
    }

    /// A current is estimated whole or not at all.
    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        let axes = self.iter().filter(|state| state.parameter.effect().hooks.water.is_some()).count();
        match self.iter().next() {
            Some(state) if axes == 1 => Err(ConfigError::NotAState {
                effect: state.parameter.effect().name,
                parameter: state.parameter.info().name,
            }),
            _ => Ok(()),
        }
    }
}
