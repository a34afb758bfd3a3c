//! `dvl_scale`: DVL velocity measured / true − 1.
//!
//! Sound speed at the DVL, or its geometry.

use super::{
    Confusion, EffectInfo, Enters, Hooks, Measure, Moment, ParameterInfo, SensorChannel, Slopes, hooks::diagonal,
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
        Confusion {
            effect: "sound_speed",
            condition: "Ranges but no fixes: track and ranges scale together",
            separating_manoeuvre: "Take GNSS fixes at both ends",
        },
        Confusion {
            effect: "water_current",
            condition: "All lines have one heading",
            separating_manoeuvre: "Fly the same line in both directions",
        },
        Confusion {
            effect: "thrust_loss",
            condition: "No ranges and no fixes, at one propeller speed",
            separating_manoeuvre: "Hold two propeller speeds for some minutes each",
        },
    ],
    hooks: Hooks { measure: Some(Measure { channels: &[SensorChannel::Dvl], apply }), ..Hooks::NONE },
};

fn apply(values: &[f64], _: &Moment, reading: &mut [f64; 3]) -> Slopes {
    let &[ratio] = values else { return Slopes::IDENTITY };
    let before = *reading;
    *reading = before.map(|v| (1.0 + ratio) * v);
    Slopes { by_reading: diagonal([1.0 + ratio; 3]), by_parameter: [before, [0.0; 3], [0.0; 3]] }
}
