//! Solution of small dense linear systems without a reachable panic.

use nalgebra::SMatrix;

/// Solves `a` X = B in place for each right-hand side by Gaussian elimination with partial pivoting; `a` is
/// destroyed. False when `a` is singular to working precision or not finite.
///
/// The pivot rises to its place by exchanging neighbours: the same pivots as with an index, but every index
/// is a loop counter, so that no bound can be violated.
#[must_use]
pub(super) fn solve_in_place<const N: usize, const C: usize, const K: usize>(
    a: &mut SMatrix<f64, N, N>,
    mut rhs: [&mut SMatrix<f64, N, C>; K],
) -> bool {
    for k in 0..N {
        for i in k + 1..N {
            if a[(i, k)].abs() > a[(k, k)].abs() {
                for j in k..N {
                    let upper = a[(k, j)];
                    a[(k, j)] = a[(i, j)];
                    a[(i, j)] = upper;
                }
                for b in &mut rhs {
                    for j in 0..C {
                        let upper = b[(k, j)];
                        b[(k, j)] = b[(i, j)];
                        b[(i, j)] = upper;
                    }
                }
            }
        }
        let pivot = a[(k, k)];
        if !pivot.is_finite() || pivot.abs() < f64::MIN_POSITIVE {
            return false;
        }
        for i in k + 1..N {
            let factor = a[(i, k)] / pivot;
            for j in k + 1..N {
                let upper = a[(k, j)];
                a[(i, j)] -= factor * upper;
            }
            for b in &mut rhs {
                for j in 0..C {
                    let upper = b[(k, j)];
                    b[(i, j)] -= factor * upper;
                }
            }
        }
    }
    for k in (0..N).rev() {
        let pivot = a[(k, k)];
        for b in &mut rhs {
            for j in 0..C {
                let mut sum = b[(k, j)];
                for i in k + 1..N {
                    sum -= a[(k, i)] * b[(i, j)];
                }
                b[(k, j)] = sum / pivot;
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::solve_in_place;
    use nalgebra::{Matrix3, SMatrix, Vector3};

    #[test]
    fn solves_a_system_that_needs_pivoting() {
        let a = Matrix3::new(0.0, 2.0, 1.0, 1.0, -2.0, -3.0, -1.0, 1.0, 2.0);
        let x = Vector3::new(1.0, -2.0, 3.0);
        let (mut work, mut b) = (a, a * x);
        assert!(solve_in_place(&mut work, [&mut b]));
        // Integers below 10 and a condition number of about 30: a few units in the last place.
        assert!((b - x).amax() < 1e-14);
    }

    #[test]
    fn refuses_singular_and_nan() {
        let mut singular = SMatrix::<f64, 2, 2>::new(1.0, 1.0, 1.0, 1.0);
        assert!(!solve_in_place(&mut singular, [&mut SMatrix::<f64, 2, 1>::zeros()]));
        let mut nan = SMatrix::<f64, 2, 2>::new(f64::NAN, 1.0, 1.0, 1.0);
        assert!(!solve_in_place(&mut nan, [&mut SMatrix::<f64, 2, 1>::zeros()]));
    }
}
