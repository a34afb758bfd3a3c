//! `clock_offset`: one-way travel times measured minus true.

use super::{EffectInfo, Enters, Hooks, Measure, Moment, ParameterInfo, SensorChannel, Slopes, info::with};

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "clock_offset",
    parameters: &[ParameterInfo::symmetric("s", "s", 0.5)],
    enters: Enters::Measurement,
    equations: "r_m = r + c s",
    signature: "Range innovations have the same mean at all ranges",
    confused_with: &[
        with("sound_speed", "All ranges are about equal", "Measure near and far ranges"),
        with("clock_drift", "The log is short", "Record a longer log"),
    ],
    hooks: Hooks { measure: Some(Measure { channels: &[SensorChannel::Range], apply }), ..Hooks::NONE },
};

fn apply(values: &[f64], moment: &Moment, reading: &mut [f64; 3]) -> Slopes {
    reading[0] += moment.sound_speed_mps * values.first().copied().unwrap_or(0.0);
    Slopes::shift([[moment.sound_speed_mps, 0.0, 0.0], [0.0; 3], [0.0; 3]])
}
