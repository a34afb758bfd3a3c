//! What ends a mission beside its modes, and what last-resort hardware does then.

use super::Backseat;
use crate::inputs::fresh;
use crate::last_resort::LastResortFacts;
use crate::safety::{self, Action, Decision, Observed};
use crate::steering::Orders;
use backseat_core::state::Z;
use backseat_wire::hostlink::{Fittings, ModeReason};

/// A depth of the pressure sensor is the present one for so long, µs.
const PRESSURE_AGE_US: u64 = 2_000_000;

impl Backseat {
    /// Ends a mission, under way or armed, that the ship aborts.
    #[inline(never)]
    pub(super) fn apply_abort(&mut self, now_us: u64, orders: &mut Orders) {
        let abort = self.links.take_abort();
        if !abort.is_some_and(|abort| safety::aborts(&abort, now_us, &self.observed())) {
            return;
        }
        self.steering.disarm();
        if self.steering.under_way() {
            self.last_resort.abort();
            self.steering.hand_back(now_us, &self.parameters.active().app, orders);
        }
        self.modes.ended_by(ModeReason::Aborted);
    }

    /// Carries out what the limits of safety decide.
    #[inline(never)]
    pub(super) fn apply_safety(&mut self, now_us: u64, orders: &mut Orders) {
        let Self { safety, parameters, clock, links, inputs, estimator, steering, fence, last_resort, modes, .. } =
            self;
        let (settings, degraded) = (&parameters.active().app, modes.is_degraded());
        let observed = Observed {
            settings,
            clock,
            links,
            inputs,
            estimator,
            steering,
            fence,
            last_resort: &*last_resort,
            degraded,
        };
        let decision = safety.step(now_us, &observed);
        if decision == Decision::Idle {
            return modes.returned();
        }
        estimator.set_depth_drift(safety.depth_drift_sigma_m());
        let Decision::End { reason, action, home } = decision else { return };
        match (action, home) {
            (Action::Return, Some(home)) if steering.return_to(home, &estimator.output) => {
                safety.new_leg();
                return modes.returns_by(reason);
            }
            (Action::StopAndRise | Action::Return, _) => {
                last_resort.abort();
                steering.hand_back(now_us, settings, orders);
            }
            (Action::Hold, _) => {
                last_resort.abort();
                steering.hold();
            }
            (Action::HandBack, _) => steering.lapse(now_us, settings, orders),
        }
        modes.ended_by(reason);
    }

    /// The vehicle as its last resort sees it.
    pub(super) fn last_resort_facts(&self, now_us: u64) -> LastResortFacts {
        let navigator = self.estimator.navigator();
        let estimate = navigator.is_initialised().then(|| self.estimator.output[Z]);
        LastResortFacts {
            now_us,
            depth_m: fresh(self.inputs.latest.depth_m, now_us, PRESSURE_AGE_US).or(estimate),
            depth_max_m: self.parameters.active().app.safety.depth_max_m,
            frontseat_leak: self.links.frontseat.leaks(),
            under_way: self.steering.under_way(),
        }
    }

    /// Whether the weight falls, after the step's limits; what has changed since `before` is told.
    pub(super) fn decide_last_resort(&mut self, facts: &LastResortFacts, before: &Fittings) {
        let settings = &self.parameters.active().app.fittings;
        self.last_resort.decide(facts, settings);
        let now = self.last_resort.report(settings);
        self.drivers.news |= Fittings { supply_v: before.supply_v, ..now } != *before;
    }
}
