//! Which parameters the motion shows: the means of Yᵀ M⁻¹ Y, the gains that follow and what has to be frozen.

use super::regressor::Regressor;
use super::theta::{PARAMETERS, Theta};

/// What the recent motion says about one parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Visibility {
    /// Held at its declared value: it is the scale.
    Known,
    /// The motion does not depend on it: frozen.
    Frozen,
    /// The motion depends on it, but other parameters explain all but a thousandth of its effect: it adapts, and the
    /// prediction with it; its value alone means little.
    Collinear,
    /// Its effect differs from that of all others.
    Separate,
}

/// Excitation of one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterExcitation {
    /// The verdict.
    pub visibility: Visibility,
    /// Effect of an error of half the box on the acceleration, in units of the floor, root mean square; below 1: frozen.
    pub strength: f64,
    /// Share of its effect's energy that no combination of the other parameters explains.
    pub independent: f64,
}

impl ParameterExcitation {
    const NONE: Self = Self { visibility: Visibility::Frozen, strength: 0.0, independent: 0.0 };
}

/// Excitation of every parameter, in the order of θ.
pub type Excitation = [ParameterExcitation; PARAMETERS];

/// Below this independent share two columns are told apart by their noise.
const INDEPENDENT: f64 = 1.0e-3;
/// Keeps the correlation matrix invertible; well below [`INDEPENDENT`].
const RIDGE: f64 = 1.0e-6;

/// Means over the recent motion.
pub(super) struct ExcitationMonitor {
    /// 1 / m_i of the prior.
    inverse_mass: [f64; 6],
    /// 1 / (m_i a_i)², a_i the floor of acceleration.
    inverse_floor: [f64; 6],
    /// Squared half width of the box.
    reach: Theta,
    /// Mean of Yᵀ M⁻¹ Y, lower triangle.
    gram: [[f64; PARAMETERS]; PARAMETERS],
    /// Mean of Σ_i (reach_j Y_ij / (m_i a_i))².
    strength: Theta,
    /// Time averaged so far, s.
    observed_s: f64,
    /// Memory of the means, s.
    memory_s: f64,
}

impl ExcitationMonitor {
    pub(super) const fn new() -> Self {
        let zeros = Theta::from_array_storage(nalgebra::ArrayStorage([[0.0; PARAMETERS]]));
        Self {
            inverse_mass: [0.0; 6],
            inverse_floor: [0.0; 6],
            reach: zeros,
            gram: [[0.0; PARAMETERS]; PARAMETERS],
            strength: zeros,
            observed_s: 0.0,
            memory_s: 1.0,
        }
    }

    pub(super) fn configure(&mut self, mass: &[f64; 6], floor: &[f64; 6], reach: &Theta, memory_s: f64) {
        for axis in 0..6 {
            let force = mass[axis] * floor[axis];
            self.inverse_mass[axis] = 1.0 / mass[axis];
            self.inverse_floor[axis] = 1.0 / (force * force);
        }
        self.reach = reach.component_mul(reach);
        self.gram = [[0.0; PARAMETERS]; PARAMETERS];
        self.strength.fill(0.0);
        self.observed_s = 0.0;
        self.memory_s = memory_s;
    }

    /// Time averaged so far, s.
    pub(super) fn observed_s(&self) -> f64 {
        self.observed_s
    }

    /// Takes Y of one sample that stands for dt; a plain mean at first, with exponential memory later.
    pub(super) fn observe(&mut self, y: &Regressor, dt: f64) {
        self.observed_s += dt;
        let weight = dt / self.observed_s.min(self.memory_s);
        let keep = 1.0 - weight;
        for row in &mut self.gram {
            for value in row {
                *value *= keep;
            }
        }
        self.strength *= keep;
        for axis in 0..6 {
            let (by_mass, by_floor) = (weight * self.inverse_mass[axis], weight * self.inverse_floor[axis]);
            for j in 0..PARAMETERS {
                let element = y[(axis, j)];
                // Half of Y is structurally zero.
                if element == 0.0 {
                    continue;
                }
                self.strength[j] += by_floor * self.reach[j] * element * element;
                for k in 0..=j {
                    self.gram[j][k] += by_mass * element * y[(axis, k)];
                }
            }
        }
    }

