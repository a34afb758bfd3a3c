//! `heading_bias`: the compass reads ψ + const + sin · sin ψ + cos · cos ψ.
//!
//! Hard iron makes the harmonics; a misaligned compass or a magnetic declination the constant.

use super::{
    Confusion, EffectInfo, Enters, Hooks, Measure, Moment, ParameterInfo, SensorChannel, Slopes, hooks::diagonal,
};

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "heading_bias",
    parameters: &[
        ParameterInfo::symmetric("const_rad", "rad", 0.6),
        ParameterInfo::symmetric("sin_rad", "rad", 0.3),
        ParameterInfo::symmetric("cos_rad", "rad", 0.3),
    ],
    enters: Enters::Measurement,
    equations: "psi_m = psi + const + sin sin(psi) + cos cos(psi)",
    signature: "dead-reckoned direction is off, by an angle that changes with heading as its first harmonic; yaw rate integrates to other turns than the compass shows",
    confused_with: &[
        Confusion {
            effect: "water_current",
            condition: "no DVL bottom track: on north-south lines the cosine part and an east current, the sine part and a north current, leave the same track and white innovations",
            separating_manoeuvre: "lines across the first ones, bottom lock, or a surfaced GNSS leg on each heading",
        },
        Confusion {
            effect: "dvl_misalignment",
            condition: "the constant part in dead reckoning alone; model sway against the DVL's separates them",
            separating_manoeuvre: "turns with the dynamic model",
        },
    ],
    hooks: Hooks { measure: Some(Measure { channels: &[SensorChannel::Attitude], apply }), ..Hooks::NONE },
};

fn apply(values: &[f64], _: &Moment, reading: &mut [f64; 3]) -> Slopes {
    let &[constant, sine, cosine] = values else { return Slopes::IDENTITY };
    let (sin, cos) = libm::sincos(reading[2]);
    reading[2] += constant + sine * sin + cosine * cos;
    Slopes {
        by_reading: diagonal([1.0, 1.0, 1.0 + sine * cos - cosine * sin]),
        by_parameter: [[0.0, 0.0, 1.0], [0.0, 0.0, sin], [0.0, 0.0, cos]],
    }
}
