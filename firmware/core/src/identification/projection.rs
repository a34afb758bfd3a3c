//! The box that θ̂ is kept in.

use super::theta::{B1, PARAMETERS, Theta, W, theta_of};
use crate::dynamics::VehicleParameters;

/// w may differ by this share of the displaced weight: two litres of water in an Iver3's hull.
const WEIGHT_SHARE: f64 = 0.05;

/// Lower and upper bound of every parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterBox {
    lower: Theta,
    upper: Theta,
}

impl ParameterBox {
    /// Around a prior: `ratio` times its value, `0 < ratio[0] < 1 < ratio[1]`.
    ///
    /// Parameters that may be zero have a box of another kind: w within 5 % of the displaced weight and within twice
    /// its own magnitude, B1 and B2 within |B3| (a trim of 45°).
    #[must_use]
    pub fn around(prior: &VehicleParameters, ratio: [f64; 2]) -> Self {
        let theta = theta_of(prior);
        let [a, b] = ratio.map(|ratio| theta * ratio);
        // β4 is negative on most fins: its bounds change places.
        let (mut lower, mut upper) = (a.inf(&b), a.sup(&b));
        let around = |value: f64, reach: f64| (value - reach, value + reach);
        let weight_reach = WEIGHT_SHARE * prior.displaced_mass_kg * prior.g_mps2;
        (lower[W], upper[W]) = around(theta[W], weight_reach + 2.0 * theta[W].abs());
        for lateral in [B1, B1 + 1] {
            (lower[lateral], upper[lateral]) = around(theta[lateral], theta[B1 + 2].abs());
        }
        Self { lower, upper }
    }

    /// Half the width in one parameter: the size of a plausible error.
    #[must_use]
    pub fn reach(&self, parameter: usize) -> f64 {
        0.5 * (self.upper[parameter] - self.lower[parameter])
    }

    /// Moves θ to the nearest point of the box; says which parameters were moved, bit j for θ_j.
    pub fn project(&self, theta: &mut Theta) -> u32 {
        let mut moved = 0;
        for j in 0..PARAMETERS {
            let bound = if theta[j] < self.lower[j] {
                self.lower[j]
            } else if theta[j] > self.upper[j] {
                self.upper[j]
            } else {
                continue;
            };
            theta[j] = bound;
            moved |= 1 << j;
        }
        moved
    }
}
