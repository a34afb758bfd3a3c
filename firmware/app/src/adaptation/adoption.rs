//! When identified parameters are used, and when they are given up again.
//!
//! ```text
//!            settled               a window of stretches
//! learning ───────────> candidate ─────────────────────> better by more than chance? ── no ──> refused, next candidate
//!                       (frozen)                              │ yes
//!                                                             v
//!            next candidate <──────────────────────────── adopted; the set before stays in the comparison for a window:
//!                                                         better by more than chance?  ── yes ──> reverted
//! ```
//!
//! A candidate is the averaged estimate at one time, frozen. It has to predict later motion, to which it was not
//! fitted. Candidate and set in use start every stretch of 15 s from the same measurement and get the same inputs.
//! "Better by more than chance" is a paired, one-sided t-test of the logarithm of their error ratios, stretch by
//! stretch ([`ComparisonEvidence::is_better`]), judged once, at the end of the window. A stored set is one that passed
//! its probation.

use crate::parameters::AppSettings;
use backseat_core::dynamics::VehicleParameters;
use backseat_core::identification::theta::{theta_of, with_theta};
use backseat_core::identification::{
    ComparisonEvidence, FEWEST_STRETCHES, HORIZON_STEPS, Identifier, ModelComparison, ModelRole, Theta,
};
use backseat_wire::hostlink::{Adoption, AdoptionEvent};
use heapless::Deque;

/// Verdicts that wait for the next report.
const WAITING: usize = 4;
/// Duration of a stretch, s.
const STRETCH_S: f64 = HORIZON_STEPS as f64 * 0.1;

/// Decision about the set in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Nothing.
    Keep,
    /// The candidate is better.
    Adopt,
    /// The set before is better.
    Revert,
}

/// The state of trial and probation.
pub struct Adoptions {
    /// What was in use before the last adoption.
    previous: Option<VehicleParameters>,
    /// Time of adaptation when the last candidate was frozen, s.
    frozen_s: f64,
    changes: u16,
    /// The host took an adoption back: no more until the next start.
    held: bool,
    /// The set in use passed its probation and is not stored yet.
    to_store: bool,
    verdicts: Deque<Adoption, WAITING>,
    /// The evidence that the decision under way rests on.
    evidence: ComparisonEvidence,
}

impl Adoptions {
    pub const fn new() -> Self {
        Self {
            previous: None,
            frozen_s: 0.0,
            changes: 0,
            held: false,
            to_store: false,
            verdicts: Deque::new(),
            evidence: ComparisonEvidence::NONE,
        }
    }

    /// The set in use was replaced from outside: the evidence about it is forgotten.
    pub fn restart(&mut self) {
        *self = Self::new();
    }

    /// Puts the set in use into a fresh comparison.
    pub fn begin(&mut self, comparison: &mut ModelComparison, active: &VehicleParameters) {
        comparison.enter(ModelRole::Active, Some(&theta_of(active)));
        self.frozen_s = 0.0;
    }

    /// The set in use has passed its probation and is not stored yet; asked once.
    pub fn take_to_store(&mut self) -> bool {
        core::mem::take(&mut self.to_store)
    }

    /// No more adoptions.
    pub fn hold(&mut self) {
        self.held = true;
        self.to_store = false;
    }

    /// The next verdict for the host.
    pub fn take_verdict(&mut self) -> Option<Adoption> {
        self.verdicts.pop_front()
    }

    fn say(&mut self, time_us: u64, event: AdoptionEvent, evidence: &ComparisonEvidence) {
        if self.verdicts.is_full() {
            self.verdicts.pop_front();
        }
        let [error_active, error_other] = evidence.error;
        let standard_error = evidence.standard_error();
        let gain = [evidence.gain, if standard_error.is_finite() { standard_error } else { 0.0 }];
        let (changes, stretches) = (self.changes, evidence.stretches);
        let _ =
            self.verdicts.push_back(Adoption { time_us, event, changes, stretches, error_active, error_other, gain });
    }

