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
    signature: "dead-reckoned track length is not the one between fixes or ranges; DVL minus model is proportional to speed on all headings",
    confused_with: &[
        Confusion {
            effect: "sound_speed",
            condition: "ranges without fixes: a larger track in a larger range",
            separating_manoeuvre: "fixes at both ends",
        },
        Confusion {
            effect: "water_current",
            condition: "lines of a single heading",
            separating_manoeuvre: "the same line in both directions",
        },
        Confusion {
            effect: "thrust_loss",
            condition: "without ranges or fixes, at one propeller speed",
            separating_manoeuvre: "two propeller speeds, held for minutes each",
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
