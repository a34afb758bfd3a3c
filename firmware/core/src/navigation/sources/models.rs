//! Measurement models h(x) and their Jacobians as pure functions of vehicle, ship and water.
//!
//! The filter, the whitener of the diagnosis and the tests share them. They describe ideal sensors: the effects
//! catalogue turns an ideal reading into what a sensor shows. Depth, attitude, body rates and GNSS measure states
//! themselves, so that h(x) is the state and H a row of the identity.

use crate::dynamics::Attitude;
use nalgebra::{Matrix3, Vector2, Vector3};

/// Distance below which the direction of an acoustic path is undefined, m.
const MIN_DISTANCE_M: f64 = 1.0e-3;

/// Distance between two points, h(x) = |dp| (2.34).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// |dp|, m.
    pub distance_m: f64,
    /// ∂|dp|/∂dp: the unit vector along dp, (2.35)-(2.38).
    pub direction: Vector3<f64>,
}

/// Distance of two points that lie `dp` apart (vehicle minus ship, NED, m); `None` when they coincide.
#[must_use]
pub fn distance(dp: &Vector3<f64>) -> Option<Distance> {
    let distance_m = libm::sqrt(dp.dot(dp));
    (distance_m.is_finite() && distance_m >= MIN_DISTANCE_M)
        .then(|| Distance { distance_m, direction: dp / distance_m })
}

/// Range rate h(x) = dp · dv / |dp| (2.39), positive opening, with (2.43) in the form that holds for any velocities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeRate {
    /// h, m/s.
    pub range_rate_mps: f64,
    /// ∂h/∂dp, 1/s.
    pub by_position: Vector3<f64>,
    /// ∂h/∂dv: the unit vector along dp.
    pub by_velocity: Vector3<f64>,
}

/// Range rate of two points `dp` apart that move with `dv` over ground relative to each other (NED, m and m/s).
#[must_use]
pub fn range_rate(dp: &Vector3<f64>, dv: &Vector3<f64>) -> Option<RangeRate> {
    distance(dp).map(|Distance { distance_m, direction }| {
        let range_rate_mps = direction.dot(dv);
        let across = dv - direction * range_rate_mps;
        RangeRate { range_rate_mps, by_position: across / distance_m, by_velocity: direction }
    })
}

/// Velocity over ground in body axes, h(x) = ν + Rᵀ c: bottom track of a DVL.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BottomTrack {
    /// What the current adds: Rᵀ c, m/s. h is ν plus this, ∂h/∂ν the identity.
    pub current_in_body: Vector3<f64>,
    /// ∂h/∂(φ, θ, ψ), m/s per rad.
    pub by_attitude: Matrix3<f64>,
    /// R; ∂h/∂c is its transpose.
    pub rotation: Matrix3<f64>,
}

/// Bottom track at an attitude in a current [north, east], m/s.
#[must_use]
pub fn bottom_track(attitude: &Attitude, current_mps: &Vector2<f64>) -> BottomTrack {
    let rotation = attitude.rotation();
    let current_in_body = rotation.tr_mul(&Vector3::new(current_mps.x, current_mps.y, 0.0));
    // R (Rᵀc) = c is constant, hence ∂(Rᵀc) = −Rᵀ ∂R (Rᵀc).
    let by_attitude = -rotation.tr_mul(&attitude.rotated_by_attitude(&current_in_body));
    BottomTrack { current_in_body, by_attitude, rotation }
}

/// Velocity over ground in NED, R ν + c.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundVelocity {
    /// R ν + c, m/s.
    pub velocity_mps: Vector3<f64>,
    /// ∂(R ν)/∂(φ, θ, ψ), m/s per rad.
    pub by_attitude: Matrix3<f64>,
    /// R = ∂(R ν)/∂ν; the derivative by the current is the identity.
    pub rotation: Matrix3<f64>,
}

/// Velocity over ground of a vehicle that moves with ν through water that moves with [north, east], m/s.
#[must_use]
pub fn ground_velocity(attitude: &Attitude, nu: &Vector3<f64>, current_mps: &Vector2<f64>) -> GroundVelocity {
    let rotation = attitude.rotation();
    GroundVelocity {
        velocity_mps: rotation * nu + Vector3::new(current_mps.x, current_mps.y, 0.0),
        by_attitude: attitude.rotated_by_attitude(nu),
        rotation,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_bottom_track_is_ground_velocity_in_body_axes() {
        let attitude = Attitude::new(&Vector3::new(0.1, -0.2, 2.5));
        let (nu, current) = (Vector3::new(1.0, 0.05, -0.04), Vector2::new(0.12, -0.07));
        let track = bottom_track(&attitude, &current);
        let turned = track.rotation * (nu + track.current_in_body);
        // Two rotations of numbers near 1: a few units in the last place.
        assert!((turned - ground_velocity(&attitude, &nu, &current).velocity_mps).amax() < 1e-15);
    }
}
