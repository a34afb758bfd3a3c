//! The plant as a linear function of θ: Y(a, v, s, ξ) θ = h.
//!
//! Y θ = M a + ad(v) M v + d ∘ |v| ∘ v − [w s; B x s] − G_a β: the wrench that is missing for acceleration a. On the
//! right stands h, what the declared vehicle has beyond θ ([`known_wrench`], zero for the thesis' plant).

use super::theta::{B1, BETA1, D11, M11, PARAMETERS, W};
use crate::dynamics::{ActuatorInput, VehicleParameters};
use nalgebra::{SMatrix, Vector3, Vector6};

/// Y, 6 x 21: rows are the axes of body force and moment, columns the parameters of θ.
pub type Regressor = SMatrix<f64, 6, PARAMETERS>;

/// G_a(v, ξ) of (4.37), from [`crate::dynamics::VehicleModel::actuator_regressor`].
pub type ActuatorRegressor = SMatrix<f64, 6, 5>;

/// Y(a, v, s, ξ), written into `y`; s = Rᵀ e3 ([`crate::dynamics::Attitude::down`]), `g_a` = G_a(v, ξ).
pub fn regressor(a: &Vector6<f64>, v: &Vector6<f64>, s: &Vector3<f64>, g_a: &ActuatorRegressor, y: &mut Regressor) {
    y.fill(0.0);
    let [u, v_, w, p, q, r] = v.data.0[0];
    for axis in 0..6 {
        y[(axis, M11 + axis)] = a[axis];
        y[(axis, D11 + axis)] = v[axis].abs() * v[axis];
        for column in 0..5 {
            y[(axis, BETA1 + column)] = -g_a[(axis, column)];
        }
    }
    // ad(v) M v, column by column.
    y[(1, M11)] = r * u;
    y[(2, M11)] = -q * u;
    y[(4, M11)] = w * u;
    y[(5, M11)] = -u * v_;
    y[(0, M11 + 1)] = -r * v_;
    y[(2, M11 + 1)] = p * v_;
    y[(3, M11 + 1)] = -v_ * w;
    y[(5, M11 + 1)] = u * v_;
    y[(0, M11 + 2)] = q * w;
    y[(1, M11 + 2)] = -p * w;
    y[(3, M11 + 2)] = v_ * w;
    y[(4, M11 + 2)] = -w * u;
    y[(4, M11 + 3)] = r * p;
    y[(5, M11 + 3)] = -p * q;
    y[(3, M11 + 4)] = -q * r;
    y[(5, M11 + 4)] = p * q;
    y[(3, M11 + 5)] = q * r;
    y[(4, M11 + 5)] = -r * p;
    // −[w s; B x s].
    for axis in 0..3 {
        y[(axis, W)] = -s[axis];
    }
    y[(4, B1)] = s.z;
    y[(5, B1)] = -s.y;
    y[(3, B1 + 1)] = -s.z;
    y[(5, B1 + 1)] = s.x;
    y[(3, B1 + 2)] = s.y;
    y[(4, B1 + 2)] = -s.x;
}

/// The columns of d26 and d35 (4.21), 6 x 2, which NBLS adds to Y.
#[must_use]
pub fn cross_drag_columns(v: &Vector6<f64>) -> SMatrix<f64, 6, 2> {
    let square = |axis: usize| v[axis].abs() * v[axis];
    let mut columns = SMatrix::zeros();
    columns[(1, 0)] = square(5);
    columns[(5, 0)] = square(1);
    columns[(2, 1)] = square(4);
    columns[(4, 1)] = square(2);
    columns
}

/// h(v, ξ): the applied wrench of what the vehicle has beyond θ, N and N m: linear surge drag, advance of the propeller,
/// cross drag, lift and moments of the hull, at their declared values.
#[must_use]
pub fn known_wrench(parameters: &VehicleParameters, v: &Vector6<f64>, input: &ActuatorInput) -> Vector6<f64> {
    let [u, v_, w, _, q, r] = v.data.0[0].map(|component| component.abs() * component);
    let (d26, d35) = (parameters.d26, parameters.d35);
    let advance = parameters.advance_n_s2_per_rad_m * input.propeller_radps;
    let surge = -(parameters.linear_surge_ns_per_m + advance) * v[0];
    let lift = parameters.z_uw * v[0].abs() * v[2];
    let [k, m, n] = parameters.moment_uu.map(|moment_uu| moment_uu * u);
    let torque = parameters.torque_arm_m * advance * v[0];
    Vector6::new(surge, -d26 * r, lift - d35 * q, k + torque, m - d35 * w, n - d26 * v_)
}
