//! Zero-order hold of ẋ = f + F (x − x*) by plain dense series, summed until rounding stops them.

use nalgebra::{SMatrix, SVector};

/// Terms that every series here needs at ‖F‖ h up to 3 are fewer.
const MOST_TERMS: u32 = 60;
/// The integral of the noise starts with h³ where it enters two integrations later.
const LEAST_TERMS: u32 = 6;

/// Φ⁻¹ = e^{−F h}.
pub(super) fn inverse_transition<const N: usize>(jacobian: &SMatrix<f64, N, N>, h: f64) -> SMatrix<f64, N, N> {
    series(SMatrix::identity(), |term, k| jacobian * term * (-h / k))
}

/// ∫ e^{F s} ds a.
pub(super) fn integral<const N: usize>(jacobian: &SMatrix<f64, N, N>, a: SVector<f64, N>, h: f64) -> SVector<f64, N> {
    series(a * h, |term, k| jacobian * term * (h / (k + 1.0)))
}

/// Q_d = ∫ e^{F s} Q e^{F s}ᵀ ds: the derivatives of the integrand at 0 are X → F X + X Fᵀ, repeated.
pub(super) fn noise<const N: usize>(
    jacobian: &SMatrix<f64, N, N>,
    q: SMatrix<f64, N, N>,
    h: f64,
) -> SMatrix<f64, N, N> {
    series(q * h, |term, k| {
        let half = jacobian * term;
        (half + half.transpose()) * (h / (k + 1.0))
    })
}

/// a + next(a, 1) + next(next(a, 1), 2) + …
fn series<const N: usize, const C: usize>(
    first: SMatrix<f64, N, C>,
    next: impl Fn(&SMatrix<f64, N, C>, f64) -> SMatrix<f64, N, C>,
) -> SMatrix<f64, N, C> {
    let (mut term, mut sum) = (first, first);
    for k in 1..MOST_TERMS {
        term = next(&term, f64::from(k));
        sum += term;
        if k >= LEAST_TERMS && term.amax() < 1e-3 * f64::EPSILON * sum.amax() {
            break;
        }
    }
    sum
}
