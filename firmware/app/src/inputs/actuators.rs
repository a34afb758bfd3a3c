//! History of the actuator commands, each with the time from which on it holds.

use super::insert;
use backseat_core::dynamics::{ActuatorInput, FINS};
use heapless::Vec;

/// Commands of 0.1 s each: the identifier looks back 0.7 s, the filter lags by up to 2 s of declared delay, and
/// commands act up to 1 s after they were sent.
const COMMANDS: usize = 40;

const NEUTRAL: ActuatorInput = ActuatorInput { propeller_radps: 0.0, fins_rad: [0.0; FINS] };

/// The one history of actuator commands, in order of time.
pub struct ActuatorHistory {
    /// Oldest first.
    commands: Vec<(u64, ActuatorInput), COMMANDS>,
    /// The command before the first of them.
    before: ActuatorInput,
}

impl ActuatorHistory {
    /// Neutral at all times.
    #[must_use]
    pub const fn new() -> Self {
        Self { commands: Vec::new(), before: NEUTRAL }
    }

    /// Forgets all commands.
    pub fn clear(&mut self) {
        self.commands.clear();
        self.before = NEUTRAL;
    }

    /// Adds a command that holds from `time_us` on.
    pub fn push(&mut self, time_us: u64, input: &ActuatorInput) {
        if self.commands.is_full() {
            self.before = self.commands.remove(0).1;
        }
        let place = self.commands.partition_point(|(other_us, _)| *other_us <= time_us);
        // there is room now
        insert(&mut self.commands, place, (time_us, *input));
    }

    /// The command at a time.
    #[must_use]
    pub fn at(&self, time_us: u64) -> &ActuatorInput {
        self.commands.iter().rev().find(|(from_us, _)| *from_us <= time_us).map_or(&self.before, |(_, input)| input)
    }

    /// The first change after `from_us` and until `to_us`.
    #[must_use]
    pub fn next_change_us(&self, from_us: u64, to_us: u64) -> Option<u64> {
        self.commands.iter().map(|(time_us, _)| *time_us).find(|us| *us > from_us && *us <= to_us)
    }

    /// Mean of the commands from one time to a later one; `None` if the history does not reach back so far.
    #[must_use]
    pub fn mean(&self, from_us: u64, to_us: u64) -> Option<ActuatorInput> {
        if self.commands.first().is_none_or(|(first_us, _)| *first_us > from_us) {
            return None;
        }
        let span_us = to_us.saturating_sub(from_us);
        let mut mean = NEUTRAL;
        let mut commands = self.commands.iter().peekable();
        while let Some((begin_us, input)) = commands.next() {
            let end_us = commands.peek().map_or(u64::MAX, |(next_us, _)| *next_us);
            let (begin_us, end_us) = ((*begin_us).max(from_us), end_us.min(to_us));
            let share = end_us.saturating_sub(begin_us) as f64 / span_us as f64;
            if share > 0.0 {
                mean.propeller_radps += share * input.propeller_radps;
                for (fin, command) in mean.fins_rad.iter_mut().zip(input.fins_rad) {
                    *fin += share * command;
                }
            }
        }
        Some(mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input(propeller_radps: f64) -> ActuatorInput {
        ActuatorInput { propeller_radps, fins_rad: [propeller_radps; 4] }
    }

    #[test]
    fn val_commands_are_averaged_over_time() {
        let mut history = ActuatorHistory::new();
        assert_eq!(history.mean(0, 100), None);
        for (time_us, omega) in [(1000, 1.0), (1100, 2.0), (1150, 4.0)] {
            history.push(time_us, &input(omega));
        }
        assert_eq!(history.mean(999, 1100), None);
        assert_eq!(history.mean(1000, 1100), Some(input(1.0)));
        // 50 µs of 1, 50 of 2, 100 of 4
        assert_eq!(history.mean(1050, 1250), Some(input(2.75)));
    }

    #[test]
    fn a_command_holds_until_the_next() {
        let mut history = ActuatorHistory::new();
        history.push(100, &input(1.0));
        history.push(300, &input(3.0));
        assert_eq!([99, 100, 299, 300].map(|us| history.at(us).propeller_radps), [0.0, 1.0, 1.0, 3.0]);
        assert_eq!([history.next_change_us(100, 299), history.next_change_us(100, 300)], [None, Some(300)]);
        history.push(200, &input(2.0));
        assert_eq!([199, 200, 300].map(|us| history.at(us).propeller_radps), [1.0, 2.0, 3.0]);
        for i in 0..100 {
            history.push(1000 + i, &input(i as f64));
        }
        assert_eq!(history.at(1010).propeller_radps, 59.0, "what held before the first that is kept");
    }
}
