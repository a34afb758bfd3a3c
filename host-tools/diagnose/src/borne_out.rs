//! Whether data that had no say in an effect bear it out.
//!
//! With e₀ the innovations without the effect, e₁ those with it, and d = e₀ − e₁: if the model with the effect is right,
//! e₁ is white and Σ e² falls by Σ d², give or take 2 √Σ d²; if the model without it is, Σ e² rises by as much. Where
//! Σ d² is small the data say nothing of the effect. Half the gain is the logarithm of the likelihood ratio of the two.

use crate::whitener::Pass;
use backseat_logs::stats::{Z_95, mean_ci95};
use std::collections::BTreeMap;

/// Data that would gain less than this by the effect as it was found say nothing of it: two and a half sigmas of the gain
/// lie between right and wrong. Data that lose as much are twenty times likelier without it, whatever they would gain.
pub const LEAST_EXPECTED: f64 = 6.0;
/// Sigmas by which a gain must fall short: of effects that are there one in twenty does, if they are so small that half of
/// their gain lies within these.
const SHORT_SIGMAS: f64 = 1.645;
/// Part of the expected gain that an effect must have: of one that is b times as large as it was found, 2 b − 1 is gained.
const LEAST_PART: f64 = 0.4;

/// What an effect takes away from data that had no say in it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BorneOut {
    /// By how much Σ e² falls.
    pub gain: f64,
    /// By how much it falls if the effect is there as it was found: Σ d².
    pub expected: f64,
    /// One sigma of the gain, the larger of that of white innovations and of the scatter of the blocks.
    pub error: f64,
}

impl BorneOut {
    /// Compares two passes over the same readings; `block` is the block of a time, if it is one of those asked for.
    #[must_use]
    pub fn of(without: &Pass, with: &Pass, block: impl Fn(f64) -> Option<usize>) -> Self {
        let mut blocks: BTreeMap<usize, [f64; 2]> = BTreeMap::new();
        let pairs = without.residuals.iter().zip(&with.residuals);
        for (before, after) in pairs.filter(|(a, b)| a.used && b.used && a.channel == b.channel) {
            let Some(block) = block(after.t_s) else { continue };
            let (e, difference) = (after.normalised(), before.normalised() - after.normalised());
            let [square, cross] = blocks.entry(block).or_default();
            *square += difference * difference;
            *cross += 2.0 * difference * e;
        }
        Self::of_blocks(&blocks.into_values().collect::<Vec<_>>())
    }

    /// From Σ d² and 2 Σ d e₁ of each block.
    #[must_use]
    pub fn of_blocks(blocks: &[[f64; 2]]) -> Self {
        let [expected, cross] = blocks.iter().fold([0.0; 2], |sum, block| [sum[0] + block[0], sum[1] + block[1]]);
        let share = if expected > 0.0 { cross / expected } else { 0.0 };
        let scatter: f64 = blocks.iter().map(|[square, cross]| (cross - share * square).powi(2)).sum();
        Self { gain: expected + cross, expected, error: scatter.max(4.0 * expected).sqrt() }
    }

    /// Of both data together.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        Self {
            gain: self.gain + other.gain,
            expected: self.expected + other.expected,
            error: self.error.hypot(other.error),
        }
    }

    /// Whether the data say anything of the effect.
    #[must_use]
    pub fn is_tested(&self) -> bool {
        self.expected > LEAST_EXPECTED
    }

    /// Whether they speak for it: they say something of the effect, and gain most of what it should.
    #[must_use]
    pub fn is_borne_out(&self) -> bool {
        self.is_tested() && self.gain > LEAST_PART * self.expected
    }

    /// Whether much is lost by it.
    #[must_use]
    pub fn is_lost_by(&self) -> bool {
        self.gain < -LEAST_EXPECTED
    }

    /// Whether they speak against it: much is lost, or they say something of it and nothing is gained, or significantly
    /// less than the effect would gain, and less than half of that.
    #[must_use]
    pub fn is_refuted(&self) -> bool {
        let falls_short =
            self.gain + SHORT_SIGMAS * self.error < self.expected && self.gain < LEAST_PART * self.expected;
        self.is_lost_by() || self.is_tested() && (self.gain <= 0.0 || falls_short)
    }
}

/// By how much Σ e² of a block falls from one pass to another, over the blocks that judge: mean and 95 % interval.
#[must_use]
pub fn gain_per_block(before: &Pass, after: &Pass, is_judged: impl Fn(usize) -> bool) -> Option<(f64, [f64; 2])> {
    let pairs = before.normal.blocks.iter().zip(&after.normal.blocks).enumerate();
    let judged = pairs.filter(|(index, (before, _))| before.count > 0 && is_judged(*index));
    let gains: Vec<f64> = judged.map(|(_, (before, after))| before.square - after.square).collect();
    let (low, high) = mean_ci95(&gains)?;
    Some((gains.iter().sum::<f64>() / gains.len() as f64, [low, high]))
}

impl std::fmt::Display for BorneOut {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "squares fall by {:.0} (±{:.0}) instead of {:.0}", self.gain, Z_95 * self.error, self.expected)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::ResidualChannel;
    use crate::whitener::Residual;
    use hil_sim::rng::{Source, Stream};

    /// A constant of `size` sigmas in half of the residuals that a model takes away, or wrongly adds.
    fn passes(size: f64, is_there: bool) -> [Pass; 2] {
        let mut stream = Stream::new(9, Source::Depth);
        let noise: Vec<f64> = (0..400).map(|_| stream.normal()).collect();
        let pass = |more: f64| Pass {
            residuals: (0..400)
                .map(|k| Residual {
                    t_s: f64::from(k),
                    channel: ResidualChannel::Depth,
                    innovation: noise[k as usize] + if k % 2 == 0 { more } else { 0.0 },
                    sigma: 1.0,
                    alike: 1.0,
                    used: true,
                    station: None,
                    is_moved_by_waves: false,
                })
                .collect(),
            ..Pass::default()
        };
        if is_there { [pass(size), pass(0.0)] } else { [pass(0.0), pass(-size)] }
    }

    /// 200 residuals off by 0.5: Σ d² is 50, the gain 50 or −50, give or take 14.
    #[test]
    fn val_gain_of_what_is_there_and_of_what_is_not() {
        let block = |t_s: f64| Some((t_s / 20.0) as usize);
        for (is_there, sign) in [(true, 1.0), (false, -1.0)] {
            let [without, with] = passes(0.5, is_there);
            let of = BorneOut::of(&without, &with, block);
            assert!((of.expected - 50.0).abs() < 1e-9 && of.error >= 200.0_f64.sqrt(), "{of:?}");
            assert!((of.gain - sign * 50.0).abs() < 3.0 * of.error, "{of:?}");
            assert_eq!(of.is_refuted(), !is_there, "{of:?}");
        }
        let [without, with] = passes(0.1, false);
        let of = BorneOut::of(&without, &with, block);
        assert!(!of.is_tested() && !of.is_refuted(), "{of:?}");
        assert_eq!(BorneOut::of(&without, &with, |_| None), BorneOut::default());
    }
}
