//! Near the vertical: steps of the attitude as rotation vectors.
//!
//! At θ = ±90° roll and heading turn about one axis, and Euler rates have no bound. Where the pitch is beyond
//! [`STEEP_RAD`], a step of the filter is therefore taken in δ, a rotation vector in level axes that are turned by
//! the estimated heading: R = Rz(ψ̂) exp(\[δ\]×) Rz(ψ̂)ᵀ R̂. It drifts with δ̇ = Rz(ψ̂)ᵀ R δω, in which nothing is
//! divided by cos θ (F. L. Markley, J. Guidance, Control, and Dynamics 26, 2003, with the error in level axes). Small
//! differences of Euler angles are E δ with
//!
//! ```text
//!   E = [ 1/cos θ  0  0 ]      E⁻¹ = [  cos θ  0  0 ]
//!       [    0     1  0 ]            [    0    1  0 ]
//!       [  tan θ   0  1 ]            [ −sin θ  0  1 ]
//! ```
//!
//! P stays that of Euler angles, for all that reads it. So a step from x̂ to x⁺ ends with P ← T P Tᵀ,
//! T = E(x⁺) Rz(ψ̂ − ψ⁺) E(x̂)⁻¹: that of δ has no singularity, and 1/cos θ, bounded alike in E and E⁻¹, cancels.

use super::cekf::Filter;
use crate::dynamics::{Attitude, Linearisation, MIN_COS_PITCH};
use crate::navigation::algebra::discretisation::Discretisation;
use crate::navigation::algebra::observation::Observations;
use crate::navigation::algebra::observer::{LinearStep, Observer};
use crate::navigation::algebra::propagation::propagate_vehicle;
use crate::navigation::interface::measurement::Sensor;
use crate::state::{self, P, PHI, THETA, VehicleState};
use core::f64::consts::PI;
use nalgebra::{Matrix3, Matrix3x2, Vector3};

/// Pitch beyond which it is taken so, rad: 60°, far from any a mission flies and where Euler angles are still good.
const STEEP_RAD: f64 = PI / 3.0;

/// One sigma of an angle of which nothing is known, rad: uniform over the circle.
const ANY_SIGMA_RAD: f64 = 1.8;

/// Whether a state is steep.
pub(crate) fn is_steep(x: &VehicleState) -> bool {
    x[THETA].abs() > STEEP_RAD
}

/// sin θ and cos θ, which is kept from zero.
fn sin_cos_pitch(euler_rad: &Vector3<f64>) -> (f64, f64) {
    let (sin, cos) = libm::sincos(euler_rad.y);
    (sin, if cos.abs() < MIN_COS_PITCH { MIN_COS_PITCH.copysign(cos) } else { cos })
}

/// Rz of an angle.
fn turned(angle_rad: f64) -> Matrix3<f64> {
    Attitude::new(&Vector3::new(0.0, 0.0, angle_rad)).rotation()
}

/// R with its heading left out.
fn tilt(euler_rad: &Vector3<f64>) -> Matrix3<f64> {
    Attitude::new(&Vector3::new(euler_rad.x, euler_rad.y, 0.0)).rotation()
}

/// The attitude turned by δ, |θ| ≤ 90°, and T.
#[inline(never)]
pub(super) fn turn(from: &Vector3<f64>, delta: &Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    // exp([δ]×) as a unit quaternion
    let angle = libm::sqrt(delta.norm_squared());
    let (half_sin, w) = libm::sincos(0.5 * angle);
    let v = delta * if angle > 0.0 { half_sin / angle } else { 0.5 };
    let by = v.cross_matrix();
    let r = (Matrix3::identity() + (by * w + by * by) * 2.0) * tilt(from);
    let roll = libm::atan2(r[(2, 1)], r[(2, 2)]);
    let pitch = libm::atan2(-r[(2, 0)], libm::hypot(r[(2, 1)], r[(2, 2)]));
    // the heading that goes with this roll, which at the vertical could be any
    let (sin, cos) = libm::sincos(roll);
    let heading = libm::atan2(r[(0, 2)] * sin - r[(0, 1)] * cos, r[(1, 1)] * cos - r[(1, 2)] * sin);
    let to = Vector3::new(roll, pitch, from.z + heading);
    let ((sin_from, cos_from), (sin_to, cos_to)) = (sin_cos_pitch(from), sin_cos_pitch(&to));
    let by_delta = Matrix3::new(1.0 / cos_to, 0.0, 0.0, 0.0, 1.0, 0.0, sin_to / cos_to, 0.0, 1.0);
    let of_delta = Matrix3::new(cos_from, 0.0, 0.0, 0.0, 1.0, 0.0, -sin_from, 0.0, 1.0);
    (to, by_delta * turned(-heading) * of_delta)
}

