//! What the filter estimates beside the vehicle's motion: each estimate with its worth.

use super::cekf::Filter;
use crate::effects::ParameterId;
use crate::navigation::algebra::layout::EFFECTS;
use crate::navigation::interface::effect_states::MAX_EFFECTS;
use crate::navigation::interface::effect_states::StateParameter;
use crate::parameters::{LEARNT_NAMES, LEARNT_STATES, LEARNT_UNITS, Learnt};

/// Augmented states that have a name of their own: those of [`LEARNT_NAMES`], then those of the water.
pub const ESTIMATE_NAMES: [&str; MAX_EFFECTS] =
    with_water(LEARNT_NAMES, ["current_north", "current_east", "current_rate_north", "current_rate_east"]);

/// Their units; of the logarithm of a factor "1".
pub const ESTIMATE_UNITS: [&str; MAX_EFFECTS] = with_water(LEARNT_UNITS, ["m/s", "m/s", "m/s^2", "m/s^2"]);

const fn with_water(
    of_vehicle: [&'static str; LEARNT_STATES],
    of_water: [&'static str; MAX_EFFECTS - LEARNT_STATES],
) -> [&'static str; MAX_EFFECTS] {
    let mut all = [""; MAX_EFFECTS];
    let mut i = 0;
    while i < MAX_EFFECTS {
        all[i] = if i < LEARNT_STATES { of_vehicle[i] } else { of_water[i - LEARNT_STATES] };
        i += 1;
    }
    all
}

impl StateParameter {
    /// Place among [`ESTIMATE_NAMES`]; `None` of an effect that only a host estimates.
    #[must_use]
    pub fn place(self) -> Option<usize> {
        let axis_of = |id: ParameterId| usize::from(id.info().name != "north_mps");
        match self {
            Self::Effect(id) if id.effect().hooks.water.is_some() => Some(LEARNT_STATES + axis_of(id)),
            Self::CurrentRate(axis) => Some(LEARNT_STATES + 2 + usize::from(axis)).filter(|place| *place < MAX_EFFECTS),
            _ => Learnt::place(self),
        }
    }
}

/// The one constant of separability. The data must have brought sigma below this part of the prior's: they then say
/// three times as much as the prior. And no other estimate, were it known exactly, may bring it down by this part
/// again: given it, sigma is sqrt(1 - r²) of what it was, so that the largest correlation r must be below sqrt(1 - 1/4)
/// = 0.87.
const HALF: f64 = 0.5;

/// One augmented state as it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateEstimate {
    /// What it is.
    pub parameter: StateParameter,
    /// Its value, in the parameter's unit; declared plus what was found.
    pub value: f64,
    /// One sigma.
    pub sigma: f64,
    /// One sigma as declared: of section `[prior]`.
    pub prior_sigma: f64,
    /// Largest correlation with another augmented state, 0 to 1.
    pub correlation: f64,
}

impl StateEstimate {
    /// Whether the motion so far separates it from its prior and from the other estimates. If not, the filter uses it,
    /// but it must not be reported as a finding.
    #[must_use]
    pub fn is_separable(&self) -> bool {
        self.sigma < HALF * self.prior_sigma && 1.0 - self.correlation * self.correlation > HALF * HALF
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
}
