//! Normal equations of e = A θ + noise, and what they were at earlier times.

use super::columns::COLUMNS;

/// Numbers of a triangle of so many rows.
pub(super) const fn packed(rows: usize) -> usize {
    rows * (rows + 1) / 2
}

/// A symmetric or lower triangular matrix by rows, diagonal included.
#[derive(Clone)]
pub(super) struct Triangle<const PACKED: usize>(pub(super) [f64; PACKED]);

impl<const PACKED: usize> Triangle<PACKED> {
    pub(super) const ZERO: Self = Self([0.0; PACKED]);

    /// Row `i` up to its diagonal.
    pub(super) fn row(&self, i: usize) -> &[f64] {
        self.0.get(packed(i)..).and_then(|rest| rest.get(..=i)).unwrap_or_default()
    }

    pub(super) fn row_mut(&mut self, i: usize) -> &mut [f64] {
        self.0.get_mut(packed(i)..).and_then(|rest| rest.get_mut(..=i)).unwrap_or_default()
    }

    /// Entry (i, j), whichever is larger.
    pub(super) fn at(&self, i: usize, j: usize) -> f64 {
        let (i, j) = if i > j { (i, j) } else { (j, i) };
        self.row(i).get(j).copied().unwrap_or(0.0)
    }
}

/// AᵀA, Aᵀe.
#[derive(Clone)]
pub(super) struct Sums {
    pub(super) information: Triangle<{ packed(COLUMNS) }>,
    pub(super) score: [f64; COLUMNS],
}

impl Sums {
    pub(super) const NONE: Self = Self { information: Triangle::ZERO, score: [0.0; COLUMNS] };

    /// One normalised innovation `e` and its row of A.
    pub(super) fn take(&mut self, row: &[f64; COLUMNS], e: f64) {
        for (i, (a, score)) in row.iter().zip(&mut self.score).enumerate() {
            *score += a * e;
            if *a != 0.0 {
                for (sum, other) in self.information.row_mut(i).iter_mut().zip(row) {
                    *sum += a * other;
                }
            }
        }
    }

    /// These less earlier ones: (AᵀA − …) v.
    pub(super) fn times_since(&self, earlier: &Self, v: &Direction) -> [f64; COLUMNS] {
        let mut product = [0.0; COLUMNS];
        for &(column, weight) in v {
            if weight != 0.0 {
                for (i, sum) in product.iter_mut().enumerate() {
                    *sum += weight * (self.information.at(i, column) - earlier.information.at(i, column));
                }
            }
        }
        product
    }

    /// These less earlier ones: vᵀ Aᵀe.
    pub(super) fn score_since(&self, earlier: &Self, v: &Direction) -> f64 {
        let since = |column: usize| {
            let of = |sums: &Self| sums.score.get(column).copied().unwrap_or(0.0);
            of(self) - of(earlier)
        };
        v.iter().map(|&(column, weight)| weight * since(column)).sum()
    }
}

/// A direction in θ: columns and weights. A ramp that begins at t₀ is the ramp's column less t₀ times the step's.
pub(super) type Direction = [(usize, f64); 2];

/// vᵀ a.
pub(super) fn along(v: &Direction, a: &[f64; COLUMNS]) -> f64 {
    v.iter().map(|&(column, weight)| weight * a.get(column).copied().unwrap_or(0.0)).sum()
}
