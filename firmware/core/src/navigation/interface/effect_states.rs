//! What the filter estimates beside the vehicle: effects, parameters of the model, trims of the fins, currents that
//! change.

use super::error::ConfigError;
use crate::effects::ParameterId;
use crate::identification::theta::{BETA1, BETA5, D11, M11, NAMES};
use crate::parameters::Priors;

/// Most augmented states.
pub(crate) const MAX_EFFECTS: usize = 20;

/// What an augmented state stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum StateParameter {
    /// A parameter of an effect of the catalogue, in its unit.
    Effect(ParameterId) = 1, // an Option's None is zero
    /// Rate of change of the current, 0 north, 1 east, m/s².
    CurrentRate(u8),
    /// ln of true over declared θ_j, by the index j in θ. The exponential keeps the parameter's sign, and makes errors
    /// of 20 % as linear as errors of 2 %.
    LogFactor(u8),
    /// Both rudders stand off their commands, rad, positive to starboard (0), or both elevators, positive nose up (1).
    FinTrim(u8),
}

/// A log-factor never leaves ± this: a factor of e.
pub(crate) const LARGEST_LOG_FACTOR: f64 = 1.0;

impl StateParameter {
    /// Its place in the order of the states: current, current rates, other effects, factors, trims.
    fn order(self) -> usize {
        match self {
            Self::Effect(id) if id.effect().hooks.water.is_some() => id.place(),
            Self::CurrentRate(axis) => 100 + usize::from(axis),
            Self::Effect(id) => 200 + id.place(),
            Self::LogFactor(j) => 300 + usize::from(j),
            Self::FinTrim(axis) => 400 + usize::from(axis),
        }
    }

    /// Name of the group: the effect, or what the state is.
    #[must_use]
    pub fn group(self) -> &'static str {
        match self {
            Self::Effect(id) => id.effect().name,
            Self::CurrentRate(_) => "current_rate",
            Self::LogFactor(_) => "log_factor",
            Self::FinTrim(_) => "fin_trim",
        }
    }

    /// Name within the group, as in files and reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Effect(id) => id.info().name,
            Self::CurrentRate(axis) => ["north_mps2", "east_mps2"].get(usize::from(axis)).copied().unwrap_or_default(),
            Self::LogFactor(j) => NAMES.get(usize::from(j)).copied().unwrap_or_default(),
            Self::FinTrim(axis) => ["yaw_rad", "pitch_rad"].get(usize::from(axis)).copied().unwrap_or_default(),
        }
    }

    /// Whether only positions and velocities tell of it: the water, what the speed depends on, the compass.
    pub(crate) fn is_told_by_place(self) -> bool {
        match self {
            Self::Effect(id) => id.effect().hooks.water.is_some() || id.effect().name == "heading_bias",
            Self::CurrentRate(_) => true,
            Self::LogFactor(j) => [M11, D11, BETA1, BETA5].contains(&usize::from(j)),
            Self::FinTrim(_) => false,
        }
    }

    /// Whether it belongs to the vehicle and is kept from one dive to the next; the water is another each time.
    #[must_use]
    pub fn is_of_the_vehicle(self) -> bool {
        match self {
            Self::Effect(id) => id.effect().hooks.water.is_none(),
            Self::CurrentRate(_) => false,
            Self::LogFactor(_) | Self::FinTrim(_) => true,
        }
    }
}

/// One parameter as a state: a random walk that starts at its declared value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectState {
    /// Which.
    pub parameter: StateParameter,
    /// One sigma at initialisation, in the parameter's unit.
    pub initial_sigma: f64,
    /// √PSD of the random walk, in the parameter's unit per √s.
    pub random_walk_per_sqrt_s: f64,
}

/// The augmented states, in their order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EffectStates {
    states: [Option<EffectState>; MAX_EFFECTS],
}

/// Rate of change of a tidal current, m/s², and its walk, m/s²/√s. A rotary tide of 0.15 m/s and 12.4 h changes by
/// 1.5e-5 m/s² along each axis, root mean square, and that rate by as much in a quarter of its period.
const TIDE: [f64; 2] = [1.5e-5, 1.0e-7];

