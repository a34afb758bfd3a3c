//! A time at which something may have begun: the sums at it, and what its beginning has changed since.
//!
//! A change since t₀ moves the innovations as one that was always there, but for what that one had done to the estimate
//! by then, g(t₀). What becomes of an error of the estimate at t₀ runs along as columns of its own, from unity on, until
//! the filter has forgotten it:
//!
//!   a_since = a − Σ_m s_m g_m(t₀)
//!
//! The change began within the block that t₀ ends. What it has done to the estimate within that block is left open: these
//! columns are also numbers of their own, with a sigma each.

use super::columns::COLUMNS;
use super::sums::{Direction, Sums, along};
use crate::navigation::algebra::layout::{CLONE_STATES, PEER_STATES, PEERS};
use crate::state::{PSI, U, V, VEHICLE_STATES, X, Y, Z};

/// Length of a block, µs of counted time.
pub(super) const BLOCK_US: u64 = 20_000_000;
/// The vehicle and two delayed states.
pub(super) const STATES: usize = VEHICLE_STATES + PEERS * PEER_STATES + 2 * CLONE_STATES;
/// States whose error at an onset the filter remembers: the others are measured within seconds.
pub(super) const REMEMBERED: [usize; 6] = [X, Y, Z, PSI, U, V];
/// One sigma of what a change may have done to each within a block: m, rad, m/s.
pub(super) const DISTURBED: [f64; REMEMBERED.len()] = [1.0, 1.0, 0.2, 0.05, 0.1, 0.05];

/// The same sums for the columns of an onset's own.
#[derive(Clone)]
pub(super) struct OwnSums {
    by_column: [[f64; COLUMNS]; REMEMBERED.len()],
    own: [[f64; REMEMBERED.len()]; REMEMBERED.len()],
    score: [f64; REMEMBERED.len()],
}

impl OwnSums {
    const NONE: Self = Self {
        by_column: [[0.0; COLUMNS]; REMEMBERED.len()],
        own: [[0.0; REMEMBERED.len()]; REMEMBERED.len()],
        score: [0.0; REMEMBERED.len()],
    };

    pub(super) fn take(&mut self, own: &[f64; REMEMBERED.len()], row: &[f64; COLUMNS], e: f64) {
        let sums = self.by_column.iter_mut().zip(&mut self.own).zip(&mut self.score);
        for (s, ((by_column, by_own), score)) in own.iter().zip(sums) {
            *score += s * e;
            by_column.iter_mut().zip(row).for_each(|(sum, a)| *sum += s * a);
            by_own.iter_mut().zip(own).for_each(|(sum, other)| *sum += s * other);
        }
    }
}

/// The onset.
#[derive(Clone)]
pub(super) struct Onset {
    pub(super) time_us: u64,
    pub(super) sums: Sums,
    /// Scatter of the scores before it over that of white innovations, by columns.
    pub(super) colour: [f64; COLUMNS],
    /// g(t₀).
    start: [[f64; COLUMNS]; REMEMBERED.len()],
    /// The filter still remembers.
    pub(super) lasts: bool,
    /// s, before it is seen.
    pub(super) columns: [[f64; STATES]; REMEMBERED.len()],
    pub(super) running: OwnSums,
    /// As they were when the last block was closed.
    held: OwnSums,
}

impl Onset {
    pub(super) const NONE: Self = Self {
        time_us: 0,
        sums: Sums::NONE,
        colour: [0.0; COLUMNS],
        start: [[0.0; COLUMNS]; REMEMBERED.len()],
        lasts: false,
        columns: [[0.0; STATES]; REMEMBERED.len()],
        running: OwnSums::NONE,
        held: OwnSums::NONE,
    };

