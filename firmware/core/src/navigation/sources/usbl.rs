//! USBL fix: h(x) = p_vehicle − p_other, along the measured direction and twice across it.
//!
//! An array measures range r, bearing β and elevation ε of the other end: m = r [cos ε cos β, cos ε sin β, −sin ε]. From
//! the ship, levelled and turned to north, m is the vehicle minus the array. From the vehicle, m stands in body axes, and
//! the vehicle minus the other end is −R m. The three scalars are components of one difference of places, in the triad of
//! the measured direction:
//!
//! ν_i = e_i · (m_NED − dp),   R = diag(σ_r², (r σ_α)², (r σ_α)²)
//!
//! e_1 along m, e_2 across it in the horizontal, e_3 = e_1 × e_2 downwards. h is linear in the places, so that a vehicle
//! straight below the ship, which has no bearing, needs no special case; an array on the vehicle turns with φ, θ, ψ.
//! The error of a reported ship is taken as independent between the three, though along and down share a part of it.
//! Invalid when the ends coincide, the ship is not known, or an array on the vehicle has been delayed.

use super::acoustic::{Path, by_position};
use crate::dynamics::Attitude;
use crate::navigation::algebra::estimate::Estimate;
use crate::navigation::algebra::observation::{Observations, Refused};
use crate::navigation::interface::config::NavigationConfig;
use crate::navigation::interface::measurement::{AcousticPath, FusionOutcome, UsblAxes, UsblFix, VehicleEnd};
use crate::navigation::sources::models::distance;
use crate::state::{self, PHI};
use nalgebra::{Matrix3, Vector3};

/// Horizontal part of a direction below which it has no bearing.
const MIN_GROUND: f64 = 1.0e-6;

pub(crate) fn observe(
    x: &Estimate,
    path: &AcousticPath,
    fix: &UsblFix,
    config: &NavigationConfig,
    out: &mut Observations,
) -> Result<(), Refused> {
    let (measured, by_attitude) = match (fix.axes, path.vehicle) {
        (UsblAxes::Level, _) => (vector(fix), None),
        (UsblAxes::Body, VehicleEnd::Now) => {
            let (attitude, m) = (Attitude::new(&state::attitude(&x.vehicle)), vector(fix));
            (-(attitude.rotation() * m), Some(attitude.rotated_by_attitude(&m)))
        }
        (UsblAxes::Body, VehicleEnd::Delayed { .. }) => return Err(FusionOutcome::Invalid),
    };
    let path = Path::new(x, path, config);
    let path = path.as_ref().map_err(|refused| *refused)?;
    let along = distance(&measured).ok_or(FusionOutcome::Invalid)?.direction;
    let (range, across) = (fix.range_sigma_m, fix.range_m * fix.angle_sigma_rad);
    for (axis, sigma) in triad(&along).iter().zip([range, across, across]) {
        let observation = out.add(axis.dot(&(measured - path.dp)), sigma * sigma);
        let gradient = by_position(*axis);
        path.add_vehicle(x, None, &gradient, observation);
        path.add_ship(&gradient, observation);
        if let Some(by_attitude) = &by_attitude {
            observation.row.push_vector(PHI, &Matrix3::tr_mul(by_attitude, axis));
        }
    }
    Ok(())
}

/// From the array to the other end in the array's axes, m.
fn vector(fix: &UsblFix) -> Vector3<f64> {
    let ((sin_b, cos_b), (sin_e, cos_e)) = (libm::sincos(fix.bearing_rad), libm::sincos(fix.elevation_rad));
    Vector3::new(cos_e * cos_b, cos_e * sin_b, -sin_e) * fix.range_m
}

/// A direction, across it in the horizontal to the right, and across it downwards.
#[must_use]
pub fn triad(along: &Vector3<f64>) -> [Vector3<f64>; 3] {
    let ground = libm::sqrt(along.x * along.x + along.y * along.y);
    let right = if ground > MIN_GROUND { Vector3::new(-along.y, along.x, 0.0) / ground } else { Vector3::y() };
    [*along, right, along.cross(&right)]
}
