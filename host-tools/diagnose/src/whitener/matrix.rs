//! The few products of 12 by 12 matrices that a step needs: the model's Jacobian is two thirds zeros, and skipping
//! them is three times faster than a dense product.

/// A square matrix, row by row.
pub(crate) type Square = [[f64; 12]; 12];

pub(crate) const ZERO: Square = [[0.0; 12]; 12];

/// a b, skipping the zeros of a.
#[inline]
pub(crate) fn times(a: &Square, b: &Square) -> Square {
    let mut product = ZERO;
    for i in 0..12 {
        let mut row = [0.0; 12];
        for k in 0..12 {
            let factor = a[i][k];
            if factor != 0.0 {
                for j in 0..12 {
                    row[j] += factor * b[k][j];
                }
            }
        }
        product[i] = row;
    }
    product
}

/// (I + d) b, skipping the zeros of d.
#[inline]
pub(crate) fn plus_times(d: &Square, b: &Square) -> Square {
    let mut product = times(d, b);
    for i in 0..12 {
        for j in 0..12 {
            product[i][j] += b[i][j];
        }
    }
    product
}

/// a x.
#[inline]
pub(crate) fn apply(a: &Square, x: &[f64; 12]) -> [f64; 12] {
    let mut product = [0.0; 12];
    for i in 0..12 {
        let mut sum = 0.0;
        for j in 0..12 {
            sum += a[i][j] * x[j];
        }
        product[i] = sum;
    }
    product
}

/// a x by aᵀ, row by row, without those that x does not need: the same sums as [`apply`], in step.
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
