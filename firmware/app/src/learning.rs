//! What a dive has learnt of the vehicle is kept for the next one.
//!
//! At the end of a mission the posterior of the robust filter's states of the vehicle becomes the section `learnt` of
//! the active parameters, and the board is asked to write them: once a dive, and only when no mission is under way,
//! because an erase takes seconds. The filter starts from there when it is initialised again, after the next power-up
//! at the latest. What a dive has learnt until the power fails under way is lost; what those before it have learnt is
//! not.

use crate::held::Held;
use crate::time::STEP_US;
use backseat_wire::hostlink::LearntStored;

/// A shorter dive shows less of the vehicle than handling it before the next dive takes away, µs.
const SHORTEST_DIVE_US: u64 = 600_000_000;

/// Where the present dive stands.
#[derive(Clone, Debug)]
pub struct Learning {
    /// Time under water in the mission under way, µs.
    submerged_us: u64,
    under_way: bool,
    /// What was learnt is in use and not written yet.
    to_store: bool,
    /// It was written, or could not be, and the host has not been told.
    stored: Held<LearntStored>,
}

impl Learning {
    pub const fn new() -> Self {
        Self { submerged_us: 0, under_way: false, to_store: false, stored: Held::none() }
    }

    /// One step; true when a mission has just ended that was long enough to learn from.
    pub fn ends(&mut self, under_way: bool, submerged: bool) -> bool {
        let ends = self.under_way && !under_way && self.submerged_us >= SHORTEST_DIVE_US;
        if !under_way {
            self.submerged_us = 0;
        } else if submerged {
            self.submerged_us = self.submerged_us.saturating_add(STEP_US);
        }
        self.under_way = under_way;
        ends
    }

    /// The active parameters hold what was learnt.
    pub fn kept(&mut self) {
        self.to_store = true;
    }

    /// They are not written yet; asked once.
    pub fn take_to_store(&mut self) -> bool {
        core::mem::take(&mut self.to_store)
    }

    /// What was learnt was written to the board's memory, or could not be.
    pub fn stored(&mut self, time_us: u64, kept: bool) {
        self.stored.set(LearntStored { time_us, kept });
    }

    /// The same for the host, once.
    pub fn take_report(&mut self) -> Option<LearntStored> {
        self.stored.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_dive_of_ten_minutes_counts() {
        for (steps, counts) in [(5_999, false), (6_000, true)] {
            let mut learning = Learning::new();
            assert!(!learning.ends(false, true), "not under way");
            for _ in 0..steps {
                assert!(!learning.ends(true, true));
            }
            assert!(!learning.ends(true, false), "surfaced");
            assert_eq!(learning.ends(false, false), counts);
            assert!(!learning.ends(false, false), "once");
        }
    }
}
