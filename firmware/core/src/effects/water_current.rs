//! `water_current`: the water moves over ground with a steady horizontal velocity.
//!
//! The vehicle's body velocity ν is relative to the water, so that its dynamics do not notice (see
//! [`crate::dynamics`]); position, bottom track and range rate do.

use super::{EffectInfo, Enters, Hooks, ParameterInfo, info::with};

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "water_current",
    parameters: &[ParameterInfo::symmetric("north_mps", "m/s", 1.5), ParameterInfo::symmetric("east_mps", "m/s", 1.5)],
    enters: Enters::Both,
    equations: "p_dot = R nu + c; bottom track = nu + R^T c; range rate from R nu + c",
    signature: "Position, range and range-rate innovations drift by one constant NED velocity on all headings. \
                DVL bottom track minus modelled velocity is that velocity in body axes",
    confused_with: &[
        with(
            "heading_bias",
            "There is no DVL bottom track. On north-south lines the cosine part of a heading bias \
                        looks like an east current, its sine part like a north current",
            "Fly lines across the first ones (a box instead of a lawnmower), record DVL \
                                   bottom track, or fly a surfaced leg with GNSS on each heading",
        ),
        with(
            "dvl_scale",
            "All lines have one heading: a current along the line looks like a speed scale",
            "Fly the same line in both directions",
        ),
        with(
            "thrust_loss",
            "There is no DVL, and all lines have one heading: both slow the vehicle along the line",
            "Fly the same line in both directions, or at a second propeller speed",
        ),
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
