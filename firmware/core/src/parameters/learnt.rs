//! What identification and earlier dives have learnt of the vehicle: the prior of the robust filter.
//!
//! One mechanism for both: mean, sigma and correlations of the states that belong to the vehicle and its compass.
//! Nothing of the water is kept, which is another at the next dive.

use super::{Row, Shape};
use crate::row;

/// States that are kept.
pub const LEARNT_STATES: usize = 16;
/// Their correlations: a triangle without its diagonal.
const CORRELATIONS: usize = LEARNT_STATES * (LEARNT_STATES - 1) / 2;

/// Names of the states, in their order: logarithms of true over declared parameters, then offsets.
pub const LEARNT_NAMES: [&str; LEARNT_STATES] = [
    "m11",
    "m22",
    "m33",
    "d11",
    "d66",
    "beta1",
    "beta3",
    "beta5",
    "rudder_trim",
    "elevator_trim",
    "heading",
    "heading_sin",
    "heading_cos",
    "buoyancy",
    "pitch_trim",
    "fin_lag",
];

/// Units of the states.
pub const LEARNT_UNITS: [&str; LEARNT_STATES] =
    ["1", "1", "1", "1", "1", "1", "1", "1", "rad", "rad", "rad", "rad", "rad", "kg", "rad", "s"];

/// What may have changed between two dives, as a part of the prior sigma: ballast, fins that were taken off, salt in
/// the water. It bounds what any number of dives can make of the prior: no sigma gets below a tenth of it.
pub const HANDLING: f64 = 0.1;

/// Least pivot of a correlation matrix that counts as positive; rounding leaves 1e-15.
const LEAST_PIVOT: f64 = 1.0e-9;

/// Section `[learnt]` of the vehicle file: the prior of the states that belong to the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Learnt {
    /// Dives since the vehicle was declared or identified.
    pub dives: u16,
    /// Estimates, in the order of [`LEARNT_NAMES`], [`LEARNT_UNITS`].
    pub mean: [f64; LEARNT_STATES],
    /// One sigma each. Zero: nothing was learnt, and section `[prior]` holds.
    pub sigma: [f64; LEARNT_STATES],
    /// Correlations, row by row below the diagonal: (1, 0), (2, 0), (2, 1), …
    pub correlation: [f64; CORRELATIONS],
}

/// Correlations that no covariance has; the two states whose correlation is the largest of those that contradict.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotPositiveDefinite(pub usize, pub usize);

impl Learnt {
    /// Nothing.
    pub const NONE: Self =
        Self { dives: 0, mean: [0.0; LEARNT_STATES], sigma: [0.0; LEARNT_STATES], correlation: [0.0; CORRELATIONS] };

    /// Whether nothing was learnt.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.sigma.iter().all(|sigma| *sigma == 0.0)
    }

    /// Place of (i, j) among the correlations, i other than j.
    fn entry(i: usize, j: usize) -> usize {
        let (row, column) = (i.max(j), i.min(j));
        row * row.saturating_sub(1) / 2 + column
    }

    /// Correlation of states i and j.
    #[must_use]
    pub fn correlation(&self, i: usize, j: usize) -> f64 {
        if i == j { 1.0 } else { self.correlation.get(Self::entry(i, j)).copied().unwrap_or(0.0) }
    }

    /// Sets the correlation of states i and j, i other than j.
    pub fn set_correlation(&mut self, i: usize, j: usize, value: f64) {
        if let Some(place) = self.correlation.get_mut(Self::entry(i, j))
            && i != j
        {
            *place = value;
        }
    }

    pub(crate) fn sigma(&self, i: usize) -> f64 {
        self.sigma.get(i).copied().unwrap_or(0.0)
    }

    /// Cholesky's factorisation of the correlations of all that was learnt.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`]: no covariance has these correlations.
    pub fn check(&self) -> Result<(), NotPositiveDefinite> {
        let mut l = [[0.0_f64; LEARNT_STATES]; LEARNT_STATES];
        for i in 0..LEARNT_STATES {
            for j in 0..=i {
                let known = i != j && (self.sigma(i) == 0.0 || self.sigma(j) == 0.0);
                let mut sum = if known { 0.0 } else { self.correlation(i, j) };
                for k in 0..j {
                    sum -= l[i][k] * l[j][k];
                }
                if i != j {
                    l[i][j] = sum / l[j][j];
                } else if sum > LEAST_PIVOT {
                    l[i][i] = libm::sqrt(sum);
                } else {
                    return Err(self.most_correlated(i));
                }
            }
        }
        Ok(())
    }

    /// State i and the one before it that it is most correlated with.
    fn most_correlated(&self, i: usize) -> NotPositiveDefinite {
        let mut most = 0;
        for j in 1..i {
            if self.correlation(i, j).abs() > self.correlation(i, most).abs() {
                most = j;
            }
        }
        NotPositiveDefinite(i, most)
    }
}

