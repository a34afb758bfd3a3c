//! The evidence for a cause over all onsets.

use super::evidence::Weighed;

/// The best onset of a cause, and the evidence over all onsets.
#[derive(Clone, Copy)]
pub(super) struct Candidate {
    pub(super) time_us: u64,
    pub(super) weighed: Weighed,
    /// ln of Σ over the onsets of Δt B, h.
    pub(super) log_sum: f64,
}

impl Candidate {
    pub(super) const ZERO: Self = Self { time_us: 0, weighed: Weighed::ZERO, log_sum: 0.0 };
    pub(super) const NONE: Self = Self { weighed: Weighed::NOTHING, log_sum: f64::NEG_INFINITY, ..Self::ZERO };

    pub(super) fn take(&mut self, time_us: u64, hours: f64, weighed: &Weighed) {
        if weighed.log_ratio > self.weighed.log_ratio {
            (self.time_us, self.weighed) = (time_us, *weighed);
        }
        self.log_sum = log_add(self.log_sum, weighed.log_ratio + libm::log(hours));
    }
}

/// ln(eᵃ + eᵇ).
pub(super) fn log_add(a: f64, b: f64) -> f64 {
    let (more, less) = if a > b { (a, b) } else { (b, a) };
    if less == f64::NEG_INFINITY { more } else { more + libm::log1p(libm::exp(less - more)) }
}
