//! The plant written down a second time, straight from the matrix form of the equations.
//!
//! Nothing is simplified: rotations are products of elementary rotations, ad(v) is the 6 x 6 matrix,
//! Euler rates solve the corrected (2.30), every fin is worked out in its own turned frame with explicit wind
//! axes. Generic over the number, so that dual numbers give exact derivatives.

use super::dual::Scalar;
use backseat_core::dynamics::VehicleParameters;

type Vec3<S> = [S; 3];
type Mat3<S> = [[S; 3]; 3];

fn cross<S: Scalar>(a: Vec3<S>, b: Vec3<S>) -> Vec3<S> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot<S: Scalar>(a: Vec3<S>, b: Vec3<S>) -> S {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn apply<S: Scalar>(m: &Mat3<S>, a: Vec3<S>) -> Vec3<S> {
    m.map(|row| dot(row, a))
}

fn transpose<S: Scalar>(m: &Mat3<S>) -> Mat3<S> {
    [0, 1, 2].map(|i| [m[0][i], m[1][i], m[2][i]])
}

fn product<S: Scalar>(a: &Mat3<S>, b: &Mat3<S>) -> Mat3<S> {
    let columns = transpose(b);
    a.map(|row| columns.map(|column| dot(row, column)))
}

fn skew<S: Scalar>(a: Vec3<S>) -> Mat3<S> {
    let zero = S::from(0.0);
    [[zero, -a[2], a[1]], [a[2], zero, -a[0]], [-a[1], a[0], zero]]
}

fn about_x<S: Scalar>(angle: S) -> Mat3<S> {
    let (zero, one) = (S::from(0.0), S::from(1.0));
    [[one, zero, zero], [zero, angle.cos(), -angle.sin()], [zero, angle.sin(), angle.cos()]]
}

fn about_y<S: Scalar>(angle: S) -> Mat3<S> {
    let (zero, one) = (S::from(0.0), S::from(1.0));
    [[angle.cos(), zero, angle.sin()], [zero, one, zero], [-angle.sin(), zero, angle.cos()]]
}

fn about_z<S: Scalar>(angle: S) -> Mat3<S> {
    let (zero, one) = (S::from(0.0), S::from(1.0));
    [[angle.cos(), -angle.sin(), zero], [angle.sin(), angle.cos(), zero], [zero, zero, one]]
}

/// Solves m x = a by Cramer's rule.
fn solve<S: Scalar>(m: &Mat3<S>, a: Vec3<S>) -> Vec3<S> {
    let [c0, c1, c2] = transpose(m);
    let determinant = dot(c0, cross(c1, c2));
    [dot(a, cross(c1, c2)) / determinant, dot(c0, cross(a, c2)) / determinant, dot(c0, cross(c1, a)) / determinant]
}

/// ẋ = f(x, ξ), ξ = [propeller, top, bottom, port, starboard].
pub fn derivative<S: Scalar>(parameters: &VehicleParameters, x: &[S; 12], xi: &[S; 5]) -> [S; 12] {
    let number = |value: f64| S::from(value);
    let zero = number(0.0);
    let [phi, theta, psi] = [x[3], x[4], x[5]];
    let nu = [x[6], x[7], x[8]];
    let omega = [x[9], x[10], x[11]];
    let v = [nu[0], nu[1], nu[2], omega[0], omega[1], omega[2]];

    let rotation = product(&product(&about_z(psi), &about_y(theta)), &about_x(phi));
    let position = apply(&rotation, nu);
    let body_rates_by_euler_rates = [
        [number(1.0), zero, -theta.sin()],
        [zero, phi.cos(), phi.sin() * theta.cos()],
        [zero, -phi.sin(), phi.cos() * theta.cos()],
    ];
    let euler = solve(&body_rates_by_euler_rates, omega);

    // −ad(v) M v
    let mut adjoint = [[zero; 6]; 6];
    let (of_omega, of_nu) = (skew(omega), skew(nu));
    for i in 0..3 {
        for j in 0..3 {
            adjoint[i][j] = of_omega[i][j];
            adjoint[3 + i][j] = of_nu[i][j];
            adjoint[3 + i][3 + j] = of_omega[i][j];
        }
    }
    let mut wrench = [zero; 6];
    for i in 0..6 {
        for j in 0..6 {
            wrench[i] = wrench[i] - adjoint[i][j] * number(parameters.m_diag[j]) * v[j];
        }
    }

    // −d o |v| o v − off-diagonal (4.21) − linear surge drag
    let square = v.map(|component| component.abs() * component);
    for i in 0..6 {
        wrench[i] = wrench[i] - number(parameters.quadratic_diag[i]) * square[i];
    }
    wrench[0] = wrench[0] - number(parameters.linear_surge_ns_per_m) * v[0];
    for (row, column, d) in
        [(1, 5, parameters.d26), (5, 1, parameters.d26), (2, 4, parameters.d35), (4, 2, parameters.d35)]
    {
        wrench[row] = wrench[row] - number(d) * square[column];
    }

    // What the flow along the hull does to it.
    wrench[2] = wrench[2] + number(parameters.z_uw) * v[0].abs() * v[2];
    for i in 0..3 {
        wrench[3 + i] = wrench[3 + i] + number(parameters.moment_uu[i]) * square[0];
    }

    // [w s; B x s]
    let s = apply(&transpose(&rotation), [zero, zero, number(1.0)]);
    let weight = (parameters.mass_kg - parameters.displaced_mass_kg) * parameters.g_mps2;
    let b = parameters.b_cb_to_cg_m.map(|axis| number(parameters.displaced_mass_kg * parameters.g_mps2 * axis));
    let righting = cross(b, s);
    for i in 0..3 {
        wrench[i] = wrench[i] + number(weight) * s[i];
        wrench[3 + i] = wrench[3 + i] + righting[i];
    }

    // Fins (3.10)-(3.23), corrected.
    for (fin, &delta) in parameters.fins.iter().zip(&xi[1..]) {
        let p = fin.cp_m.map(number);
        let frame = product(&about_x(number(fin.phi_rad)), &about_y(number(fin.gain) * delta));
        let turned = cross(omega, p);
        let [u, _, w] = apply(&transpose(&frame), [nu[0] + turned[0], nu[1] + turned[1], nu[2] + turned[2]]);
        let alpha = w.atan2(u);
        let speed = (u * u + w * w).sqrt();
        let pressure = number(0.5 * parameters.rho_kg_per_m3 * parameters.fin_area_m2) * speed * speed;
        // Held between -stall and stall.
        let stall = number(parameters.stall_rad);
        let held = number(0.5) * ((alpha + stall).abs() - (alpha - stall).abs());
        let lift = pressure * (number(parameters.cl[0]) * held + number(parameters.cl[1]) * held * held * held);
        let drag = pressure * (number(parameters.cd[0]) + number(parameters.cd[1]) * held * held);
        let wind_x = [alpha.cos(), zero, alpha.sin()];
        let wind_z = [-alpha.sin(), zero, alpha.cos()];
        let force = apply(&frame, [0, 1, 2].map(|i| -drag * wind_x[i] - lift * wind_z[i]));
        let moment = cross(p, force);
        for i in 0..3 {
            wrench[i] = wrench[i] + force[i];
            wrench[3 + i] = wrench[3 + i] + moment[i];
        }
    }

    let propeller = xi[0];
    let thrust = number(parameters.beta5_n_s2_per_rad2) * propeller * propeller.abs()
        - number(parameters.advance_n_s2_per_rad_m) * propeller * v[0];
    wrench[0] = wrench[0] + thrust;
    wrench[3] = wrench[3] - number(parameters.torque_arm_m) * thrust;

    let mut x_dot = [zero; 12];
    x_dot[..3].copy_from_slice(&position);
    x_dot[3..6].copy_from_slice(&euler);
    for i in 0..6 {
        x_dot[6 + i] = wrench[i] / number(parameters.m_diag[i]);
    }
    x_dot
}
