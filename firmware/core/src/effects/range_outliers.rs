//! `range_outliers`: a share of the ranges has nothing to do with the distance (multipath, other pings).
//!
//! A filter that knows of them gates ranges where an outlier is likelier than noise.

use super::{EffectInfo, Enters, Hooks, ParameterInfo, SensorChannel};
use core::f64::consts::TAU;
use libm::{log, sqrt};

/// An outlier lies anywhere within this many sigmas of the noise: a kilometre, at a metre.
const WITHIN_SIGMAS: f64 = 1000.0;
/// The narrowest gate, sigmas: what else a filter does not know is in its innovations as well.
const NARROWEST_SIGMAS: f64 = 3.0;

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

/// Where `share / WITHIN_SIGMAS` is `(1 − share) exp(−g²/2) / √τ`.
fn gate_sigma(values: &[f64], channel: SensorChannel) -> Option<f64> {
    let share = *values.first()?;
    let odds = (1.0 - share) / share * WITHIN_SIGMAS / sqrt(TAU);
    let gate_sigma = sqrt(2.0 * log(odds.max(1.0))).max(NARROWEST_SIGMAS);
    matches!(channel, SensorChannel::Range | SensorChannel::TwoWayRange).then_some(gate_sigma)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_at_the_gate_both_are_alike() {
        for share in [0.001, 0.02, 0.2] {
            let gate = gate_sigma(&[share], SensorChannel::Range).unwrap();
            let noise = (1.0 - share) * libm::exp(-0.5 * gate * gate) / sqrt(TAU);
            assert!((noise * WITHIN_SIGMAS / share - 1.0).abs() < 1e-9, "{share}: {gate}");
        }
        assert!(gate_sigma(&[1.0], SensorChannel::Range) == Some(NARROWEST_SIGMAS));
        assert_eq!(gate_sigma(&[0.1], SensorChannel::Depth), None);
    }
}
