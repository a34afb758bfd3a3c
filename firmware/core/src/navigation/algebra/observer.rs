//! Every step of the filter as a linear map, for a smoother on a host.
//!
//! [`crate::navigation::Filter`] hands each of its steps to an [`Observer`]. The board's is `()`, which costs nothing.

use super::discretisation::{DRIVING, Discretisation};
use super::layout;
use super::layout::{EFFECTS, SHIP_VELOCITY};
use super::row::Row;
use crate::state::{PSI, VEHICLE_STATES, X, Y};

/// Most states of a [`crate::navigation::Filter`].
pub const MAX_STATES: usize = layout::N_MAX;

/// Sees every step of a filter in the order in which state and covariance take them.
pub trait Observer {
    /// State and covariance have just taken this step.
    fn observe(&mut self, step: &LinearStep<'_>);
}

impl Observer for () {
    #[inline(always)]
    fn observe(&mut self, _: &LinearStep<'_>) {}
}

/// One step of the filter as a linear map of its state x. Noise that only adds to the covariance is left out.
pub enum LinearStep<'a> {
    /// x ← Φ x over time.
    Transition(Transition<'a>),
    /// x ← x + K ν by a scalar measurement with innovation variance S = h P hᵀ + R and K = P hᵀ / S.
    Update(ScalarUpdate<'a>),
    /// A scalar measurement that the gate refused; its gain is empty, and no state takes anything of it.
    Refused(ScalarUpdate<'a>),
    /// States behind the present ones, each a linear function of these: x ← \[x; C x\].
    Append(Appended<'a>),
    /// `count` states of their own, independent of all others, come to stand at `at`.
    Insert {
        /// Place of the first.
        at: usize,
        /// How many.
        count: usize,
    },
    /// The `count` states at `at` are forgotten.
    Remove {
        /// Place of the first.
        at: usize,
        /// How many.
        count: usize,
    },
}

/// Φ of one prediction step: the identity, but for the vehicle's rows and a few entries besides.
pub struct Transition<'a> {
    pub(crate) step: &'a Discretisation,
    pub(crate) states: usize,
    /// Vehicle and effect states: the columns that have entries in the vehicle's rows.
    pub(crate) live: usize,
    pub(crate) current: Option<usize>,
    pub(crate) current_rate: Option<usize>,
    /// What the rates take of the current.
    pub(crate) turn: f64,
    pub(crate) ship: Option<usize>,
    pub(crate) step_s: f64,
}

impl Transition<'_> {
    /// Number of states.
    #[must_use]
    pub fn states(&self) -> usize {
        self.states
    }

    /// Number of leading states on which the vehicle's depend.
    #[must_use]
    pub fn live(&self) -> usize {
        self.live
    }

    /// The vehicle's rows of Φ, by columns: `out[j][i]` = Φ_ij of the first [`Self::live`] states j; as many as fit.
    pub fn vehicle_rows(&self, out: &mut [[f64; VEHICLE_STATES]]) {
        for (j, column) in out.iter_mut().enumerate().take(self.live) {
            *column = [0.0; VEHICLE_STATES];
            if let Some(one) = column.get_mut(j) {
                *one = 1.0;
            }
        }
        let mut set = |j: usize, from: &dyn Fn(&mut [f64; VEHICLE_STATES])| {
            if let Some(column) = out.get_mut(j) {
                from(column);
            }
        };
        for (state, phi) in DRIVING.iter().zip(&self.step.phi) {
            set(*state, &|column| *column = *phi);
        }
        set(PSI, &|column| [column[X], column[Y]] = self.step.phi_heading);
        for effect in self.step.effects.iter().take(self.step.effect_count) {
            set(EFFECTS + effect.slot, &|column| *column = effect.gamma);
        }
        if let Some(current) = self.current {
            set(current, &|column| column[X] += self.step_s);
            set(current + 1, &|column| column[Y] += self.step_s);
        }
        if let Some(rate) = self.current_rate {
            let half_square = 0.5 * self.step_s * self.step_s;
            set(rate, &|column| column[X] += half_square);
            set(rate + 1, &|column| column[Y] += half_square);
        }
    }

    /// Entries (row, column, value) that Φ has beyond the identity outside the vehicle's rows.
    pub fn others(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        let ship = self.ship.map(|at| [0, 1, 2].map(|i| (at + i, at + SHIP_VELOCITY + i, self.step_s)));
        let current = self.current.zip(self.current_rate);
        let entries =
            |i: usize, (at, rate): (usize, usize)| [(at + i, rate + i, self.step_s), (rate + i, at + i, self.turn)];
        let current = current.map(|both| [entries(0, both), entries(1, both)].into_iter().flatten());
        ship.into_iter().flatten().chain(current.into_iter().flatten())
    }
}

/// A scalar measurement.
pub struct ScalarUpdate<'a> {
    pub(crate) row: &'a Row,
    /// K, one number a state.
    pub gain: &'a [f64],
    /// ν.
    pub innovation: f64,
    /// S.
    pub variance: f64,
    /// Some states are only considered (S. F. Schmidt 1966): K is zero for them, where P hᵀ / S is not.
    pub considers: bool,
}

impl ScalarUpdate<'_> {
    /// h: (state, ∂z/∂state). A state that comes twice counts twice.
    pub fn row(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.row.iter()
    }
}

/// States appended as linear functions of those before them.
pub struct Appended<'a> {
    /// Place of the first.
    pub at: usize,
    pub(crate) rows: &'a [Row],
}

impl Appended<'_> {
    /// How many.
    #[must_use]
    pub fn count(&self) -> usize {
        self.rows.len()
    }

    /// Row `i` of C: (state, coefficient).
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.rows.get(i).into_iter().flat_map(Row::iter)
    }
}
