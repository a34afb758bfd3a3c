//! Which parameters the motion excites: means of Yᵀ M⁻¹ Y, the gains that follow, and which parameters are frozen.
//!
//! Sensor noise alone fills the columns of Y: on a straight course 4 mm/s of filtered sway are 0.02 rad/s² of the Munk
//! moment. So Y is also evaluated at measurements that are disturbed by one sigma, in one direction per sample. The
//! energy that such disturbances give a column is compared with the column's own.

use super::regressor::Regressor;
use super::theta::{PARAMETERS, Theta};

/// What the recent motion says about one parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visibility {
    /// Held at its declared value: it is the scale.
    Known,
    /// Nothing but noise depends on it: frozen.
    Frozen,
    /// The motion depends on it, but other parameters explain all but a thousandth of its effect, or all but the noise.
    /// It adapts and the prediction improves; its value alone means little.
    Collinear,
    /// Its effect differs from that of all others.
    Separate,
}

/// Excitation of one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterExcitation {
    /// The verdict.
    pub visibility: Visibility,
    /// Effect of an error of half the box on the acceleration, in units of the floor, root mean square. An excited
    /// parameter reaches the floor and twice the noise.
    pub strength: f64,
    /// `strength` that sensor noise alone would give.
    pub noise: f64,
    /// Share of its effect's energy that no combination of the other parameters explains.
    pub independent: f64,
}

impl ParameterExcitation {
    const NONE: Self = Self { visibility: Visibility::Frozen, strength: 0.0, noise: 0.0, independent: 0.0 };
}

/// Excitation of every parameter, in the order of θ.
pub type Excitation = [ParameterExcitation; PARAMETERS];

/// A column's energy, and its independent part, must be this many times the noise's.
const ABOVE_NOISE: f64 = 4.0;
/// A smaller independent share may come from rounding or from errors of the model.
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
    /// Mean of Yᵀ M⁻¹ Y, lower triangle by rows.
    gram_matrix: [f64; row_at(PARAMETERS)],
    /// Mean of Σ_i (reach_j Y_ij / (m_i a_i))².
    strength: Theta,
    /// The same of the change of Y under sensor noise.
    noise: Theta,
    /// Time averaged so far, s.
    observed_s: f64,
    /// Memory of the means, s.
    memory_s: f64,
}

/// Where row `j` of a lower triangle begins.
const fn row_at(j: usize) -> usize {
    j * (j + 1) / 2
}

impl ExcitationMonitor {
    pub(super) const fn new() -> Self {
        let zeros = Theta::from_array_storage(nalgebra::ArrayStorage([[0.0; PARAMETERS]]));
        Self {
            inverse_mass: [0.0; 6],
            inverse_floor: [0.0; 6],
            reach: zeros,
            gram_matrix: [0.0; row_at(PARAMETERS)],
            strength: zeros,
            noise: zeros,
            observed_s: 0.0,
            memory_s: 0.0,
        }
    }

    pub(super) fn configure(&mut self, mass: &[f64; 6], floor: &[f64; 6], reach: &Theta, memory_s: f64) {
        for axis in 0..6 {
            let force = mass[axis] * floor[axis];
            self.inverse_mass[axis] = 1.0 / mass[axis];
            self.inverse_floor[axis] = 1.0 / (force * force);
        }
        self.reach = reach.component_mul(reach);
        self.gram_matrix = [0.0; row_at(PARAMETERS)];
        self.strength.fill(0.0);
        self.noise.fill(0.0);
        self.observed_s = 0.0;
        self.memory_s = memory_s;
    }

    /// Mean of Yᵀ M⁻¹ Y, j ≥ k.
    fn gram_matrix(&self, j: usize, k: usize) -> f64 {
        self.gram_matrix.get(row_at(j) + k).copied().unwrap_or(0.0)
    }

    /// Time averaged so far, s.
    pub(super) fn observed_s(&self) -> f64 {
        self.observed_s
    }

    /// Takes Y of one sample that stands for dt, and Y of the same disturbed in one of `directions` directions that
    /// take turns; a plain mean at first, with exponential memory later.
    pub(super) fn observe(&mut self, y: &Regressor, disturbed: &Regressor, directions: f64, dt: f64) {
        self.observed_s += dt;
        let weight = dt / self.observed_s.min(self.memory_s);
        let keep = 1.0 - weight;
        for value in &mut self.gram_matrix {
            *value *= keep;
        }
        self.strength *= keep;
        self.noise *= keep;
        for axis in 0..6 {
            let (by_mass, by_floor) = (weight * self.inverse_mass[axis], weight * self.inverse_floor[axis]);
            for j in 0..PARAMETERS {
                let element = y[(axis, j)];
                let change = disturbed[(axis, j)] - element;
                self.noise[j] += directions * by_floor * self.reach[j] * change * change;
                // Half of Y is structurally zero.
                if element == 0.0 {
                    continue;
                }
                self.strength[j] += by_floor * self.reach[j] * element * element;
                for (k, value) in self.gram_matrix.iter_mut().skip(row_at(j)).take(j + 1).enumerate() {
                    *value += by_mass * element * y[(axis, k)];
                }
            }
        }
    }

    pub(super) fn is_excited(&self, parameter: usize) -> bool {
        self.strength[parameter] >= 1.0 + ABOVE_NOISE * self.noise[parameter]
    }

    /// Γ_j = γ / mean(Yᵀ M⁻¹ Y)_jj of what is excited, 0 of what is not and of the known parameter.
    pub(super) fn gains(&self, gamma: f64, known: usize, gains: &mut Theta) {
        for j in 0..PARAMETERS {
            let adapts = j != known && self.is_excited(j) && self.gram_matrix(j, j) > 0.0;
            gains[j] = if adapts { gamma / self.gram_matrix(j, j) } else { 0.0 };
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
            core::array::from_fn(|j| j != known && self.is_excited(j) && self.gram_matrix(j, j) > 0.0);
        let scale: [f64; PARAMETERS] =
            core::array::from_fn(|j| if used[j] { 1.0 / libm::sqrt(self.gram_matrix(j, j)) } else { 0.0 });
        for j in 0..PARAMETERS {
            for k in 0..j {
                let value = self.gram_matrix(j, k) * scale[j] * scale[k];
                correlation[j][k] = value;
                correlation[k][j] = value;
            }
            correlation[j][j] = 1.0 + RIDGE;
        }
        invert(&mut correlation);
        for j in 0..PARAMETERS {
            let [strength, noise] = [self.strength[j], self.noise[j]].map(libm::sqrt);
            excitation[j] = if j == known {
                ParameterExcitation { visibility: Visibility::Known, strength, noise, independent: 1.0 }
            } else if used[j] {
                // 1 − R² of the regression of this column on all others; rounding may take it below zero.
                let share = 1.0 / correlation[j][j] - RIDGE;
                let independent = if share > 0.0 { share } else { 0.0 };
                let own = independent * self.strength[j];
                let visibility = if independent < INDEPENDENT || own < ABOVE_NOISE * self.noise[j] {
                    Visibility::Collinear
                } else {
                    Visibility::Separate
                };
                ParameterExcitation { visibility, strength, noise, independent }
            } else {
                ParameterExcitation { strength, noise, ..ParameterExcitation::NONE }
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