/// Walks of buoyancy, kg/√s, and of the angle of b, rad/√s: water that enters at 5 g/s is followed within 0.1 kg, at a
/// third of a metre from the centre within 0.6 degrees. Without them the filter explains the nose of a vehicle that
/// grows heavier by a speed and a current that it does not have.
const BUOYANCY_WALK: f64 = 1.5e-2;
const TRIM_WALK: f64 = 3.0e-3;
/// Most that a steady current walks, m/s/√s: 1 mm/s in three hours. A walk five times larger lets the position stray by
/// 2 m within half an hour.
const STEADY_WALK: f64 = 1.0e-5;

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

    /// What `priors` leave open. Of the parameters of the model these are the ones that an hour of turns and dives
    /// without a DVL shows; the others follow from the covariance of these or hardly matter (m44 to m66, d22 to d55,
    /// beta2, beta4).
    #[must_use]
    pub fn robust(priors: &Priors) -> Self {
        let mut states = if priors.current_mps > 0.0 {
            Self::water_current(priors.current_mps, priors.current_walk_mps_per_sqrt_s)
        } else {
            Self::NONE
        };
        let mut add = |parameter, initial_sigma: f64, random_walk_per_sqrt_s| {
            if initial_sigma > 0.0 {
                let state = EffectState { parameter, initial_sigma, random_walk_per_sqrt_s };
                states = states.with_state(state).unwrap_or(states);
            }
        };
        for axis in [0, 1] {
            add(StateParameter::FinTrim(axis), priors.fin_trim_rad, 0.0);
        }
        let ([m11, m22, m33], [d11, d66], [beta1, beta3, beta5]) = (priors.mass, priors.drag, priors.actuators);
        for (j, sigma) in [
            (M11, m11),
            (M11 + 1, m22),
            (M11 + 2, m33),
            (D11, d11),
            (D11 + 5, d66),
            (BETA1, beta1),
            (BETA1 + 2, beta3),
            (BETA5, beta5),
        ] {
            add(StateParameter::LogFactor(j as u8), sigma, priors.walk_per_sqrt_s);
        }
        for (effect, parameter, sigma, walk) in [
            ("heading_bias", "const_rad", priors.heading_rad, 0.0),
            ("heading_bias", "sin_rad", priors.hard_iron_rad, 0.0),
            ("heading_bias", "cos_rad", priors.hard_iron_rad, 0.0),
            ("buoyancy_offset", "kg", priors.buoyancy_kg, BUOYANCY_WALK),
            ("pitch_trim", "rad", priors.pitch_trim_rad, TRIM_WALK),
            ("fin_lag", "s", priors.fin_lag_s, 0.0),
        ] {
            if let Some(id) = ParameterId::find(effect, parameter) {
                add(StateParameter::Effect(id), sigma, walk);
            }
        }
        states
    }

    /// Lets the current change steadily, if there is one and there is room.
    pub fn add_tide(&mut self) {
        if self.current().is_none() || self.has_current_rate() {
            return;
        }
        let [initial_sigma, random_walk_per_sqrt_s] = TIDE;
        for axis in [0, 1] {
            let parameter = StateParameter::CurrentRate(axis);
            let _full = self.insert(EffectState { parameter, initial_sigma, random_walk_per_sqrt_s });
        }
    }

    /// Steady water, weight and trim: the current walks by 1e-5 m/s/√s at most, buoyancy and trim do not.
    pub fn be_steady(&mut self) {
        for state in self.states.iter_mut().flatten() {
            match state.parameter {
                _ if is_current(state) => {
                    state.random_walk_per_sqrt_s = state.random_walk_per_sqrt_s.min(STEADY_WALK);
                }
                StateParameter::Effect(_) => state.random_walk_per_sqrt_s = 0.0,
                _ => {}
            }
        }
    }

    /// These and one more effect.
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
        self.with_state(EffectState { parameter: StateParameter::Effect(id), initial_sigma, random_walk_per_sqrt_s })
    }

    /// These and one more.
    ///
    /// # Errors
    /// [`ConfigError::NotAState`] if it is estimated already; [`ConfigError::TooManyEffectStates`].
    pub fn with_state(mut self, state: EffectState) -> Result<Self, ConfigError> {
        self.insert(state)?;
        Ok(self)
    }

    /// Adds a state in its place; on an error nothing changes.
    fn insert(&mut self, state: EffectState) -> Result<(), ConfigError> {
        let (effect, parameter) = (state.parameter.group(), state.parameter.name());
        if self.iter().any(|other| other.parameter == state.parameter) {
            return Err(ConfigError::NotAState { effect, parameter });
        }
        if self.states.last().is_none_or(Option::is_some) {
            return Err(ConfigError::TooManyEffectStates);
        }
        let mut moving = Some(state);
        for place in &mut self.states {
            let behind = |state: EffectState| moving.is_some_and(|m| m.parameter.order() < state.parameter.order());
            if place.is_none_or(behind) {
                core::mem::swap(place, &mut moving);
            }
        }
        Ok(())
    }

    /// How many.
    #[must_use]
    pub fn len(&self) -> usize {
        self.iter().count()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.states[0].is_none()
    }

    /// All, in the order in which they stand behind the vehicle's states.
    pub fn iter(&self) -> impl Iterator<Item = &EffectState> {
        self.states.iter().map_while(Option::as_ref)
    }

    /// North of `water_current`, if it is estimated.
    #[must_use]
    pub fn current(&self) -> Option<&EffectState> {
        self.iter().next().filter(|state| is_current(state))
    }

    /// Whether the current's rate of change is estimated.
    pub(crate) fn has_current_rate(&self) -> bool {
        self.iter().any(|state| matches!(state.parameter, StateParameter::CurrentRate(_)))
    }

    /// The effects of the catalogue among them: place behind the vehicle's states, and which.
    pub(crate) fn effects(&self) -> impl Iterator<Item = (usize, ParameterId)> + '_ {
        self.iter().enumerate().filter_map(|(slot, state)| match state.parameter {
            StateParameter::Effect(id) => Some((slot, id)),
            _ => None,
        })
    }

    /// One sigma of a measured heading that biases of the compass leave, rad.
    pub(crate) fn heading_sigma_rad(&self) -> f64 {
        let variance: f64 = self
            .effects()
            .filter(|(_, id)| id.effect().name == "heading_bias")
            .filter_map(|(slot, _)| self.iter().nth(slot))
            .map(|state| state.initial_sigma * state.initial_sigma)
            .sum();
        libm::sqrt(variance)
    }

    /// The same parameters as states.
    pub(crate) fn alike(&self, other: &Self) -> bool {
        self.iter().map(|state| state.parameter).eq(other.iter().map(|state| state.parameter))
    }

    /// A current and its rate are estimated whole or not at all.
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        let rates = self.iter().filter(|state| matches!(state.parameter, StateParameter::CurrentRate(_))).count();
        let axes = self.iter().filter(|state| is_current(state)).count();
        match self.iter().next() {
            Some(state) if axes == 1 || rates == 1 || (rates == 2 && axes == 0) => {
                Err(ConfigError::NotAState { effect: state.parameter.group(), parameter: state.parameter.name() })
            }
            _ => Ok(()),
        }
    }
}

fn is_current(state: &EffectState) -> bool {
    matches!(state.parameter, StateParameter::Effect(id) if id.effect().hooks.water.is_some())
}
