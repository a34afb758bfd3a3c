//! How far the correlation matrix is from singular.

extern crate std;

use crate::navigation::*;
use std::vec;
use std::vec::Vec;

/// P_ij / (σ_i σ_j) of the first `n` states.
fn correlation(p: impl Fn(usize, usize) -> f64, n: usize) -> Vec<Vec<f64>> {
    let scale: Vec<f64> = (0..n).map(|i| p(i, i).sqrt()).collect();
    (0..n).map(|i| (0..n).map(|j| p(i, j) / (scale[i] * scale[j])).collect()).collect()
}

/// Smallest pivot of Cholesky's factorisation of the correlation matrix of the first `n` states; the first that is not
/// positive ends it.
pub fn smallest_pivot(p: impl Fn(usize, usize) -> f64, n: usize) -> f64 {
    let mut l = correlation(p, n);
    let mut smallest = f64::INFINITY;
    for j in 0..l.len() {
        let pivot = l[j][j] - (0..j).map(|k| l[j][k] * l[j][k]).sum::<f64>();
        if pivot.is_nan() || pivot <= 0.0 {
            return pivot;
        }
        smallest = smallest.min(pivot);
        let root = pivot.sqrt();
        l[j][j] = root;
        for i in j + 1..l.len() {
            l[i][j] = (l[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>()) / root;
        }
    }
    smallest
}

/// Least and largest eigenvalue of the correlation matrix of the first `n` states, by Jacobi's rotations.
pub fn eigenvalue_range(p: impl Fn(usize, usize) -> f64, n: usize) -> (f64, f64) {
    let mut a = correlation(p, n);
    for _ in 0..30 {
        let off: f64 = (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| a[i][j] * a[i][j]).sum();
        if off < 1.0e-32 {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                if a[p][q] != 0.0 {
                    rotate(&mut a, p, q);
                }
            }
        }
    }
    let diagonal = || (0..n).map(|i| a[i][i]);
    (diagonal().fold(f64::INFINITY, f64::min), diagonal().fold(0.0, f64::max))
}

/// Makes a_pq zero.
fn rotate(a: &mut [Vec<f64>], p: usize, q: usize) {
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = 1.0_f64.copysign(theta) / (theta.abs() + theta.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    let s = t * c;
    for row in a.iter_mut() {
        let (ap, aq) = (row[p], row[q]);
        row[p] = c * ap - s * aq;
        row[q] = s * ap + c * aq;
    }
    let (ap, aq) = (a[p].clone(), a[q].clone());
    let mut turned = vec![0.0; a.len()];
    for k in 0..a.len() {
        a[p][k] = c * ap[k] - s * aq[k];
        turned[k] = s * ap[k] + c * aq[k];
    }
    a[q] = turned;
}

#[test]
fn val_eigenvalues_of_a_filter_that_knows_nothing_of_its_states_together() {
    let mut navigator = std::boxed::Box::new(Navigator::new());
    super::Mission::new().start(&mut navigator);
    let p = |navigator: &Navigator| {
        let filter = navigator.main().clone();
        move |i: usize, j: usize| filter.covariance(i, j)
    };
    // Uncorrelated: the identity.
    assert_eq!(eigenvalue_range(p(&navigator), 22), (1.0, 1.0));
    assert_eq!(smallest_pivot(p(&navigator), 22), 1.0);
    // A clone right away: pairs of equals have 0 and 2.
    navigator.clone_ship().expect("a ship");
    let (least, largest) = eigenvalue_range(p(&navigator), 28);
    // Rounding of a 28 x 28 matrix.
    assert!(least.abs() < 1.0e-14 && (largest - 2.0).abs() < 1.0e-14, "{least} {largest}");
}
