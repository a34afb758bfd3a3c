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
