//! The few products of 12 by 12 matrices that a step needs. Nothing depends on the position, so that the first three
//! columns of the model's Jacobian, and of its powers, are zero and left out.

use backseat_core::state::PHI;

/// A square matrix, row by row.
pub(crate) type Square = [[f64; 12]; 12];

pub(crate) const ZERO: Square = [[0.0; 12]; 12];

/// a b, where a has no columns of the position, or b no rows of it; b may be wider or narrower than 12.
#[inline]
pub(crate) fn times<const WIDTH: usize>(a: &Square, b: &[[f64; WIDTH]; 12]) -> [[f64; WIDTH]; 12] {
    let mut product = [[0.0; WIDTH]; 12];
    for i in 0..12 {
        for k in PHI..12 {
            for j in 0..WIDTH {
                product[i][j] += a[i][k] * b[k][j];
            }
        }
    }
    product
}

/// Adds to `to`.
#[inline]
pub(crate) fn add<const WIDTH: usize>(to: &mut [[f64; WIDTH]; 12], addend: &[[f64; WIDTH]; 12]) {
    for i in 0..12 {
        for j in 0..WIDTH {
            to[i][j] += addend[i][j];
        }
    }
}

/// a x by aᵀ, row by row, without those that x does not need.
#[inline]
pub(crate) fn apply_turned(turned: &Square, x: &[f64; 12]) -> [f64; 12] {
    let mut product = [0.0; 12];
    for (row, factor) in turned.iter().zip(x) {
        if *factor != 0.0 {
            for i in 0..12 {
                product[i] += row[i] * factor;
            }
        }
    }
    product
}

/// aᵀ.
#[inline]
pub(crate) fn transpose(a: &Square) -> Square {
    let mut turned = ZERO;
    for i in 0..12 {
        for j in 0..12 {
            turned[j][i] = a[i][j];
        }
    }
    turned
}
