//! What a watchdog is fed by: a navigation step that ran in time, whatever clock the pump runs on.

use crate::app::App;
use crate::pump::{Pump, SILENT_US, START_US};
use crate::time::STEP_US;

/// A step later than this is not in time, µs.
const LATE_US: u64 = 3 * STEP_US;

/// When the last navigation step ran, by the board's own time. No message of a host can feed it, and none can stop a
/// step of the board's own clock.
#[derive(Debug)]
pub struct StepWatch {
    /// The app's time of the last step: the host's under lock-step.
    stepped_us: Option<u64>,
    /// The board's time when it was seen.
    ran_us: u64,
}

impl StepWatch {
    /// At start: the first step is due when the pump's wait for a lock-step clock ends.
    #[must_use]
    pub const fn new(now_us: u64) -> Self {
        Self { stepped_us: None, ran_us: now_us }
    }

    /// Looks whether a step ran since the last look; after each poll of the pump.
    pub fn look(&mut self, app: &App, now_us: u64) -> bool {
        let stepped = app.stepped_us() != self.stepped_us;
        if stepped {
            (self.stepped_us, self.ran_us) = (app.stepped_us(), now_us);
        }
        stepped
    }

    /// Whether the last step is as young as it has to be: 0.3 s, and as much more as the pump waits for a lock-step
    /// clock.
    #[must_use]
    pub fn is_in_time(&self, pump: &Pump, now_us: u64) -> bool {
        let waits_us = if pump.is_waiting() {
            START_US
        } else if pump.is_lockstep() {
            SILENT_US
        } else {
            0
        };
        now_us.saturating_sub(self.ran_us) <= waits_us + LATE_US
    }
}
