//! What may be asked of the naming before a manoeuvre, and after it.

use super::causes::Cause;
use super::separate::separation;
use super::taken::colour_of;
use super::watch::Naming;
use crate::control::Manoeuvre;
use crate::dynamics::ActuatorInput;
use crate::navigation::filter::cekf::Filter;
use crate::state::VehicleState;

impl Naming {
    /// Two causes that have been open for three minutes.
    #[must_use]
    pub fn undecided(&self) -> Option<[Cause; 2]> {
        self.pair.is_undecided().then(|| self.pair.causes())
    }

    /// ln of the odds of one cause over another, as weighed last and as far as evidence counts.
    #[must_use]
    pub fn log_odds(&self, [one, two]: [Cause; 2]) -> f64 {
        self.pair.evidence(one) - self.pair.evidence(two)
    }

    /// By how much a manoeuvre is expected to move ln of the odds between the two that are open; 0 without a filter.
    #[must_use]
    pub fn expected_gain(
        &self,
        manoeuvre: Manoeuvre,
        filter: Option<&Filter>,
        x: &VehicleState,
        input: &ActuatorInput,
    ) -> f64 {
        let Some(model) = filter.and_then(Filter::model) else { return 0.0 };
        let difference = self.pair.difference(|onset_us| self.hours(onset_us));
        let colour = self.colour();
        let colour = self.pair.causes().map(|cause| colour_of(cause, 0.0, &colour));
        let counts = self.pair.width() * colour[0].max(colour[1]);
        separation(manoeuvre, model, x, input, &difference, self.hours(self.last_us)) / counts
    }
}
