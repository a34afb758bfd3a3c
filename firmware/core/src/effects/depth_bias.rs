//! `depth_bias`: depth measured minus true.
//!
//! Seen only against a known depth: an antenna of known height at the surface, or slant ranges at short distance.

use super::{EffectInfo, Enters, Hooks, Measure, Moment, ParameterInfo, SensorChannel, Slopes, info::with};

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "depth_bias",
    parameters: &[ParameterInfo::symmetric("m", "m", 5.0)],
    enters: Enters::Measurement,
    equations: "z_m = z + m",
    signature: "At the surface the measured depth differs from the sensor's depth below the waterline",
    confused_with: &[with(
        "sound_speed",
        "All ranges are slant ranges from about one distance",
        "Surface, or measure ranges at several distances",
    )],
    hooks: Hooks { measure: Some(Measure { channels: &[SensorChannel::Depth], apply }), ..Hooks::NONE },
};

fn apply(values: &[f64], _: &Moment, reading: &mut [f64; 3]) -> Slopes {
    reading[0] += values.first().copied().unwrap_or(0.0);
    Slopes::shift([[1.0, 0.0, 0.0], [0.0; 3], [0.0; 3]])
}
