//! The plain way: nalgebra's dense matrices with all N states, by value, as a textbook has it.

use nalgebra::{Cholesky, SMatrix, SVector};

type Square<const N: usize> = SMatrix<f64, N, N>;

/// Φ and Q_d of the vehicle by Van Loan's matrix exponential (24 x 24, Taylor series of order 8 after scaling).
#[inline(never)]
pub fn van_loan(f: &Square<12>, psd: &[f64; 6], step_s: f64) -> (Square<12>, Square<12>) {
    let mut a = Square::<24>::zeros();
    a.fixed_view_mut::<12, 12>(0, 0).copy_from(&(-f * step_s));
    a.fixed_view_mut::<12, 12>(12, 12).copy_from(&(f.transpose() * step_s));
    for (i, psd) in psd.iter().enumerate() {
        a[(6 + i, 18 + i)] = psd * step_s;
    }
    let mut norm = a.column_iter().map(|column| column.lp_norm(1)).fold(0.0, f64::max);
    let mut squarings = 0;
    while norm > 0.5 && squarings < 30 {
        norm *= 0.5;
        a *= 0.5;
        squarings += 1;
    }
    let mut sum = Square::<24>::identity();
    let mut term = Square::<24>::identity();
    for k in 1..=8 {
        term = term * a / f64::from(k);
        sum += term;
    }
    for _ in 0..squarings {
        sum = sum * sum;
    }
    let phi = sum.fixed_view::<12, 12>(12, 12).transpose();
    let q = phi * sum.fixed_view::<12, 12>(0, 12);
    (phi, q)
}

/// Φ P Φᵀ + Q.
#[inline(never)]
pub fn propagate<const N: usize>(p: &mut Square<N>, phi: &Square<N>, q: &Square<N>) {
    *p = phi * *p * phi.transpose() + q;
}

/// x, P by a measurement of M scalars in Joseph form.
#[inline(never)]
pub fn update<const N: usize, const M: usize>(
    x: &mut SVector<f64, N>,
    p: &mut Square<N>,
    h: &SMatrix<f64, M, N>,
    r: &SMatrix<f64, M, M>,
    innovation: &SVector<f64, M>,
) -> bool {
    let g = *p * h.transpose();
    let s = h * g + r;
    let Some(factor) = Cholesky::new(s) else { return false };
    let k = factor.solve(&g.transpose()).transpose();
    *x += k * innovation;
    let rest = Square::<N>::identity() - k * h;
    *p = rest * *p * rest.transpose() + k * r * k.transpose();
    true
}

/// T P Tᵀ, with T the identity above the rows of the clone.
#[inline(never)]
pub fn append<const N: usize, const L: usize>(p: &Square<N>, t: &SMatrix<f64, L, N>) -> Square<L> {
    t * *p * t.transpose()
}