impl Default for Learnt {
    fn default() -> Self {
        Self::NONE
    }
}

/// A row of [`LEARNT`].
macro_rules! learnt {
    ($values:ident from $at:literal, $shape:expr, $count:literal, $key:literal, $unit:literal, $range:expr, $help:literal) => {
        row!(
            elements[$shape, 0, $count] $key, "", $unit, $range, $help,
            |s, i| s.$values.get($at + i).copied().unwrap_or(f64::NAN),
            |s, i, value| if let Some(place) = s.$values.get_mut($at + i) { *place = value; }
        )
    };
    (correlation of $state:literal, $shape:expr, $key:literal, $help:literal) => {
        row!(
            elements[$shape, 0, $state] $key, "", "1", [-1.0, 1.0], $help,
            |s, other| s.correlation($state, other),
            |s, other, value| s.set_correlation($state, other, value)
        )
    };
}

/// What the robust filter starts from where something was learnt. The order of the states, by which correlations are
/// named: m11, m22, m33, d11, d66, beta1, beta3, beta5, rudder_trim, elevator_trim, heading, heading_sin, heading_cos,
/// buoyancy, pitch_trim, fin_lag.
#[rustfmt::skip]
pub const LEARNT: &[Row<Learnt>] = &[
    row!(whole "learnt.dives", "", "1", [0.0, 65535.0], "Dives that have added to it since the vehicle was declared or identified.", dives),
    learnt!(mean from 0, Shape::Vector(3), 3, "learnt.mass", "1", [-1.0, 1.0], "Logarithms of true over declared m_11, m_22, m_33."),
    learnt!(sigma from 0, Shape::Vector(3), 3, "learnt.mass_sigma", "1", [0.0, 1.0], "Its sigma; 0: nothing was learnt."),
    learnt!(mean from 3, Shape::Vector(2), 2, "learnt.drag", "1", [-1.0, 1.0], "Logarithms of true over declared d_11, d_66."),
    learnt!(sigma from 3, Shape::Vector(2), 2, "learnt.drag_sigma", "1", [0.0, 1.0], "Its sigma; 0: nothing was learnt."),
    learnt!(mean from 5, Shape::Vector(3), 3, "learnt.actuators", "1", [-1.0, 1.0], "Logarithms of true over declared beta_1, beta_3, beta_5."),
    learnt!(sigma from 5, Shape::Vector(3), 3, "learnt.actuators_sigma", "1", [0.0, 1.0], "Its sigma; 0: nothing was learnt."),
    learnt!(mean from 8, Shape::Vector(2), 2, "learnt.fin_trim_rad", "rad", [-0.5, 0.5], "Angle by which the rudders, and the elevators, stand off their commands."),
    learnt!(sigma from 8, Shape::Vector(2), 2, "learnt.fin_trim_sigma_rad", "rad", [0.0, 0.3], "Its sigma; 0: nothing was learnt."),
    learnt!(mean from 10, Shape::Scalar, 1, "learnt.heading_rad", "rad", [-1.0, 1.0], "Constant part of the compass error."),
    learnt!(sigma from 10, Shape::Scalar, 1, "learnt.heading_sigma_rad", "rad", [0.0, 0.5], "Its sigma; 0: nothing was learnt."),
    learnt!(mean from 11, Shape::Vector(2), 2, "learnt.hard_iron_rad", "rad", [-1.0, 1.0], "Sine and cosine part of the compass error."),
    learnt!(sigma from 11, Shape::Vector(2), 2, "learnt.hard_iron_sigma_rad", "rad", [0.0, 0.5], "Its sigma; 0: nothing was learnt."),
    learnt!(mean from 13, Shape::Scalar, 1, "learnt.buoyancy_kg", "kg", [-10.0, 10.0], "Displaced mass beyond the declared one."),
    learnt!(sigma from 13, Shape::Scalar, 1, "learnt.buoyancy_sigma_kg", "kg", [0.0, 2.0], "Its sigma; 0: nothing was learnt."),
    learnt!(mean from 14, Shape::Scalar, 1, "learnt.pitch_trim_rad", "rad", [-1.0, 1.0], "Angle of b, from the vertical, in pitch."),
    learnt!(sigma from 14, Shape::Scalar, 1, "learnt.pitch_trim_sigma_rad", "rad", [0.0, 0.5], "Its sigma; 0: nothing was learnt."),
    learnt!(mean from 15, Shape::Scalar, 1, "learnt.fin_lag_s", "s", [-5.0, 5.0], "Lag of the fins."),
    learnt!(sigma from 15, Shape::Scalar, 1, "learnt.fin_lag_sigma_s", "s", [0.0, 2.0], "Its sigma; 0: nothing was learnt."),
    learnt!(correlation of 1, Shape::Scalar, "learnt.correlation_m22", "Correlation with m11."),
    learnt!(correlation of 2, Shape::Vector(2), "learnt.correlation_m33", "Correlation with m11 to m22."),
    learnt!(correlation of 3, Shape::Vector(3), "learnt.correlation_d11", "Correlation with m11 to m33."),
    learnt!(correlation of 4, Shape::Vector(4), "learnt.correlation_d66", "Correlation with m11 to d11."),
    learnt!(correlation of 5, Shape::Vector(5), "learnt.correlation_beta1", "Correlation with m11 to d66."),
    learnt!(correlation of 6, Shape::Vector(6), "learnt.correlation_beta3", "Correlation with m11 to beta1."),
    learnt!(correlation of 7, Shape::Vector(7), "learnt.correlation_beta5", "Correlation with m11 to beta3."),
    learnt!(correlation of 8, Shape::Vector(8), "learnt.correlation_rudder_trim", "Correlation with m11 to beta5."),
    learnt!(correlation of 9, Shape::Vector(9), "learnt.correlation_elevator_trim", "Correlation with m11 to rudder_trim."),
    learnt!(correlation of 10, Shape::Vector(10), "learnt.correlation_heading", "Correlation with m11 to elevator_trim."),
    learnt!(correlation of 11, Shape::Vector(11), "learnt.correlation_heading_sin", "Correlation with m11 to heading."),
    learnt!(correlation of 12, Shape::Vector(12), "learnt.correlation_heading_cos", "Correlation with m11 to heading_sin."),
    learnt!(correlation of 13, Shape::Vector(13), "learnt.correlation_buoyancy", "Correlation with m11 to heading_cos."),
    learnt!(correlation of 14, Shape::Vector(14), "learnt.correlation_pitch_trim", "Correlation with m11 to buoyancy."),
    learnt!(correlation of 15, Shape::Vector(15), "learnt.correlation_fin_lag", "Correlation with m11 to pitch_trim."),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_triangle_has_a_place_for_each_pair() {
        let mut taken = [false; CORRELATIONS];
        for i in 0..LEARNT_STATES {
            for j in 0..i {
                assert_eq!(Learnt::entry(i, j), Learnt::entry(j, i));
                assert!(!core::mem::replace(&mut taken[Learnt::entry(i, j)], true));
            }
        }
        assert_eq!(taken, [true; CORRELATIONS]);
    }

    /// Three variables correlated by r with each other have a covariance down to r = -1/2: the smallest eigenvalue is 1
    /// + 2 r.
    #[test]
    fn val_only_what_a_covariance_can_have_is_taken() {
        let with = |r: f64| {
            let mut learnt = Learnt { sigma: [0.1; LEARNT_STATES], ..Learnt::NONE };
            for (i, j) in [(4, 2), (7, 2), (7, 4)] {
                learnt.set_correlation(i, j, r);
            }
            learnt
        };
        assert_eq!(with(-0.499).check(), Ok(()));
        assert_eq!(with(-0.501).check(), Err(NotPositiveDefinite(7, 2)));
        assert_eq!(with(1.0).check(), Err(NotPositiveDefinite(4, 2)));
        // What has no sigma was not learnt, and its correlations are nobody's.
        let mut known = with(-0.501);
        known.sigma[4] = 0.0;
        assert_eq!(known.check(), Ok(()));
    }
}
