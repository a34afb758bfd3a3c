//! `range_outliers`: a share of the ranges has nothing to do with the distance (multipath, other pings).
//!
//! A filter that knows of them gates ranges at three sigmas: beyond, an outlier is likelier than noise.

use super::{EffectInfo, Enters, Hooks, ParameterInfo, SensorChannel};

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "range_outliers",
    parameters: &[ParameterInfo::size("share", "1", 0.0, 0.5)],
    enters: Enters::Noise,
    equations: "r_m = anything, with probability share",
    signature: "Single range innovations lie far beyond their sigma, and those next to them do not",
    confused_with: &[],
    hooks: Hooks { gate_sigma: Some(gate_sigma), ..Hooks::NONE },
};

fn gate_sigma(_: &[f64], channel: SensorChannel) -> Option<f64> {
    matches!(channel, SensorChannel::Range | SensorChannel::TwoWayRange).then_some(3.0)
}
