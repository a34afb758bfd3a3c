//! Normal equations of segments that share unknowns and each have a start of their own.
//!
//! Schur's complement takes the starts out segment by segment, so that Gauss-Newton steps are solved in the shared
//! unknowns alone.

use crate::simulation::{OUTPUTS, Output};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};

/// What one segment says of its `ALL` unknowns: `SHARED` that all segments have, then its start.
#[derive(Clone)]
pub(crate) struct Bordered<const ALL: usize, const SHARED: usize> {
    /// Jᵀ W J.
    normal: SMatrix<f64, ALL, ALL>,
    /// Jᵀ W r.
    gradient: SVector<f64, ALL>,
}

impl<const ALL: usize, const SHARED: usize> Bordered<ALL, SHARED> {
    /// The sum over rows that `add` takes: sensitivities of an output to all unknowns, its weight and residual.
    pub fn sum(rows: impl FnOnce(&mut dyn FnMut(&[f64; ALL], f64, f64))) -> Self {
        let mut sum = Self { normal: SMatrix::zeros(), gradient: SVector::zeros() };
        rows(&mut |row, weight, residual| {
            // Row by row, contiguous: the compiler takes several elements at a time.
            for (j, (column, element)) in sum.normal.data.0.iter_mut().zip(row).enumerate() {
                let factor = weight * element;
                for (sum, other) in column[..=j].iter_mut().zip(row) {
                    *sum += factor * other;
                }
                sum.gradient[j] += factor * residual;
            }
        });
        sum.normal.fill_lower_triangle_with_upper_triangle();
        sum
    }

    /// Inverse of the block of the start, damped.
    fn start_inverse(&self, damping: f64) -> SMatrix<f64, OUTPUTS, OUTPUTS> {
        let mut block = self.normal.fixed_view::<OUTPUTS, OUTPUTS>(SHARED, SHARED).into_owned();
        for i in 0..OUTPUTS {
            block[(i, i)] *= 1.0 + damping + 1.0e-12;
        }
        block.cholesky().map_or_else(SMatrix::zeros, |factor| factor.inverse())
    }

    /// By how much the start moves with this change of the shared unknowns.
    pub fn start_step(&self, change: &SVector<f64, SHARED>, damping: f64) -> Output {
        let across = self.normal.fixed_view::<OUTPUTS, SHARED>(SHARED, 0);
        self.start_inverse(damping) * (self.gradient.fixed_rows::<OUTPUTS>(SHARED) - across * change)
    }

    /// Matrix and right-hand side of these of the shared unknowns, the start taken out.
    fn reduced(&self, unknowns: &[usize], damping: f64) -> (DMatrix<f64>, DVector<f64>) {
        let across = self.normal.fixed_view::<SHARED, OUTPUTS>(0, SHARED).into_owned();
        let gain = across * self.start_inverse(damping);
        let full = self.normal.fixed_view::<SHARED, SHARED>(0, 0) - gain * across.transpose();
        let right = self.gradient.fixed_rows::<SHARED>(0) - gain * self.gradient.fixed_rows::<OUTPUTS>(SHARED);
        let n = unknowns.len();
        (
            DMatrix::from_fn(n, n, |i, j| full[(unknowns[i], unknowns[j])]),
            DVector::from_fn(n, |i, _| right[unknowns[i]]),
        )
    }

    /// The damped Gauss-Newton step of these unknowns, zero in all others. `ridge` is the information of their priors,
    /// `right` the priors' right-hand side.
    pub fn step<'a>(
        parts: impl Iterator<Item = &'a Self>,
        unknowns: &[usize],
        ridge: &DVector<f64>,
        mut right: DVector<f64>,
        damping: f64,
    ) -> Option<SVector<f64, SHARED>> {
        let mut matrix = DMatrix::from_diagonal(ridge);
        for part in parts {
            let (of_part, by_part) = part.reduced(unknowns, damping);
            matrix += of_part;
            right += by_part;
        }
        for i in 0..unknowns.len() {
            matrix[(i, i)] *= 1.0 + damping;
        }
        // the unknowns differ by orders of magnitude
        let scale = matrix.diagonal().map(|d| 1.0 / d.max(f64::MIN_POSITIVE).sqrt());
        let step = scaled(&matrix, &scale).cholesky()?.solve(&right.component_mul(&scale)).component_mul(&scale);
        let mut change = SVector::zeros();
        for (&at, value) in unknowns.iter().zip(step.iter()) {
            change[at] = *value;
        }
        Some(change)
    }

    /// Covariance of these unknowns by the information, and the one that takes the segments' gradients as they scatter,
    /// which holds with coloured residuals too.
    pub fn covariances<'a>(
        parts: impl Iterator<Item = &'a Self>,
        unknowns: &[usize],
        ridge: &DVector<f64>,
    ) -> Option<[DMatrix<f64>; 2]> {
        let mut matrix = DMatrix::from_diagonal(ridge);
        let mut scatter = DMatrix::zeros(unknowns.len(), unknowns.len());
        for part in parts {
            let (of_part, gradient) = part.reduced(unknowns, 0.0);
            matrix += of_part;
            scatter += &gradient * gradient.transpose();
        }
        let scale = matrix.diagonal().map(|d| 1.0 / d.sqrt());
        let inverse = scaled(&scaled(&matrix, &scale).cholesky()?.inverse(), &scale);
        let robust = &inverse * scatter * &inverse;
        Some([inverse, robust])
    }
}

fn scaled(matrix: &DMatrix<f64>, scale: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * scale[i] * scale[j])
}
