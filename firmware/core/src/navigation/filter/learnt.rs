//! What a dive has learnt of the vehicle, and starting from it.

use super::cekf::Filter;
use crate::effects::ParameterId;
use crate::identification::theta::{BETA1, BETA5, D11, M11};
use crate::navigation::algebra::layout::EFFECTS;
use crate::navigation::interface::effect_states::StateParameter;
use crate::parameters::{HANDLING, Learnt};

/// The parameters of the model among them, by their index in θ.
const FACTORS: [usize; 8] = [M11, M11 + 1, M11 + 2, D11, D11 + 5, BETA1, BETA1 + 2, BETA5];

impl Learnt {
    /// Place of a parameter among those that are kept; `None`: it is of the water.
    #[must_use]
    pub fn place(parameter: StateParameter) -> Option<usize> {
        match parameter {
            StateParameter::LogFactor(j) => FACTORS.iter().position(|factor| *factor == usize::from(j)),
            StateParameter::FinTrim(axis) => Some(FACTORS.len() + usize::from(axis)).filter(|place| *place < 10),
            StateParameter::CurrentRate(_) => None,
            StateParameter::Effect(id) => Self::place_of_effect(id),
        }
    }

    fn place_of_effect(id: ParameterId) -> Option<usize> {
        match (id.effect().name, id.info().name) {
            ("heading_bias", "const_rad") => Some(10),
            ("heading_bias", "sin_rad") => Some(11),
            ("heading_bias", "cos_rad") => Some(12),
            ("buoyancy_offset", _) => Some(13),
            ("pitch_trim", _) => Some(14),
            ("fin_lag", _) => Some(15),
            _ => None,
        }
    }
}

impl Filter {
    /// Starts from what was learnt: call it after `initialise`, before the first prediction. States of which nothing
    /// was learnt keep their priors.
    pub fn start_from(&mut self, learnt: &Learnt) {
        let states = self.config.effect_states;
        let place = |parameter| Learnt::place(parameter).filter(|i| learnt.sigma(*i) > 0.0);
        for (at, state) in (EFFECTS..).zip(states.iter()) {
            let Some(i) = place(state.parameter) else { continue };
            self.x.set_tail(at, &[learnt.mean.get(i).copied().unwrap_or(0.0)]);
            for (other, earlier) in (EFFECTS..=at).zip(states.iter()) {
                if let Some(j) = place(earlier.parameter) {
                    self.p.set(at, other, learnt.correlation(i, j) * learnt.sigma(i) * learnt.sigma(j));
                }
            }
        }
    }

    /// What this dive has learnt, for the next one; `None` if the filter has no state that is kept, or no numbers that
    /// make a covariance. `dives` counts this one.
    #[must_use]
    pub fn learnt(&self, dives: u16) -> Option<Learnt> {
        let states = self.config.effect_states;
        if !self.is_initialised() {
            return None;
        }
        let mut learnt = Learnt { dives, ..Learnt::NONE };
        let variance = |at: usize, prior: f64| {
            let handling = HANDLING * prior;
            self.p.get(at, at) + handling * handling
        };
        for (at, state) in (EFFECTS..).zip(states.iter()) {
            let Some(i) = Learnt::place(state.parameter) else { continue };
            if let (Some(mean), Some(sigma)) = (learnt.mean.get_mut(i), learnt.sigma.get_mut(i)) {
                *mean = self.x.get(at);
                // a walk may have outgrown the prior
                *sigma = libm::sqrt(variance(at, state.initial_sigma)).min(state.initial_sigma);
            }
            for (other, earlier) in (EFFECTS..at).zip(states.iter()) {
                let product = variance(at, state.initial_sigma) * variance(other, earlier.initial_sigma);
                if let Some(j) = Learnt::place(earlier.parameter).filter(|_| product > 0.0) {
                    learnt.set_correlation(i, j, self.p.get(at, other) / libm::sqrt(product));
                }
            }
        }
        let finite = learnt.mean.iter().chain(&learnt.sigma).chain(&learnt.correlation).all(|value| value.is_finite());
        (finite && !learnt.is_none() && learnt.check().is_ok()).then_some(learnt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigation::{EffectStates, Priors};
    use crate::parameters::LEARNT_STATES;

    #[test]
    fn every_state_of_the_vehicle_has_a_place_of_its_own() {
        let mut taken = [false; LEARNT_STATES];
        let mut states = EffectStates::robust(&Priors::DEFAULT);
        states.add_tide();
        for state in states.iter() {
            match Learnt::place(state.parameter) {
                Some(place) => assert!(!core::mem::replace(&mut taken[place], true), "{:?}", state.parameter),
                None => assert!(!state.parameter.is_of_the_vehicle(), "{:?}", state.parameter),
            }
            let place = state.parameter.place().expect("a name");
            assert_eq!(place < LEARNT_STATES, state.parameter.is_of_the_vehicle());
        }
        assert_eq!(taken, [true; LEARNT_STATES]);
    }
}
