//! `sound_speed`: acoustic range measured / true − 1: the speed used over the true one, less one.
//!
//! A Doppler changes in the same ratio, by less than its noise; it is left alone.

use super::{
    EffectInfo, Enters, Hooks, Measure, Moment, ParameterInfo, SensorChannel, Slopes, hooks::diagonal, info::with,
};

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "sound_speed",
    parameters: &[ParameterInfo::symmetric("ratio", "1", 0.05)],
    enters: Enters::Measurement,
    equations: "r_m = (1 + ratio) r",
    signature: "Range innovations are proportional to range",
    confused_with: &[
        with("clock_offset", "All ranges are about equal", "Measure near and far ranges"),
        with("dvl_scale", "Ranges but no fixes: track and ranges scale together", "Take GNSS fixes at both ends"),
        with(
            "depth_bias",
            "All ranges are slant ranges from about one distance",
            "Measure ranges at several distances",
        ),
    ],
    hooks: Hooks {
        measure: Some(Measure {
            channels: &[SensorChannel::Range, SensorChannel::TwoWayRange, SensorChannel::Usbl],
            apply,
        }),
        ..Hooks::NONE
    },
};

fn apply(values: &[f64], _: &Moment, reading: &mut [f64; 3]) -> Slopes {
    let &[ratio] = values else { return Slopes::IDENTITY };
    let range = reading[0];
    reading[0] = (1.0 + ratio) * range;
    Slopes { by_reading: diagonal([1.0 + ratio, 1.0, 1.0]), by_parameter: [[range, 0.0, 0.0], [0.0; 3], [0.0; 3]] }
}
