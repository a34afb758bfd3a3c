//! `water_current`: the water moves over ground with a steady horizontal velocity.
//!
//! The vehicle's body velocity ν is relative to the water, so that its dynamics do not notice (see
//! [`crate::dynamics`]); position, bottom track and range rate do.

use super::{Confusion, EffectInfo, Enters, Hooks, ParameterInfo};

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

#[cfg(test)]
mod tests {
    use crate::effects;

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
