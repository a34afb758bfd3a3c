//! The few products of 12 by 12 matrices that a step needs, four numbers at a time. Nothing depends on the position, so that
//! the first three columns of the model's Jacobian, and of its powers, are zero and left out.

use backseat_core::state::PHI;
use wide::f64x4;

/// A row of four times `W` numbers.
pub(crate) type Row<const W: usize> = [f64x4; W];

/// A square matrix, row by row.
pub(crate) type Square = [Row<3>; 12];

pub(crate) const ZERO: Square = [[f64x4::ZERO; 3]; 12];

/// The matrix of these elements.
pub(crate) fn square(element: impl Fn(usize, usize) -> f64) -> Square {
    std::array::from_fn(|i| row(&std::array::from_fn(|j| element(i, j))))
}

#[inline]
pub(crate) fn row(elements: &[f64; 12]) -> Row<3> {
    std::array::from_fn(|four| f64x4::new(std::array::from_fn(|j| elements[4 * four + j])))
}

/// One number of a row.
#[inline]
pub(crate) fn at<const W: usize>(row: &Row<W>, j: usize) -> f64 {
    row[j / 4].as_array()[j % 4]
}

/// See [`at`].
#[inline]
pub(crate) fn at_mut<const W: usize>(row: &mut Row<W>, j: usize) -> &mut f64 {
    &mut row[j / 4].as_mut_array()[j % 4]
}

/// to += factor row.
#[inline]
pub(crate) fn add_times<const W: usize>(to: &mut Row<W>, factor: f64, row: &Row<W>) {
    for (to, four) in to.iter_mut().zip(row) {
        *to += *four * factor;
    }
}

/// Number by number.
#[inline]
pub(crate) fn multiply<const W: usize>(to: &mut Row<W>, by: &Row<W>) {
    for (to, four) in to.iter_mut().zip(by) {
        *to *= *four;
    }
}

/// a b, where a has no columns of the position, or b no rows of it.
#[inline]
pub(crate) fn times<const W: usize>(a: &Square, b: &[Row<W>; 12]) -> [Row<W>; 12] {
    std::array::from_fn(|i| {
        let mut product = [f64x4::ZERO; W];
        for k in PHI..12 {
            add_times(&mut product, at(&a[i], k), &b[k]);
        }
        product
    })
}

/// to ← (I + d) to, where d has no columns of the position.
#[inline]
pub(crate) fn add_product<const W: usize>(d: &Square, to: &mut [Row<W>; 12]) {
    let product = times(d, to);
    for (to, addend) in to.iter_mut().zip(&product) {
        add_times(to, 1.0, addend);
    }
}

/// a x by aᵀ, row by row, without those that x does not need.
#[inline]
pub(crate) fn apply_turned(turned: &Square, x: &[f64; 12]) -> [f64; 12] {
    let mut product = [f64x4::ZERO; 3];
    for (row, factor) in turned.iter().zip(x) {
        if *factor != 0.0 {
            add_times(&mut product, *factor, row);
        }
    }
    std::array::from_fn(|i| at(&product, i))
}

/// p ← (I + d) p (I + d)ᵀ = p + d p + (d p)ᵀ + (d p) dᵀ for a symmetric p, where d has no columns of the position. No reading
/// corrects what rounding leaves between p and pᵀ, and a vehicle whose heading is unstable doubles it: blocks above the
/// diagonal are computed, those below are their mirror.
pub(crate) fn propagate(d: &Square, p: &mut Square) {
    let moved = times(d, p);
    let (turned, mirrored) = (transpose(d), transpose(&moved));
    for (i, row) in p.iter_mut().enumerate() {
        for four in i / 4..3 {
            let mut sum = row[four] + moved[i][four] + mirrored[i][four];
            for k in PHI..12 {
                sum += turned[k][four] * at(&moved[i], k);
            }
            row[four] = sum;
        }
    }
    for i in 0..3 {
        for j in i..3 {
            let mirror = transposed_block(p, i, j);
            for (k, line) in mirror.into_iter().enumerate() {
                p[4 * j + k][i] = if i == j { (p[4 * j + k][i] + line) * 0.5 } else { line };
            }
        }
    }
}

/// aᵀ.
#[inline]
pub(crate) fn transpose(a: &Square) -> Square {
    let mut turned = ZERO;
    for i in 0..3 {
        for j in 0..3 {
            for (k, line) in transposed_block(a, i, j).into_iter().enumerate() {
                turned[4 * j + k][i] = line;
            }
        }
    }
    turned
}

/// The transpose of the block of four rows and columns that is the i-th down and the j-th across.
#[inline]
fn transposed_block(a: &Square, i: usize, j: usize) -> [f64x4; 4] {
    f64x4::transpose(std::array::from_fn(|k| a[4 * i + k][j]))
}