    pub(super) fn is_excited(&self, parameter: usize) -> bool {
        self.strength[parameter] >= 1.0
    }

    /// Γ_j = γ / mean(Yᵀ M⁻¹ Y)_jj of what is excited, 0 of what is not and of the known parameter.
    pub(super) fn gains(&self, gamma: f64, known: usize, gains: &mut Theta) {
        for j in 0..PARAMETERS {
            let adapts = j != known && self.is_excited(j) && self.gram[j][j] > 0.0;
            gains[j] = if adapts { gamma / self.gram[j][j] } else { 0.0 };
        }
    }

    /// Σ_j Γ_j (Yᵀ M⁻¹ Y)_jj, the trace of M⁻¹ Y Γ Yᵀ and so an upper bound of its eigenvalues, 1/s².
    pub(super) fn stiffness(&self, y: &Regressor, gains: &Theta) -> f64 {
        let mut trace = 0.0;
        for j in 0..PARAMETERS {
            let mut energy = 0.0;
            for axis in 0..6 {
                energy += self.inverse_mass[axis] * y[(axis, j)] * y[(axis, j)];
            }
            trace += gains[j] * energy;
        }
        trace
    }

    /// The verdict on every parameter: inverts a 21 x 21 matrix, so not for every sample.
    pub(super) fn assess(&self, known: usize, excitation: &mut Excitation) {
        let mut correlation = [[0.0; PARAMETERS]; PARAMETERS];
        let used: [bool; PARAMETERS] =
            core::array::from_fn(|j| j != known && self.is_excited(j) && self.gram[j][j] > 0.0);
        let scale: [f64; PARAMETERS] =
            core::array::from_fn(|j| if used[j] { 1.0 / libm::sqrt(self.gram[j][j]) } else { 0.0 });
        for j in 0..PARAMETERS {
            for k in 0..j {
                let value = self.gram[j][k] * scale[j] * scale[k];
                correlation[j][k] = value;
                correlation[k][j] = value;
            }
            correlation[j][j] = 1.0 + RIDGE;
        }
        invert(&mut correlation);
        for j in 0..PARAMETERS {
            let strength = libm::sqrt(self.strength[j]);
            excitation[j] = if j == known {
                ParameterExcitation { visibility: Visibility::Known, strength, independent: 1.0 }
            } else if used[j] {
                // 1 − R² of the regression of this column on all others; rounding may take it below zero.
                let share = 1.0 / correlation[j][j] - RIDGE;
                let independent = if share > 0.0 { share } else { 0.0 };
                let visibility = if independent < INDEPENDENT { Visibility::Collinear } else { Visibility::Separate };
                ParameterExcitation { visibility, strength, independent }
            } else {
                ParameterExcitation { strength, ..ParameterExcitation::NONE }
            };
        }
    }
}

/// Nothing is known about any parameter.
pub(super) const UNKNOWN: Excitation = [ParameterExcitation::NONE; PARAMETERS];

/// Inverse of a symmetric positive definite matrix in place, by Gauss-Jordan: no pivot is smaller than the ridge.
fn invert(a: &mut [[f64; PARAMETERS]; PARAMETERS]) {
    for pivot in 0..PARAMETERS {
        let inverse = 1.0 / a[pivot][pivot];
        let mut row = a[pivot];
        row[pivot] = 1.0;
        for value in &mut row {
            *value *= inverse;
        }
        for i in 0..PARAMETERS {
            if i == pivot {
                continue;
            }
            let factor = a[i][pivot];
            a[i][pivot] = 0.0;
            for j in 0..PARAMETERS {
                a[i][j] -= factor * row[j];
            }
        }
        a[pivot] = row;
    }
}
