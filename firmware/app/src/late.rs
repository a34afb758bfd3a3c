//! Steps that come late: counted, and too many of them in a row are a reason to end a mission. Late is a whole step, in
//! one or little by little.

use crate::time::STEP_US;

/// A late step weighs as much as so many in time ...
const WEIGHT: u8 = 4;
/// ... and from this weight on the board does not keep up: five late steps in a row, or one in four for long.
const OVERLOADED: u8 = 5 * WEIGHT;
/// Forgotten after 4 s in time.
const MOST: u8 = 2 * OVERLOADED;

/// Since start.
#[derive(Clone, Copy, Debug)]
pub struct LateSteps {
    /// How many came a whole step late or more.
    pub count: u32,
    /// By how much the latest was, µs.
    pub latest_us: u32,
    /// By how much the steps are late that count as in time, µs.
    behind_us: u64,
    weight: u8,
}

impl LateSteps {
    pub const NONE: Self = Self { count: 0, latest_us: 0, behind_us: 0, weight: 0 };

    /// The time from the step before to this one, µs; whether it was late.
    pub fn note(&mut self, since_last_us: u64) -> bool {
        let late_us = self.behind_us.saturating_add(since_last_us).saturating_sub(STEP_US);
        let is_late = late_us >= STEP_US;
        self.behind_us = late_us % STEP_US;
        if is_late {
            self.count = self.count.saturating_add(1);
            self.latest_us =
                self.latest_us.max(u32::try_from(since_last_us.saturating_sub(STEP_US)).unwrap_or(u32::MAX));
            self.weight = (self.weight + WEIGHT).min(MOST);
        } else {
            self.weight = self.weight.saturating_sub(1);
        }
        is_late
    }

    /// The board does not keep up with its steps.
    pub const fn is_overloaded(&self) -> bool {
        self.weight >= OVERLOADED
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn five_in_a_row_are_too_many_and_some_now_and_then_are_not() {
        let mut late = LateSteps::NONE;
        for k in 1..=5 {
            assert!(late.note(2 * STEP_US));
            assert_eq!(late.is_overloaded(), k == 5, "step {k}");
        }
        assert_eq!((late.count, late.latest_us), (5, 100_000));
        assert!(!late.note(STEP_US) && !late.is_overloaded());
        let mut late = LateSteps::NONE;
        for step in 0..1000 {
            late.note(if step % 6 == 0 { 3 * STEP_US } else { STEP_US });
            assert!(!late.is_overloaded(), "step {step}");
        }
        let steps = (0..1000).take_while(|step| {
            late.note(if step % 4 == 0 { 2 * STEP_US } else { STEP_US });
            !late.is_overloaded()
        });
        assert!(steps.count() < 100, "every fourth");
    }

    #[test]
    fn steps_that_are_each_a_little_late_are_too_late_together() {
        let mut late = LateSteps::NONE;
        for step in 0..1000 {
            // on time on the whole
            assert!(!late.note(if step % 2 == 0 { 150_000 } else { 50_000 }));
            assert!(!late.is_overloaded());
        }
        let steps = (0..1000).take_while(|_| {
            late.note(190_000);
            !late.is_overloaded()
        });
        assert!(steps.count() < 10, "half of all steps are missing");
    }
}
