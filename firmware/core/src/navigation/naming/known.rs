//! What somebody could know who is told cause, size and onset: for a study of what can be named at all.
//!
//! Without noise a change of size δ moves the innovations by a_since δ. With these in place of the innovations
//!
//!   δᵀ I δ
//!
//! is the squared distance from no change, in sigmas, and ln B of the true cause less that of another one is what ln of
//! their odds is expected to be.

use super::causes::{ALL, Cause};
use super::columns::DECLARED_SIGMA;
use super::evidence::{Factor, Number};
use super::watch::Naming;

/// What is expected of the best filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// Sigmas between the change and none.
    pub sigmas: f64,
    /// ln of the odds of the cause against the nearest other one.
    pub log_odds: f64,
    /// That other one.
    pub rival: Cause,
}

impl Naming {
    /// Of a cause since an onset that is kept, with its true size; nothing where it is not.
    #[must_use]
    pub fn known(&self, cause: Cause, size: [f64; 2], since_us: u64) -> Option<Known> {
        let onsets = self.onsets();
        let onset = onsets.iter().find(|onset| onset.time_us == since_us)?;
        let onset_h = self.hours(since_us);
        let parts = cause.parts(onset_h);
        let change = parts.iter().zip(size).filter_map(|(part, size)| part.map(|part| (part.direction, size)));
        let (total, onset) = onset.without_noise(&onsets.last()?.sums, change);
        let mut factor = Factor::NONE;
        factor.compute(&total, [None; 2], &DECLARED_SIGMA);
        let beside = factor.take_states(&total, &onset);
        let numbers = parts.map(|part| part.map(|part| Number::Change(part, &onset)));
        let (information, score) = factor.left(&total, &numbers, &beside);
        let mut squared = size[0] * score[0] + size[1] * score[1];
        // the second number of a lost fin is the inflow beside it: as well known as its prior, not told
        if let ([_, 0.0], [_, Some(nuisance)]) = (size, parts) {
            squared -= score[1] * score[1] / (information[1][1] + 1.0 / (nuisance.sigma * nuisance.sigma));
        }
        let mut own = f64::NEG_INFINITY;
        let mut best = (f64::NEG_INFINITY, cause);
        for other in ALL {
            let weighed = factor.weigh(&total, (other, onset_h), &onset, &beside, 1.0);
            if other == cause {
                own = weighed.log_ratio;
            } else if other.is_possible(&weighed.size) && weighed.log_ratio > best.0 {
                best = (weighed.log_ratio, other);
            }
        }
        Some(Known { sigmas: libm::sqrt(squared.max(0.0)), log_odds: own - best.0, rival: best.1 })
    }
}
