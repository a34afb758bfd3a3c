//! What a cause that is used has predicted since it was taken into use.
//!
//! With δ its numbers as they were taken, its prediction of the nominal filter's innovations e is a_since δ. Against
//! none it has, from the decision on, the logarithm of the likelihood ratio
//!
//!   δᵀ Σ a_since e − ½ δᵀ Σ a_since a_sinceᵀ δ
//!
//! and nothing is fitted to it.

use super::causes::Cause;
use super::onset::Onset;
use super::statement::Named;
use super::sums::Sums;

/// A cause in use; all bytes zero: none.
pub(super) struct Used {
    /// Its place in the table and one.
    place: u8,
    /// Its onset.
    pub(super) onset_us: u64,
    size: [f64; 2],
    /// Both sums at the decision.
    before: [f64; 2],
}

impl Used {
    pub(super) const NONE: Self = Self { place: 0, onset_us: 0, size: [0.0; 2], before: [0.0; 2] };

    pub(super) fn new(named: &Named, onset: &Onset, total: &Sums, start_us: u64) -> Self {
        let mut own =
            Self { place: named.cause.number(), onset_us: named.since_us, size: named.size, before: [0.0; 2] };
        own.before = own.sums(onset, total, start_us);
        own
    }

    pub(super) fn is_used(&self) -> bool {
        self.place > 0
    }

    /// δᵀ Σ a e and δᵀ Σ a aᵀ δ since the onset.
    fn sums(&self, onset: &Onset, total: &Sums, start_us: u64) -> [f64; 2] {
        let Some(cause) = Cause::from_number(self.place) else { return [0.0; 2] };
        let parts = cause.parts(onset.time_us.saturating_sub(start_us) as f64 / 3.6e9);
        let mut sums = [0.0; 2];
        for (part, size) in parts.iter().zip(self.size) {
            let Some(part) = part else { continue };
            sums[0] += size * onset.score(total, &part.direction);
            for (other, beside) in parts.iter().zip(self.size) {
                let between = other.map_or(0.0, |other| onset.between(total, &part.direction, &other.direction));
                sums[1] += size * beside * between;
            }
        }
        sums
    }

    /// ln of the likelihood ratio since the decision.
    pub(super) fn gain(&self, onset: &Onset, total: &Sums, start_us: u64) -> f64 {
        let [score, information] = self.sums(onset, total, start_us);
        let [score_before, information_before] = self.before;
        score - score_before - 0.5 * (information - information_before)
    }
}
