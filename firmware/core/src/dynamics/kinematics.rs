//! Attitude: R (2.25), the Euler-rate matrix L (inverse of (2.30), corrected) and their derivatives.

use super::Linearisation;
use crate::state::{self, VehicleState};
use nalgebra::{Matrix3, Matrix3x2, Matrix6, Matrix6x2, Vector3, Vector6};

/// Smallest |cos θ| that L and its derivatives divide by: within 0.057° of the vertical, where
/// Euler angles lose roll from heading, Euler rates stay below 1000 |ω| instead of growing
/// without bound. R is exact everywhere.
pub const MIN_COS_PITCH: f64 = 1.0e-3;

/// Sines and cosines of one attitude, computed once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attitude {
    sin_roll: f64,
    cos_roll: f64,
    sin_pitch: f64,
    cos_pitch: f64,
    sin_heading: f64,
    cos_heading: f64,
    /// 1 / cos θ, bounded by `MIN_COS_PITCH`.
    sec_pitch: f64,
}

impl Attitude {
    /// From Euler angles [φ θ ψ], rad.
    #[must_use]
    pub fn new(euler_rad: &Vector3<f64>) -> Self {
        let (sin_roll, cos_roll) = libm::sincos(euler_rad.x);
        let (sin_pitch, cos_pitch) = libm::sincos(euler_rad.y);
        let (sin_heading, cos_heading) = libm::sincos(euler_rad.z);
        let guarded = if cos_pitch.abs() < MIN_COS_PITCH { MIN_COS_PITCH.copysign(cos_pitch) } else { cos_pitch };
        Self { sin_roll, cos_roll, sin_pitch, cos_pitch, sin_heading, cos_heading, sec_pitch: 1.0 / guarded }
    }

    /// R = Rz(ψ) Ry(θ) Rx(φ), body to NED (2.25).
    #[must_use]
    pub fn rotation(&self) -> Matrix3<f64> {
        let &Self {
            sin_roll: sr, cos_roll: cr, sin_pitch: sp, cos_pitch: cp, sin_heading: sh, cos_heading: ch, ..
        } = self;
        Matrix3::new(
            ch * cp,
            ch * sp * sr - sh * cr,
            ch * sp * cr + sh * sr,
            sh * cp,
            sh * sp * sr + ch * cr,
            sh * sp * cr - ch * sr,
            -sp,
            cp * sr,
            cp * cr,
        )
    }

    /// ∂(R a)/∂(φ, θ, ψ) of a fixed body vector a.
    #[must_use]
    pub fn rotated_by_attitude(&self, a: &Vector3<f64>) -> Matrix3<f64> {
        let &Self {
            sin_roll: sr, cos_roll: cr, sin_pitch: sp, cos_pitch: cp, sin_heading: sh, cos_heading: ch, ..
        } = self;
        // Rx a = (a_x, east, down) in the frame before pitch and heading; `ahead` after pitch.
        let east = cr * a.y - sr * a.z;
        let down = sr * a.y + cr * a.z;
        let ahead = cp * a.x + sp * down;
        let ahead_by_pitch = cp * down - sp * a.x;
        Matrix3::new(
            ch * sp * east + sh * down,
            ch * ahead_by_pitch,
            -sh * ahead - ch * east,
            sh * sp * east - ch * down,
            sh * ahead_by_pitch,
            ch * ahead - sh * east,
            cp * east,
            -ahead,
            0.0,
        )
    }

    /// s = Rᵀ e3: the downward direction in body axes.
    #[must_use]
    pub fn down(&self) -> Vector3<f64> {
        Vector3::new(-self.sin_pitch, self.sin_roll * self.cos_pitch, self.cos_roll * self.cos_pitch)
    }

    /// ∂s/∂(φ, θ).
    #[must_use]
    pub fn down_by_roll_pitch(&self) -> Matrix3x2<f64> {
        Matrix3x2::new(
            0.0,
            -self.cos_pitch,
            self.cos_roll * self.cos_pitch,
            -self.sin_roll * self.sin_pitch,
            -self.sin_roll * self.cos_pitch,
            -self.cos_roll * self.sin_pitch,
        )
    }

    /// L: Euler rates = L ω, bounded near the vertical by [`MIN_COS_PITCH`].
    #[must_use]
    pub fn euler_rate_matrix(&self) -> Matrix3<f64> {
        let tan_pitch = self.sin_pitch * self.sec_pitch;
        Matrix3::new(
            1.0,
            self.sin_roll * tan_pitch,
            self.cos_roll * tan_pitch,
            0.0,
            self.cos_roll,
            -self.sin_roll,
            0.0,
            self.sin_roll * self.sec_pitch,
            self.cos_roll * self.sec_pitch,
        )
    }

    /// ∂(L ω)/∂(φ, θ) at fixed body rates.
    #[must_use]
    pub fn euler_rates_by_roll_pitch(&self, omega: &Vector3<f64>) -> Matrix3x2<f64> {
        let tan_pitch = self.sin_pitch * self.sec_pitch;
        let turn = self.sin_roll * omega.y + self.cos_roll * omega.z;
        let pitch_rate = self.cos_roll * omega.y - self.sin_roll * omega.z;
        let turn_sec = turn * self.sec_pitch;
        Matrix3x2::new(
            tan_pitch * pitch_rate,
            turn_sec * self.sec_pitch,
            -turn,
            0.0,
            pitch_rate * self.sec_pitch,
            turn_sec * tan_pitch,
        )
    }
}

/// f and F of the kinematic model (2.25)-(2.33): constant body velocity in still water.
#[must_use]
pub fn kinematic_linearise(x: &VehicleState) -> Linearisation {
    let attitude = Attitude::new(&state::attitude(x));
    linearise_with(&attitude, &state::velocity(x), &Vector6::zeros(), Matrix6x2::zeros(), Matrix6::zeros())
}

/// Completes an acceleration and its derivatives with the kinematic rows. Inlined, so that the matrices are not copied.
#[inline(always)]
pub(super) fn linearise_with(
    attitude: &Attitude,
    v: &Vector6<f64>,
    acceleration: &Vector6<f64>,
    acceleration_by_roll_pitch: Matrix6x2<f64>,
    acceleration_by_velocity: Matrix6<f64>,
) -> Linearisation {
    let nu = Vector3::new(v[0], v[1], v[2]);
    let omega = Vector3::new(v[3], v[4], v[5]);
    let rotation = attitude.rotation();
    let euler_by_rates = attitude.euler_rate_matrix();
    Linearisation {
        f: state_derivative(&(rotation * nu), &(euler_by_rates * omega), acceleration),
        position_by_attitude: attitude.rotated_by_attitude(&nu),
        position_by_velocity: rotation,
        euler_by_roll_pitch: attitude.euler_rates_by_roll_pitch(&omega),
        euler_by_rates,
        acceleration_by_roll_pitch,
        acceleration_by_velocity,
    }
}

/// ẋ from its three parts.
pub(super) fn state_derivative(
    position: &Vector3<f64>,
    euler: &Vector3<f64>,
    acceleration: &Vector6<f64>,
) -> VehicleState {
    VehicleState::from([
        position.x,
        position.y,
        position.z,
        euler.x,
        euler.y,
        euler.z,
        acceleration[0],
        acceleration[1],
        acceleration[2],
        acceleration[3],
        acceleration[4],
        acceleration[5],
    ])
}
