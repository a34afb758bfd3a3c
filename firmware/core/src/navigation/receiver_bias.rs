//! What constant errors of the two GNSS receivers make of the estimate.
//!
//! A receiver's error is not white: no number of fixes averages it out, and no measurement on board shows it. The
//! filter takes fixes and the ship's reports as white all the same. Its estimate then depends on the biases β of the
//! vehicle's and of the ship's receiver, north and east, by Ψ = ∂x̂/∂β, which moves through the same steps as the
//! estimate: Ψ ← Φ Ψ over time, Ψ ← Ψ + K (∂ν/∂β − h Ψ) by a measurement. The covariance of the error is then P + σ² Ψ
//! Ψᵀ: the consider covariance of Schmidt (1966), with the filter's own gain instead of the one that would be optimal
//! for it. At the surface Ψ of the vehicle's receiver is one; under water the ship's takes over, and in between, where
//! ranges contradict the place of the dive, Ψ exceeds one, because current and heading are blamed.

use super::{LinearStep, MAX_STATES, Observer, ScalarUpdate, Sensor};
use crate::state::{X, Y};

/// The vehicle's receiver north and east, the ship's north and east.
const BIASES: usize = 4;

/// Ψ, a column a bias.
#[derive(Clone)]
pub(super) struct ReceiverBias {
    /// Whose measurement is under way.
    pub(super) sensor: Sensor,
    columns: [[f64; MAX_STATES]; BIASES],
}

impl ReceiverBias {
    pub(super) const fn new() -> Self {
        Self { sensor: Sensor::Depth, columns: [[0.0; MAX_STATES]; BIASES] }
    }

    /// The position is that of a fix.
    pub(super) fn reset(&mut self) {
        self.columns = [[0.0; MAX_STATES]; BIASES];
        let [north, east, ..] = &mut self.columns;
        (north[X], east[Y]) = (1.0, 1.0);
    }

    /// (Ψ Ψᵀ)_ij.
    pub(super) fn product(&self, i: usize, j: usize) -> f64 {
        let at = |column: &[f64; MAX_STATES], i: usize| column.get(i).copied().unwrap_or(0.0);
        self.columns.iter().map(|column| at(column, i) * at(column, j)).sum()
    }

    fn update(&mut self, update: &ScalarUpdate<'_>) {
        // ∂ν/∂β: a fix is off by the bias itself. A ship that says it is north of its place has a range that is longer
        // than predicted by the slope of the range over the vehicle's north, which stands first in its row.
        let mut slopes = update.row().map(|(_, value)| value);
        let first = slopes.next().unwrap_or(0.0);
        let second = slopes.next().unwrap_or(0.0);
        let is_north = update.row().next().is_some_and(|(state, _)| state == X);
        let direct = match self.sensor {
            Sensor::VehicleGnss if is_north => [1.0, 0.0, 0.0, 0.0],
            Sensor::VehicleGnss => [0.0, 1.0, 0.0, 0.0],
            Sensor::Range => [0.0, 0.0, first, second],
            _ => [0.0; BIASES],
        };
        for (column, direct) in self.columns.iter_mut().zip(direct) {
            let seen: f64 = update.row().map(|(state, value)| value * column.get(state).copied().unwrap_or(0.0)).sum();
            let change = direct - seen;
            if change != 0.0 {
                column.iter_mut().zip(update.gain).for_each(|(psi, gain)| *psi += gain * change);
            }
        }
    }
}

impl Observer for ReceiverBias {
    fn observe(&mut self, step: &LinearStep<'_>) {
        if let LinearStep::Update(update) = step {
            return self.update(update);
        }
        for column in &mut self.columns {
            match step {
                LinearStep::Transition(transition) => transition.apply(column),
                LinearStep::Update(_) => {}
                LinearStep::Append(states) => {
                    for i in 0..states.count() {
                        let value = states.row(i).map(|(j, c)| c * column.get(j).copied().unwrap_or(0.0)).sum();
                        if let Some(psi) = column.get_mut(states.at + i) {
                            *psi = value;
                        }
                    }
                }
                LinearStep::Insert { at, count } => {
                    if let Some(tail) = column.get_mut(*at..).filter(|tail| *count <= tail.len()) {
                        tail.rotate_right(*count);
                        tail.iter_mut().take(*count).for_each(|psi| *psi = 0.0);
                    }
                }
                LinearStep::Remove { at, count } => {
                    if let Some(tail) = column.get_mut(*at..).filter(|tail| *count <= tail.len()) {
                        tail.iter_mut().take(*count).for_each(|psi| *psi = 0.0);
                        tail.rotate_left(*count);
                    }
                }
            }
        }
    }
}
