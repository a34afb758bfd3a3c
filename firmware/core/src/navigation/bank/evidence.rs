//! What measurements of the position say for one filter of a bank against another.

use crate::navigation::interface::measurement::{Fusions, Sensor};

/// Factor on the earlier evidence with each range: a memory of fifty ranges, 25 minutes at one every 30 s. A current
/// that sets in later outweighs them within a few.
const MEMORY: f64 = 0.98;
/// The same in time, s.
pub(super) const MEMORY_S: f64 = 1500.0;
/// What a fix counts of a range: thirty, at one every second, have an error in common.
const FIX_SHARE: f64 = 1.0 / 30.0;

/// What a fix by USBL counts of a range: a third, at one every ten seconds.
const USBL_SHARE: f64 = 1.0 / 3.0;

/// ln of the likelihood ratio of one range or fix, used or refused.
#[derive(Clone, Copy, Debug)]
pub struct Evidence {
    log_ratio: f64,
    /// Of a range.
    share: f64,
}

impl Evidence {
    /// Bayes' rule on one measurement; `None` of another sensor's, and of one that either filter cannot predict.
    #[must_use]
    pub fn new(sensor: Sensor, own: &Fusions, other: &Fusions) -> Option<Self> {
        let share = Self::share(sensor)?;
        let log_ratio = own.log_likelihood() - other.log_likelihood();
        log_ratio.is_finite().then_some(Self { log_ratio, share })
    }

    fn share(sensor: Sensor) -> Option<f64> {
        match sensor {
            Sensor::Range => Some(1.0),
            Sensor::VehicleGnss => Some(FIX_SHARE),
            Sensor::Usbl => Some(USBL_SHARE),
            _ => None,
        }
    }

    /// With what came before (or, backwards, what came after), which is forgotten a little.
    #[must_use]
    pub fn beside(self, log_ratio: f64) -> f64 {
        log_ratio + self.share * (self.log_ratio - (1.0 - MEMORY) * log_ratio)
    }

    /// This sensor's measurements count.
    #[must_use]
    pub fn counts(sensor: Sensor) -> bool {
        Self::share(sensor).is_some()
    }
}
