//! `water_current`: the water moves over ground with a steady horizontal velocity.
//!
//! The vehicle's body velocity ν is relative to the water, so that its dynamics do not notice (see
//! [`crate::dynamics`]); position, bottom track and range rate do.

use super::{Confusion, EffectInfo, Enters, Hooks, ParameterInfo};
use nalgebra::{Matrix3, Vector2, Vector3};

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "water_current",
    parameters: &[ParameterInfo::symmetric("north_mps", "m/s", 1.5), ParameterInfo::symmetric("east_mps", "m/s", 1.5)],
    enters: Enters::Both,
    equations: "p_dot = R nu + c; bottom track = nu + R^T c; range rate from R nu + c",
    signature: "position, range and range-rate innovations drift as one constant vector in the world frame on all \
                headings; bottom track minus model velocity is that vector turned into body axes",
    confused_with: &[
        Confusion {
            effect: "heading_bias",
            condition: "no DVL bottom track: on north-south lines its cosine part and an east current, its sine part \
                        and a north current, leave the same track and white innovations",
            separating_manoeuvre: "lines across the first ones (a box instead of a lawnmower), bottom lock, or a \
                                   surfaced GNSS leg on each heading",
        },
        Confusion {
            effect: "dvl_scale",
            condition: "on lines of a single heading: a current along the line is a speed scale",
            separating_manoeuvre: "the same line in both directions",
        },
        Confusion {
            effect: "thrust_loss",
            condition: "no DVL, lines of a single heading: slower along the line for either reason",
            separating_manoeuvre: "the same line in both directions, or a second propeller speed",
        },
    ],
    hooks: Hooks { water: Some(water), ..Hooks::NONE },
};

fn water(values: &[f64]) -> [f64; 2] {
    if let &[north, east] = values { [north, east] } else { [0.0; 2] }
}

/// c as a NED vector, m/s.
fn ned(current_mps: &Vector2<f64>) -> Vector3<f64> {
    Vector3::new(current_mps.x, current_mps.y, 0.0)
}

/// Velocity over ground ṗ = R ν + c, NED, m/s: moves the position and makes the range rate.
///
/// `rotation` is R (body to NED), `nu` the body velocity through the water, `current_mps` north and east.
#[must_use]
pub fn ground_velocity(rotation: &Matrix3<f64>, nu: &Vector3<f64>, current_mps: &Vector2<f64>) -> Vector3<f64> {
    rotation * nu + ned(current_mps)
}

/// Velocity over ground in body axes ν + Rᵀ c, m/s: what bottom track measures.
#[must_use]
pub fn bottom_track(rotation: &Matrix3<f64>, nu: &Vector3<f64>, current_mps: &Vector2<f64>) -> Vector3<f64> {
    nu + rotation.tr_mul(&ned(current_mps))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::Attitude;
    use crate::effects;

    #[test]
    fn val_bottom_track_is_ground_velocity_in_body_axes() {
        let rotation = Attitude::new(&Vector3::new(0.1, -0.2, 2.5)).rotation();
        let (nu, current) = (Vector3::new(1.0, 0.05, -0.04), Vector2::new(0.12, -0.07));
        let turned = rotation * bottom_track(&rotation, &nu, &current);
        // Two rotations of numbers near 1: a few units in the last place.
        assert!((turned - ground_velocity(&rotation, &nu, &current)).amax() < 1e-15);
    }

    #[test]
    fn catalogue_is_found_by_name_and_judges_values() {
        let effect = effects::find("water_current").expect("registered");
        assert!(effect.is_plausible(&[0.15, -0.1]));
        assert!(!effect.is_plausible(&[0.15, 2.0]));
        assert!(!effect.is_plausible(&[0.15, f64::NAN]));
        assert!(!effect.is_plausible(&[0.15]));
        assert!(effects::find("none").is_none());
    }
}