    /// After a stretch: probation first, then the trial, then a new candidate.
    pub fn judge(
        &mut self,
        now_us: u64,
        identifier: &Identifier,
        comparison: &mut ModelComparison,
        settings: &AppSettings,
    ) -> Decision {
        let window = ((settings.adopt_window_s / STRETCH_S) as u16).max(FEWEST_STRETCHES);
        if comparison.theta(ModelRole::Previous).is_some() {
            let evidence = comparison.evidence(ModelRole::Previous);
            if evidence.stretches >= window {
                comparison.enter(ModelRole::Previous, None);
                if evidence.is_better() {
                    self.evidence = evidence;
                    return Decision::Revert;
                }
                self.to_store = true;
            }
        }
        if comparison.theta(ModelRole::Candidate).is_some() {
            let evidence = comparison.evidence(ModelRole::Candidate);
            if evidence.stretches < window {
                return Decision::Keep;
            }
            // The robust filter estimates these parameters itself, and each has one estimator only.
            if evidence.is_better() && settings.adopt && !settings.robust && !self.held {
                self.evidence = evidence;
                return Decision::Adopt;
            }
            let event = if evidence.is_better() { AdoptionEvent::Advised } else { AdoptionEvent::Refused };
            self.say(now_us, event, &evidence);
            comparison.enter(ModelRole::Candidate, None);
        }
        self.freeze(identifier, comparison, settings);
        Decision::Keep
    }

    /// Takes the present estimate as the next candidate, once it has settled.
    fn freeze(&mut self, identifier: &Identifier, comparison: &mut ModelComparison, settings: &AppSettings) {
        let adapted_s = identifier.adapted_s();
        let learned_more = adapted_s > self.frozen_s;
        if let Some(estimate) = identifier.estimate()
            && adapted_s >= settings.adapt_settle_s
            && learned_more
        {
            comparison.enter(ModelRole::Candidate, Some(&estimate));
            self.frozen_s = adapted_s;
        }
    }

    /// The candidate as a vehicle.
    pub fn candidate(&self, comparison: &ModelComparison, active: &VehicleParameters) -> Option<VehicleParameters> {
        comparison.theta(ModelRole::Candidate).map(|theta: &Theta| with_theta(active, theta))
    }

    /// Puts the candidate into use; the set before stays in the comparison. `None`: it is not a valid vehicle.
    pub fn adopted(&mut self, now_us: u64, comparison: &mut ModelComparison, before: Option<&VehicleParameters>) {
        let evidence = self.evidence;
        let candidate = comparison.theta(ModelRole::Candidate).copied();
        comparison.enter(ModelRole::Candidate, None);
        if let (Some(before), Some(theta)) = (before, candidate) {
            self.previous = Some(*before);
            self.changes = self.changes.saturating_add(1);
            self.to_store = false;
            let active = comparison.theta(ModelRole::Active).copied();
            comparison.enter(ModelRole::Previous, active.as_ref());
            comparison.enter(ModelRole::Active, Some(&theta));
            self.say(now_us, AdoptionEvent::Adopted, &evidence);
        } else {
            self.say(now_us, AdoptionEvent::Invalid, &evidence);
        }
    }

    /// What was in use before the last adoption.
    pub fn previous(&self) -> Option<VehicleParameters> {
        self.previous
    }

    /// Returns to that set.
    pub fn reverted(&mut self, now_us: u64, comparison: &mut ModelComparison, event: AdoptionEvent) {
        let evidence = if event == AdoptionEvent::Reverted { self.evidence } else { ComparisonEvidence::NONE };
        if let Some(previous) = self.previous.take() {
            comparison.enter(ModelRole::Active, Some(&theta_of(&previous)));
        }
        comparison.enter(ModelRole::Previous, None);
        comparison.enter(ModelRole::Candidate, None);
        self.changes = self.changes.saturating_add(1);
        self.to_store = false;
        self.say(now_us, event, &evidence);
    }

    /// The set in use was written to the board's memory, or could not be.
    pub fn stored(&mut self, now_us: u64, kept: bool) {
        let event = if kept { AdoptionEvent::Stored } else { AdoptionEvent::StoreFailed };
        self.say(now_us, event, &ComparisonEvidence::NONE);
    }

    /// What a dive has learnt was written to the board's memory, or could not be.
    pub fn learnt(&mut self, now_us: u64, kept: bool) {
        let event = if kept { AdoptionEvent::Learnt } else { AdoptionEvent::LearntFailed };
        self.say(now_us, event, &ComparisonEvidence::NONE);
    }
}
