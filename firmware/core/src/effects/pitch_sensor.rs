//! `pitch_sensor`: measured pitch = (1 + scale) pitch + bias.

use super::{
    EffectInfo, Enters, Hooks, Measure, Moment, ParameterInfo, SensorChannel, Slopes, hooks::diagonal, info::with,
};

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "pitch_sensor",
    parameters: &[ParameterInfo::symmetric("bias_rad", "rad", 0.2), ParameterInfo::symmetric("scale", "1", 0.2)],
    enters: Enters::Measurement,
    equations: "theta_m = (1 + scale) theta + bias",
    signature: "The measured pitch disagrees with depth rate over speed: by a constant (bias), or in \
                proportion to pitch (scale)",
    confused_with: &[
        with("pitch_trim", "The log has straight and level flight only", "Dive"),
        with(
            "dvl_misalignment",
            "The log has no depth: a pitch bias and a pitch of the DVL look the same",
            "Log the depth and dive",
        ),
    ],
    hooks: Hooks { measure: Some(Measure { channels: &[SensorChannel::Attitude], apply }), ..Hooks::NONE },
};

fn apply(values: &[f64], _: &Moment, reading: &mut [f64; 3]) -> Slopes {
    let &[bias, scale] = values else { return Slopes::IDENTITY };
    let pitch = reading[1];
    reading[1] = (1.0 + scale) * pitch + bias;
    Slopes {
        by_reading: diagonal([1.0, 1.0 + scale, 1.0]),
        by_parameter: [[0.0, 1.0, 0.0], [0.0, pitch, 0.0], [0.0; 3]],
    }
}
