//! Near the vertical: what the rotation vector says against differences of Euler angles.

use crate::dynamics::Attitude;
use crate::navigation::algebra::observation::Observations;
use crate::navigation::filter::vertical::{observe, turn};
use crate::state::{PHI, VehicleState};
use core::f64::consts::FRAC_PI_2;
use nalgebra::{Matrix3, Vector3};

/// Pitch angles from the vertical, rad: bounds of 1/cos θ do not reach beyond the last.
const FROM_VERTICAL_RAD: [f64; 4] = [0.5, 0.1, 0.01, 0.0011];

/// A small difference, rad; the squares of its like, over cos θ twice, are the errors that are allowed.
const SMALL_RAD: f64 = 1.0e-8;

fn steep() -> impl Iterator<Item = (f64, Vector3<f64>, Vector3<f64>)> {
    let directions = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.6, -0.7, 0.4]];
    let attitudes = FROM_VERTICAL_RAD.into_iter().flat_map(|off| [(off, FRAC_PI_2 - off), (off, off - FRAC_PI_2)]);
    attitudes.flat_map(move |(off, pitch)| {
        directions.map(|d| (off, Vector3::new(0.7, pitch, -2.9), Vector3::from(d) * SMALL_RAD * off))
    })
}

fn rotation(euler_rad: &Vector3<f64>) -> Matrix3<f64> {
    Attitude::new(euler_rad).rotation()
}

#[test]
fn val_innovations_of_a_steep_attitude_are_its_rows_times_the_difference() {
    let mut out = Observations::new();
    for (off, euler, difference) in steep() {
        let mut x = VehicleState::zeros();
        x.fixed_rows_mut::<3>(PHI).copy_from(&euler);
        out.clear();
        observe(&x, &(euler + difference).into(), &[0.02; 3], &mut out);
        let mut padded = VehicleState::zeros();
        padded.fixed_rows_mut::<3>(PHI).copy_from(&difference);
        for item in out.as_slice() {
            let expected = item.row.dot(padded.as_slice());
            // rounding of a rotation matrix
            assert!((item.innovation - expected).abs() < 1e-15 + SMALL_RAD * off * 1e-4, "{off} {}", item.innovation);
        }
    }
}

#[test]
fn val_a_turn_takes_errors_of_euler_angles_along() {
    for delta in [Vector3::zeros(), Vector3::new(0.02, -0.03, 0.05), Vector3::new(0.1, 0.3, -0.2)] {
        for (off, from, error) in steep() {
            let (to, by) = turn(&from, &delta);
            assert!(to.y.abs() <= FRAC_PI_2);
            // in axes turned by the first heading, as δ is
            let ahead = rotation(&Vector3::new(0.0, 0.0, from.z));
            let moved = ahead.transpose() * rotation(&to) * rotation(&from).transpose() * ahead;
            let axis = Vector3::new(
                moved[(2, 1)] - moved[(1, 2)],
                moved[(0, 2)] - moved[(2, 0)],
                moved[(1, 0)] - moved[(0, 1)],
            );
            let angle = delta.norm();
            assert!((axis * 0.5 - delta * if angle > 0.0 { libm::sin(angle) / angle } else { 1.0 }).amax() < 1e-12);
            // the error keeps its place in level axes while body and estimate turn alike
            let true_after = rotation(&(from + error)) * rotation(&from).transpose() * rotation(&to);
            let expected = rotation(&(to + by * error));
            assert!((true_after - expected).amax() < 1e-14 + SMALL_RAD * off * 1e-3, "{off} {delta} {from} {error}");
        }
    }
}
