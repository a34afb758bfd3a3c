//! Magnitudes of the faults, estimated from the errors of the observer.

use super::FaultCause;
use nalgebra::{Cholesky, SMatrix, SVector, Vector6};

/// Magnitudes: fins, drag, thrust, water, and the water's moment.
pub(super) const MODES: usize = 8;
pub(super) const DRAG: usize = 4;
pub(super) const THRUST: usize = 5;
pub(super) const WATER: usize = 6;
pub(super) const MOMENT: usize = 7;
/// Largest magnitudes of [`FaultCause::ALL`]: a fin cannot lose more than all of it, and so on.
const LARGEST: [f64; FaultCause::COUNT] = [1.0, 1.0, 1.0, 1.0, 10.0, 1.0, 10.0];
/// Plausible errors of the parameters in use, in terms of the modes: the prior of the long memory.
const PRIOR: [f64; MODES] = [0.3, 0.3, 0.3, 0.3, 0.3, 0.2, 0.3, 0.1];
/// The moment of the water is a second magnitude of the same fault; its gain has to exceed this.
const SECOND: f64 = 4.0;

/// Error of the observer per unit of each fault.
pub(super) type Signature = SMatrix<f64, 6, MODES>;

/// Normal equations of the magnitudes: lower triangle and right side.
#[derive(Clone, Copy)]
pub(super) struct Evidence {
    information: [f32; MODES * (MODES + 1) / 2],
    vector: [f32; MODES],
}

impl Evidence {
    pub(super) const NONE: Self = Self { information: [0.0; MODES * (MODES + 1) / 2], vector: [0.0; MODES] };

    fn at(&self, i: usize, j: usize) -> f64 {
        let (row, column) = if i < j { (j, i) } else { (i, j) };
        self.information.get(row * (row + 1) / 2 + column).copied().map_or(0.0, f64::from)
    }

    /// Forgets all but `keep` and takes errors of six axes with these weights.
    pub(super) fn add(&mut self, keep: f64, signature: &Signature, error: &Vector6<f64>, weights: &[f64; 6]) {
        let mut place = 0;
        for i in 0..MODES {
            let mut right = f64::from(self.vector[i]) * keep;
            for axis in 0..6 {
                right += signature[(axis, i)] * weights[axis] * error[axis];
            }
            self.vector[i] = right as f32;
            for j in 0..=i {
                let mut sum = 0.0;
                for axis in 0..6 {
                    sum += signature[(axis, i)] * weights[axis] * signature[(axis, j)];
                }
                if let Some(element) = self.information.get_mut(place) {
                    *element = (f64::from(*element) * keep + sum) as f32;
                }
                place += 1;
            }
        }
    }

    /// Gain of a fault alone, twice the log likelihood ratio, its magnitude and the water's moment.
    pub(super) fn gain(&self, cause: usize) -> [f64; 3] {
        let (information, right) = (self.at(cause, cause), f64::from(self.vector[cause]));
        if information <= 0.0 {
            return [0.0; 3];
        }
        let within = |magnitude: f64| magnitude.max(0.0).min(LARGEST[cause]);
        let mut best = within(right / information);
        let gain_of = |magnitude: f64| (2.0 * right - information * magnitude) * magnitude;
        let mut gain = gain_of(best);
        let mut moment = 0.0;
        if cause == WATER {
            let (own, cross) = (self.at(MOMENT, MOMENT), self.at(WATER, MOMENT));
            let moment_right = f64::from(self.vector[MOMENT]);
            let left = information - cross * cross / own;
            if own > 0.0 && left > 1e-9 * information {
                let water = within((right - cross * moment_right / own) / left);
                let moment_of = (moment_right - cross * water) / own;
                // Somewhere inside the hull.
                let lever = 1.0;
                let moment_of = moment_of.max(-lever * water).min(lever * water);
                let both =
                    gain_of(water) + (2.0 * (moment_right - cross * water) - own * moment_of) * moment_of - SECOND;
                if both > gain {
                    (gain, best, moment) = (both, water, moment_of);
                }
            }
        }
        [gain, best, moment]
    }

    /// All magnitudes at once, drawn towards zero by the prior.
    pub(super) fn solve(&self) -> Option<SVector<f64, MODES>> {
        let matrix = SMatrix::<f64, MODES, MODES>::from_fn(|i, j| {
            self.at(i, j) + if i == j { 1.0 / (PRIOR[i] * PRIOR[i]) } else { 0.0 }
        });
        let right = SVector::<f64, MODES>::from_fn(|i, _| f64::from(self.vector[i]));
        Cholesky::new(matrix).map(|factor| factor.solve(&right))
    }
}
