//! `clock_drift`: the offset of one-way travel times grows with time since the epoch.

use super::{EffectInfo, Enters, Hooks, Measure, Moment, ParameterInfo, SensorChannel, Slopes, info::with};

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "clock_drift",
    parameters: &[ParameterInfo::symmetric("ppm", "ppm", 100.0)],
    enters: Enters::Measurement,
    equations: "r_m = r + 1e-6 c ppm t",
    signature: "Range innovations grow in proportion to time",
    confused_with: &[with("clock_offset", "The log is short", "Record a longer log")],
    hooks: Hooks { measure: Some(Measure { channels: &[SensorChannel::Range], apply }), ..Hooks::NONE },
};

fn apply(values: &[f64], moment: &Moment, reading: &mut [f64; 3]) -> Slopes {
    let metres = 1.0e-6 * moment.sound_speed_mps * moment.t_s;
    reading[0] += metres * values.first().copied().unwrap_or(0.0);
    Slopes::shift([[metres, 0.0, 0.0], [0.0; 3], [0.0; 3]])
}
