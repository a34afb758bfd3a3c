//! `dvl_scale`: DVL velocity measured / true − 1.
//!
//! Sound speed at the DVL, or its geometry.

use super::{
    EffectInfo, Enters, Hooks, Measure, Moment, ParameterInfo, SensorChannel, Slopes, hooks::diagonal, info::with,
};

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "dvl_scale",
    parameters: &[ParameterInfo::symmetric("ratio", "1", 0.1)],
    enters: Enters::Measurement,
    equations: "v_m = (1 + ratio) v",
    signature: "The dead-reckoned distance differs from the distance between fixes or ranges. DVL minus model \
                is proportional to speed on all headings",
    confused_with: &[
        with("sound_speed", "Ranges but no fixes: track and ranges scale together", "Take GNSS fixes at both ends"),
        with("water_current", "All lines have one heading", "Fly the same line in both directions"),
        with(
            "thrust_loss",
            "No ranges and no fixes, at one propeller speed",
            "Hold two propeller speeds for some minutes each",
        ),
    ],
    hooks: Hooks { measure: Some(Measure { channels: &[SensorChannel::Dvl], apply }), ..Hooks::NONE },
};

fn apply(values: &[f64], _: &Moment, reading: &mut [f64; 3]) -> Slopes {
    let &[ratio] = values else { return Slopes::IDENTITY };
    let before = *reading;
    *reading = before.map(|v| (1.0 + ratio) * v);
    Slopes { by_reading: diagonal([1.0 + ratio; 3]), by_parameter: [before, [0.0; 3], [0.0; 3]] }
}
