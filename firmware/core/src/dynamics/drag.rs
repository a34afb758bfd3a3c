//! Drag D(v) v: quadratic (3.7, corrected: positive definite), off-diagonal (4.21), linear surge.

use super::VehicleParameters;
use nalgebra::{Matrix6, Vector6};

/// D(v) v, on the left of (3.2): opposes motion. N and N m.
#[must_use]
pub fn drag(parameters: &VehicleParameters, velocity: &Vector6<f64>) -> Vector6<f64> {
    let d = &parameters.quadratic_diag;
    let (d26, d35) = (parameters.d26, parameters.d35);
    // |v| v of every axis.
    let [u, v, w, p, q, r] = velocity.data.0[0].map(|component| component.abs() * component);
    Vector6::new(
        d[0] * u + parameters.linear_surge_ns_per_m * velocity[0],
        d[1] * v + d26 * r,
        d[2] * w + d35 * q,
        d[3] * p,
        d[4] * q + d35 * w,
        d[5] * r + d26 * v,
    )
}

/// Subtracts ∂(D(v) v)/∂v; d(|v| v)/dv = 2 |v| also at rest.
pub(super) fn subtract_drag_by_velocity(
    parameters: &VehicleParameters,
    velocity: &Vector6<f64>,
    jacobian: &mut Matrix6<f64>,
) {
    let d = &parameters.quadratic_diag;
    let [u, v, w, p, q, r] = velocity.data.0[0].map(|component| 2.0 * component.abs());
    jacobian[(0, 0)] -= d[0] * u + parameters.linear_surge_ns_per_m;
    jacobian[(1, 1)] -= d[1] * v;
    jacobian[(1, 5)] -= parameters.d26 * r;
    jacobian[(2, 2)] -= d[2] * w;
    jacobian[(2, 4)] -= parameters.d35 * q;
    jacobian[(3, 3)] -= d[3] * p;
    jacobian[(4, 4)] -= d[4] * q;
    jacobian[(4, 2)] -= parameters.d35 * w;
    jacobian[(5, 5)] -= d[5] * r;
    jacobian[(5, 1)] -= parameters.d26 * v;
}

/// Largest |d26| (of d22, d66) or |d35| (of d33, d55) for which drag takes energy out of every motion.
///
/// The drag power of a coupled pair with speeds a and b is d_a a³ + d_b b³ ± d_ab (a b² + a² b);
/// with the sign that feeds the motion and t = a/b it stays positive while
/// |d_ab| ≤ (d_a t³ + d_b)/(t² + t) for all t > 0. The minimum of the right-hand side lies at the only
/// positive root of t⁴ + 2t³ − 2κt − κ, κ = d_b/d_a. 98.8 for the reference vehicle's d26.
///
/// Both arguments must be positive.
#[must_use]
pub fn cross_drag_limit(d_a: f64, d_b: f64) -> f64 {
    let kappa = d_b / d_a;
    // The quartic is convex for t > 0 and not negative at max(1, κ): Newton falls monotonically
    // on the root, by a quarter a step at first.
    let mut t = if kappa > 1.0 { kappa } else { 1.0 };
    for _ in 0..100 {
        let value = ((t + 2.0) * t * t - 2.0 * kappa) * t - kappa;
        let slope = (4.0 * t + 6.0) * t * t - 2.0 * kappa;
        let next = t - value / slope;
        if next.is_nan() || next >= t {
            break;
        }
        t = next;
    }
    (d_a * t * t * t + d_b) / (t * t + t)
}
