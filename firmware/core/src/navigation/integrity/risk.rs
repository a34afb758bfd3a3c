//! From accounts to one distance.
//!
//! The level is the distance beyond which all entries together leave the declared probability: Σ p_k P(error > level |
//! entry k holds) = p. An entry counts with its probability: its share of the hours, times how well its account has
//! predicted ranges and fixes of late. What began a moment ago has not been seen yet, so that no entry counts with less
//! than its rate times the time in which it goes unseen.

use super::hypotheses::{HYPOTHESES, TABLE};

/// How long something new goes unseen while ranges come, s: until the line of sight to the ship has turned.
const UNSEEN_S: f64 = 900.0;
const HOUR_S: f64 = 3600.0;
/// No distance is larger in sigmas: exp(-0.5 · 8²) is 1e-14.
const SIGMAS: f64 = 8.0;
/// Halvings of an interval: from a kilometre to three centimetres.
const HALVINGS: u32 = 15;

/// What one entry says of the estimate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    /// Distance of the estimate from the account's, m.
    pub(super) apart_m: f64,
    /// Largest and smallest sigma of the account's in any direction, m.
    pub(super) sigmas_m: [f64; 2],
    /// Of the entry.
    pub(super) probability: f64,
}

impl Part {
    /// Nothing.
    pub(super) const NONE: Self = Self { apart_m: 0.0, sigmas_m: [0.0; 2], probability: 0.0 };

    /// At most the probability that the entry holds and the error is larger.
    fn beyond(&self, distance_m: f64) -> f64 {
        let [major_m, minor_m] = self.sigmas_m;
        let rest_m = distance_m - self.apart_m;
        if rest_m <= 0.0 || major_m <= 0.0 {
            return if rest_m < 0.0 { self.probability } else { 0.0 };
        }
        // of a circle with the larger sigma; and of a line, with what the smaller one adds to it
        let circle = libm::exp(-0.5 * rest_m * rest_m / (major_m * major_m));
        let flat = 1.0 - minor_m * minor_m / (major_m * major_m);
        let line = tail(rest_m / major_m) + tail((distance_m + self.apart_m) / major_m);
        let line = if flat > 0.01 { line / libm::sqrt(flat) } else { 1.0 };
        self.probability * circle.min(line)
    }
}

/// Just above the probability that a normal number is larger than `k` of its sigmas, k ≥ 0 (M. R. Sampford, Annals of
/// Mathematical Statistics 24, 1953).
fn tail(k: f64) -> f64 {
    const FACTOR: f64 = 1.595_769_121_605_731; // 4/√(2π)
    FACTOR * libm::exp(-0.5 * k * k) / (3.0 * k + libm::sqrt(k * k + 8.0))
}

/// The distance that the error exceeds with probability `allowed`, m; infinite where a number is none.
pub(super) fn level_m(parts: &[Part], allowed: f64) -> f64 {
    let farthest_m = parts.iter().map(|part| part.apart_m + SIGMAS * part.sigmas_m[0]);
    if !farthest_m.clone().all(f64::is_finite) {
        return f64::INFINITY;
    }
    let (mut below_m, mut above_m) = (0.0, farthest_m.fold(0.0, f64::max));
    for _ in 0..HALVINGS {
        let middle_m = 0.5 * (below_m + above_m);
        let beyond: f64 = parts.iter().map(|part| part.beyond(middle_m)).sum();
        if beyond > allowed { below_m = middle_m } else { above_m = middle_m }
    }
    above_m
}

/// Probability of each entry: by the logarithms of the likelihoods of ranges and fixes of late, and for how long none
/// has come, s.
pub(super) fn probabilities(evidence: [f64; HYPOTHESES], silent_s: f64) -> [f64; HYPOTHESES] {
    let most = evidence.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut shares = [0.0; HYPOTHESES];
    for ((share, evidence), entry) in shares.iter_mut().zip(evidence).zip(&TABLE) {
        *share = entry.rate * libm::exp(evidence - most);
    }
    let sum: f64 = shares.iter().sum();
    let unseen_h = ((UNSEEN_S + silent_s) / HOUR_S).min(1.0);
    // a vehicle does not begin to be healthy
    let least = |rate: f64| if rate < 1.0 { rate * unseen_h } else { 0.0 };
    for (share, entry) in shares.iter_mut().zip(&TABLE) {
        *share = (*share / sum).max(least(entry.rate));
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Q(k) of tables; the bound is above it by at most 13 % at zero and 1 % from two sigmas on.
    #[test]
    fn val_the_tail_is_just_above_the_normal_one() {
        for (k, q, within) in [(0.0, 0.5, 1.13), (1.0, 0.158_655, 1.03), (2.0, 0.022_750, 1.01), (3.29, 5.01e-4, 1.01)]
        {
            assert!(tail(k) >= q && tail(k) < within * q, "{k}: {}", tail(k));
        }
    }

    fn part(apart_m: f64, sigmas_m: [f64; 2], probability: f64) -> Part {
        Part { apart_m, sigmas_m, probability }
    }

    /// A circle of sigma 1: √(-2 ln p). A line: two tails of 5e-4 each, 3.29 sigmas. Far away: one tail of 1e-3, 3.09.
    #[test]
    fn val_one_entry_is_a_quantile() {
        let circle = level_m(&[part(0.0, [1.0; 2], 1.0)], 1.0e-3);
        assert!((circle - libm::sqrt(-2.0 * libm::log(1.0e-3))).abs() < 1.0e-3, "{circle}");
        let line = level_m(&[part(0.0, [1.0, 0.0], 1.0)], 1.0e-3);
        assert!((line - 3.29).abs() < 0.01, "{line}");
        let away = level_m(&[part(50.0, [1.0, 0.0], 1.0)], 1.0e-3);
        assert!((away - 53.09).abs() < 0.01, "{away}");
    }

    /// An entry that is rarer than the level may fail needs none; of two that are as likely, each has half.
    #[test]
    fn entries_share_the_probability() {
        let healthy = part(0.0, [1.0, 0.0], 1.0);
        let alone = level_m(&[healthy], 1.0e-3);
        let rare = level_m(&[healthy, part(100.0, [10.0; 2], 1.0e-5)], 1.0e-3);
        assert!(rare < 1.01 * alone, "{rare}");
        let half = level_m(&[healthy, healthy], 1.0e-3);
        assert!((half - level_m(&[healthy], 0.5e-3)).abs() < 1.0e-3, "{half}");
    }

    #[test]
    fn what_is_no_number_bounds_nothing() {
        for apart_m in [f64::NAN, f64::INFINITY] {
            assert_eq!(level_m(&[part(apart_m, [1.0; 2], 1.0)], 1.0e-3), f64::INFINITY);
        }
    }

    /// Evidence moves an entry; what began a moment ago does not depend on it, and the longer nothing is heard the more.
    #[test]
    fn evidence_and_exposure() {
        let mut evidence = [0.0; HYPOTHESES];
        evidence[1] = 20.0;
        assert!(probabilities(evidence, 0.0)[1] > 0.999);
        evidence[1] = -20.0;
        let [heard, silent] = [0.0, 900.0].map(|silent_s| probabilities(evidence, silent_s)[1]);
        assert!((heard - 0.25 * TABLE[1].rate).abs() < 1.0e-9 && (silent - 2.0 * heard).abs() < 1.0e-9);
    }
}
