//! `gyro_bias`: body rates measured minus true.

use super::{EffectInfo, Enters, Hooks, Measure, Moment, ParameterInfo, SensorChannel, Slopes, hooks::diagonal};

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "gyro_bias",
    parameters: &[
        ParameterInfo::symmetric("p_radps", "rad/s", 0.02),
        ParameterInfo::symmetric("q_radps", "rad/s", 0.02),
        ParameterInfo::symmetric("r_radps", "rad/s", 0.02),
    ],
    enters: Enters::Measurement,
    equations: "omega_m = omega + bias",
    signature: "The measured body rates do not integrate to the measured attitude",
    confused_with: &[],
    hooks: Hooks { measure: Some(Measure { channels: &[SensorChannel::Rates], apply }), ..Hooks::NONE },
};

fn apply(values: &[f64], _: &Moment, reading: &mut [f64; 3]) -> Slopes {
    for (rate, bias) in reading.iter_mut().zip(values) {
        *rate += bias;
    }
    Slopes::shift(diagonal([1.0; 3]))
}
