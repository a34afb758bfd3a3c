//! `waves`: orbital motion of the water at the vehicle's depth.
//!
//! Of a sine of that amplitude the DVL sees half its square as variance, of a period far below the filter's memory.

use super::{EffectInfo, Enters, Hooks, ParameterInfo, ParameterKind, SensorChannel};

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "waves",
    parameters: &[
        ParameterInfo::size("amplitude_mps", "m/s", 0.0, 1.5),
        ParameterInfo { name: "period_s", unit: "s", min: 1.0, max: 30.0, kind: ParameterKind::Shape },
    ],
    enters: Enters::Noise,
    equations: "v_m = v + a sin(2 pi t / period), any phase and direction",
    signature: "The spectrum of the DVL innovations has a narrow peak at the wave period",
    confused_with: &[],
    hooks: Hooks { variance: Some(variance), ..Hooks::NONE },
};

fn variance(values: &[f64], channel: SensorChannel) -> f64 {
    match (channel, values) {
        (SensorChannel::Dvl, [amplitude, _]) => 0.5 * amplitude * amplitude,
        _ => 0.0,
    }
}