/// The model with δ in place of Euler angles.
#[inline(never)]
pub(super) fn in_rotation_vector(x: &VehicleState, model: &mut Linearisation) {
    let euler_rad = state::attitude(x);
    let rates = Vector3::new(x[P], x[P + 1], x[P + 2]);
    let velocity = Vector3::new(model.f[0], model.f[1], model.f[2]);
    model.position_by_attitude = -velocity.cross_matrix() * turned(euler_rad.z);
    model.euler_by_roll_pitch = Matrix3x2::zeros();
    model.euler_by_rates = tilt(&euler_rad);
    let (_, cos) = sin_cos_pitch(&euler_rad);
    model.acceleration_by_roll_pitch.column_mut(0).scale_mut(1.0 / cos);
    model.f.fixed_rows_mut::<3>(PHI).copy_from(&(model.euler_by_rates * rates));
}

/// Turns a step that was computed with δ into one of Euler angles.
#[inline(never)]
pub(super) fn in_euler_angles(x: &VehicleState, step: &mut Discretisation) {
    let from = state::attitude(x);
    let increment = step.increment;
    let (to, turn) = turn(&from, &Vector3::new(increment[PHI], increment[PHI + 1], increment[PHI + 2]));
    step.increment[PHI..PHI + 3].copy_from_slice((to - from).as_slice());
    let (sin, cos) = sin_cos_pitch(&from);
    // T E(x̂): δ to Euler angles
    let of_delta = turn * Matrix3::new(1.0 / cos, 0.0, 0.0, 0.0, 1.0, 0.0, sin / cos, 0.0, 1.0);
    step.turn_attitude(&of_delta);
    let [by_north, by_east] = step.phi_heading;
    let [roll, ..] = &mut step.phi;
    roll.iter_mut().for_each(|a| *a *= cos);
    roll[0] -= sin * by_north;
    roll[1] -= sin * by_east;
    roll[PHI + 2] -= sin;
}

/// The attitude of a steep vehicle: the three components of δ, with the noise of roll, pitch, and of heading and roll.
#[inline(never)]
pub(super) fn observe(x: &VehicleState, euler_rad: &[f64; 3], sigma_rad: &[f64; 3], out: &mut Observations) {
    let from = state::attitude(x);
    let [roll, pitch, heading] = *euler_rad;
    let measured = Attitude::new(&Vector3::new(roll, pitch, heading - from.z)).rotation();
    let r = measured * tilt(&from).transpose();
    let (cos_angle, axis) = (
        0.5 * (r.trace() - 1.0),
        Vector3::new(r[(2, 1)] - r[(1, 2)], r[(0, 2)] - r[(2, 0)], r[(1, 0)] - r[(0, 1)]) * 0.5,
    );
    let sin_angle = libm::sqrt(axis.norm_squared());
    // half a turn has no axis, and is an absurdity about any
    let delta = if sin_angle > 1.0e-9 {
        axis * (libm::atan2(sin_angle, cos_angle) / sin_angle)
    } else {
        axis + Vector3::new(if cos_angle < 0.0 { PI } else { 0.0 }, 0.0, 0.0)
    };
    let (sin, cos) = sin_cos_pitch(&from);
    let [roll, pitch, heading] = sigma_rad.map(|sigma| sigma * sigma);
    out.add(delta.x, roll).row.push(PHI, cos);
    out.add(delta.y, pitch).row.push(THETA, 1.0);
    let vertical = &mut out.add(delta.z, heading + roll).row;
    vertical.push(PHI + 2, 1.0);
    vertical.push(PHI, -sin);
}

impl Filter {
    /// Whether the vehicle hangs: it is steep, as measured, and so against the model that its attitude was refused.
    /// Nothing that is declared holds a hull so. While it is steep the kinematic model takes the model's place, and
    /// what the model has made of an attitude that is refused is as good as forgotten.
    pub(super) fn watch_pitch(&mut self, pitch_rad: f64) {
        let refused = self.is_suspect(Sensor::Attitude);
        self.hangs = pitch_rad.abs() > STEEP_RAD && (self.hangs || refused);
        if self.hangs && refused {
            let (_, cos) = sin_cos_pitch(&state::attitude(&self.x.vehicle));
            self.leave_at_least(Sensor::Attitude, [ANY_SIGMA_RAD / cos, ANY_SIGMA_RAD, ANY_SIGMA_RAD]);
        }
    }

    /// After a correction of a state whose attitude was `from`: the correction as a rotation vector, and P with it.
    #[cold]
    #[inline(never)]
    pub(super) fn turn_steep(&mut self, from: &Vector3<f64>, observer: &mut impl Observer) {
        let change = state::attitude(&self.x.vehicle) - from;
        let (sin, cos) = sin_cos_pitch(from);
        let heading = state::wrap_angle(change.z);
        let (to, turn) = turn(from, &Vector3::new(cos * change.x, change.y, heading - sin * change.x));
        self.x.vehicle.fixed_rows_mut::<3>(PHI).copy_from(&to);
        self.x.wrap_heading();
        self.step.set_identity();
        self.step.turn_attitude(&turn);
        let n = self.dimension();
        propagate_vehicle(&mut self.p, n, &self.step);
        observer.observe(&LinearStep::Transition(self.transition(0.0)));
    }
}
