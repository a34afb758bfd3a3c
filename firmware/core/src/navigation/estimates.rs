//! What the filter has learnt of the vehicle: each estimate with its quality, and all of them as a prior for the next
//! dive.

use super::effect_states::{EffectStates, StateParameter};
use super::filter::Filter;
use super::layout::{EFFECTS, MAX_EFFECTS};

/// An estimate counts as separable once its sigma is below this part of the prior's.
const LEARNT: f64 = 0.5;
/// Beyond this correlation with another estimate, the data know a combination of the two and not the single one.
const CORRELATED: f64 = 0.9;

/// One augmented state as it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateEstimate {
    /// What it is.
    pub parameter: StateParameter,
    /// Its value, in the parameter's unit; declared plus what was found.
    pub value: f64,
    /// One sigma.
    pub sigma: f64,
    /// One sigma at the start.
    pub prior_sigma: f64,
    /// Largest correlation with another augmented state, 0 to 1.
    pub correlation: f64,
}

impl StateEstimate {
    /// Whether the motion so far separates it from its prior and from the other estimates. If not, the filter uses it,
    /// but it must not be reported as a finding.
    #[must_use]
    pub fn is_separable(&self) -> bool {
        self.sigma < LEARNT * self.prior_sigma && self.correlation < CORRELATED
    }
}

/// What one dive has learnt of the vehicle and its compass, as the prior of the next; of the water nothing is kept.
#[derive(Clone, Debug, PartialEq)]
pub struct Posterior {
    states: EffectStates,
    mean: [f64; MAX_EFFECTS],
    /// Entries (i, j) with i ≥ j are used.
    covariance: [[f64; MAX_EFFECTS]; MAX_EFFECTS],
}

impl Posterior {
    /// Of a filter without augmented states.
    pub const NONE: Self =
        Self { states: EffectStates::NONE, mean: [0.0; MAX_EFFECTS], covariance: [[0.0; MAX_EFFECTS]; MAX_EFFECTS] };

    /// Place of a parameter of the vehicle among the states.
    fn place(&self, parameter: StateParameter) -> Option<usize> {
        let found = self.states.iter().position(|state| state.parameter == parameter);
        found.filter(|_| parameter.is_of_the_vehicle())
    }

    fn covariance(&self, i: usize, j: usize) -> f64 {
        self.covariance.get(i.max(j)).and_then(|row| row.get(i.min(j))).copied().unwrap_or(0.0)
    }
}

impl Filter {
    /// The augmented states as they stand; none before the filter is initialised.
    pub fn estimates(&self) -> impl Iterator<Item = StateEstimate> + '_ {
        let count = if self.is_initialised() { self.config.effect_states.len() } else { 0 };
        let variance = |at: usize| self.p.get(at, at);
        (EFFECTS..).zip(self.config.effect_states.iter()).take(count).map(move |(at, state)| {
            let others = (EFFECTS..EFFECTS + count).filter(|other| *other != at);
            let correlation = others.fold(0.0, |most: f64, other| {
                let product = variance(at) * variance(other);
                if product > 0.0 { most.max(self.p.get(at, other).abs() / libm::sqrt(product)) } else { most }
            });
            StateEstimate {
                parameter: state.parameter,
                value: self.x.get(at),
                sigma: libm::sqrt(variance(at)),
                prior_sigma: state.initial_sigma,
                correlation,
            }
        })
    }

    /// What has been learnt, for the next dive.
    pub fn posterior(&self, out: &mut Posterior) {
        *out = Posterior::NONE;
        if !self.is_initialised() {
            return;
        }
        out.states = self.config.effect_states;
        let count = out.states.len();
        for (i, (mean, row)) in out.mean.iter_mut().zip(&mut out.covariance).enumerate().take(count) {
            *mean = self.x.get(EFFECTS + i);
            for (j, covariance) in row.iter_mut().enumerate().take(i + 1) {
                *covariance = self.p.get(EFFECTS + i, EFFECTS + j);
            }
        }
    }

    /// Starts from what an earlier dive has learnt: call it after `initialise`, before the first prediction. States
    /// that the earlier dive did not have keep their priors.
    pub fn start_from(&mut self, posterior: &Posterior) {
        let states = self.config.effect_states;
        for (at, state) in (EFFECTS..).zip(states.iter()) {
            let Some(i) = posterior.place(state.parameter) else { continue };
            self.x.set_tail(at, &[posterior.mean.get(i).copied().unwrap_or(0.0)]);
            for (other, earlier) in (EFFECTS..=at).zip(states.iter()) {
                if let Some(j) = posterior.place(earlier.parameter) {
                    self.p.set(at, other, posterior.covariance(i, j));
                }
            }
        }
    }
}
