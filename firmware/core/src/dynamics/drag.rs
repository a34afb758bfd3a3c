//! Drag D(v) v: quadratic (3.7, corrected: positive definite), off-diagonal (4.21), linear surge; and what the flow along
//! a hull that is not symmetric does to it: moments with u|u|, lift with |u| w.

use super::VehicleParameters;
use nalgebra::{Matrix6, Vector6};

/// D(v) v, on the left of (3.2): opposes motion. N and N m.
#[must_use]
pub fn drag(parameters: &VehicleParameters, velocity: &Vector6<f64>) -> Vector6<f64> {
    let d = &parameters.quadratic_diag;
    let (d26, d35) = (parameters.d26, parameters.d35);
    let [k_uu, m_uu, n_uu] = parameters.moment_uu;
    let lift = parameters.z_uw * velocity[0].abs() * velocity[2];
    // |v| v of every axis.
    let [u, v, w, p, q, r] = velocity.data.0[0].map(|component| component.abs() * component);
    Vector6::new(
        d[0] * u + parameters.linear_surge_ns_per_m * velocity[0],
        d[1] * v + d26 * r,
        d[2] * w + d35 * q - lift,
        d[3] * p - k_uu * u,
        d[4] * q + d35 * w - m_uu * u,
        d[5] * r + d26 * v - n_uu * u,
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
    for (row, moment_uu) in (3..).zip(parameters.moment_uu) {
        jacobian[(row, 0)] += moment_uu * u;
    }
    let (surge, heave) = (velocity[0], velocity[2]);
    jacobian[(2, 0)] += parameters.z_uw * heave * if surge < 0.0 { -1.0 } else { 1.0 };
    jacobian[(2, 2)] += parameters.z_uw * surge.abs();
}