    /// Begins at a time at which the filter has no delayed states.
    pub(super) fn begin(
        &mut self,
        time_us: u64,
        sums: &Sums,
        colour: [f64; COLUMNS],
        by_column: &[[f64; STATES]; COLUMNS],
    ) {
        (self.time_us, self.colour, self.lasts) = (time_us, colour, true);
        self.sums.clone_from(sums);
        self.columns = [[0.0; STATES]; REMEMBERED.len()];
        (self.running, self.held) = (OwnSums::NONE, OwnSums::NONE);
        for ((state, column), start) in REMEMBERED.iter().zip(&mut self.columns).zip(&mut self.start) {
            if let Some(one) = column.get_mut(*state) {
                *one = 1.0;
            }
            for (start, g) in start.iter_mut().zip(by_column) {
                *start = g.get(*state).copied().unwrap_or(0.0);
            }
        }
    }

    /// Sums and onset as they were if the innovations were what a change since then predicts, and nothing else.
    pub(super) fn without_noise(&self, total: &Sums, change: impl Iterator<Item = (Direction, f64)>) -> (Sums, Self) {
        let (mut sums, mut own) = (total.clone(), self.clone());
        (sums.score, own.sums.score, own.held.score) = ([0.0; COLUMNS], [0.0; COLUMNS], [0.0; REMEMBERED.len()]);
        for (v, size) in change {
            sums.score.iter_mut().zip(self.products(total, &v)).for_each(|(score, product)| *score += size * product);
            for (m, score) in own.held.score.iter_mut().enumerate() {
                *score += size * self.state_between(m, &v);
            }
        }
        (sums, own)
    }

    /// Keeps its own sums for what is weighed now.
    pub(super) fn hold(&mut self) {
        self.held.clone_from(&self.running);
    }

    /// g(t₀) v.
    fn began_with(&self, v: &Direction) -> [f64; REMEMBERED.len()] {
        self.start.each_ref().map(|start| along(v, start))
    }

    /// Aᵀ a_since v.
    pub(super) fn products(&self, total: &Sums, v: &Direction) -> [f64; COLUMNS] {
        let mut products = total.times_since(&self.sums, v);
        for (began, by_column) in self.began_with(v).iter().zip(&self.held.by_column) {
            products.iter_mut().zip(by_column).for_each(|(product, sum)| *product -= began * sum);
        }
        products
    }

    /// a_sinceᵀ e of v.
    pub(super) fn score(&self, total: &Sums, v: &Direction) -> f64 {
        let own: f64 = self.began_with(v).iter().zip(&self.held.score).map(|(began, score)| began * score).sum();
        total.score_since(&self.sums, v) - own
    }

    /// s_mᵀ of the columns.
    pub(super) fn state_products(&self, m: usize) -> [f64; COLUMNS] {
        self.held.by_column.get(m).copied().unwrap_or([0.0; COLUMNS])
    }

    /// s_mᵀ e.
    pub(super) fn state_score(&self, m: usize) -> f64 {
        self.held.score.get(m).copied().unwrap_or(0.0)
    }

    /// s_mᵀ s_n.
    pub(super) fn between_states(&self, m: usize, n: usize) -> f64 {
        self.held.own.get(m).and_then(|own| own.get(n)).copied().unwrap_or(0.0)
    }

    /// s_mᵀ a_since v.
    pub(super) fn state_between(&self, m: usize, v: &Direction) -> f64 {
        let own = self.held.own.get(m).copied().unwrap_or([0.0; REMEMBERED.len()]);
        let began: f64 = own.iter().zip(self.began_with(v)).map(|(sum, began)| sum * began).sum();
        along(v, &self.state_products(m)) - began
    }

    /// vᵀ a_sinceᵀ a_since w.
    pub(super) fn between(&self, total: &Sums, v: &Direction, w: &Direction) -> f64 {
        let (of_v, of_w) = (self.began_with(v), self.began_with(w));
        let mut sum = along(w, &self.products(total, v));
        for ((began, by_column), own) in of_w.iter().zip(&self.held.by_column).zip(&self.held.own) {
            let own: f64 = own.iter().zip(&of_v).map(|(sum, began)| sum * began).sum();
            sum -= began * (along(v, by_column) - own);
        }
        sum
    }
}
