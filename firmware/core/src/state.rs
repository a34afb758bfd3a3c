//! The vehicle's twelve states and where each stands in the vector.

use core::f64::consts::PI;
use nalgebra::{SVector, Vector3, Vector6};

/// x_v = [x y z | φ θ ψ | u v w | p q r]: NED position (m), Euler angles (rad), body velocity
/// through the water (m/s), body rates (rad/s).
pub type VehicleState = SVector<f64, 12>;

/// North position, m.
pub const X: usize = 0;
/// East position, m.
pub const Y: usize = 1;
/// Depth (down position), m.
pub const Z: usize = 2;
/// Roll φ, rad.
pub const PHI: usize = 3;
/// Pitch θ, rad.
pub const THETA: usize = 4;
/// True heading ψ, rad.
pub const PSI: usize = 5;
/// Surge velocity through the water, m/s.
pub const U: usize = 6;
/// Sway velocity through the water, m/s.
pub const V: usize = 7;
/// Heave velocity through the water, m/s.
pub const W: usize = 8;
/// Roll rate, rad/s.
pub const P: usize = 9;
/// Pitch rate, rad/s.
pub const Q: usize = 10;
/// Yaw rate, rad/s.
pub const R: usize = 11;

/// Number of vehicle states.
pub const VEHICLE_STATES: usize = 12;

/// Euler angles [φ θ ψ] of a state, rad.
#[must_use]
pub fn attitude(x: &VehicleState) -> Vector3<f64> {
    Vector3::new(x[PHI], x[THETA], x[PSI])
}

/// Body velocity [u v w p q r] of a state, m/s and rad/s.
#[must_use]
pub fn velocity(x: &VehicleState) -> Vector6<f64> {
    Vector6::new(x[U], x[V], x[W], x[P], x[Q], x[R])
}

/// Wraps an angle to (−π, π], rad.
#[must_use]
pub fn wrap_angle(angle_rad: f64) -> f64 {
    let wrapped = libm::remainder(angle_rad, 2.0 * PI);
    // The remainder of an odd multiple of π may have either sign.
    if wrapped <= -PI { PI } else { wrapped }
}
