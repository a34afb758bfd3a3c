//! Samples of sensors and commands of the actuators, on one clock.
//!
//! Sensors sample at their own rates and are heard late. Each keeps its last few samples; what they said at one time in the
//! recent past is interpolated, so that all channels of a sample belong together. Commands are known ahead.

use crate::estimator::Latest;
use backseat_core::dynamics::{ActuatorInput, FINS};
use backseat_core::state::wrap_angle;
use heapless::Deque;

/// Samples of one sensor: one a step, so that these reach back 0.8 s.
const SAMPLES: usize = 8;
/// Across a longer gap nothing is interpolated, µs: a sensor of 2 Hz may be late by a tenth.
const LONGEST_GAP_US: u64 = 550_000;
/// Commands of the steps within the longest delay of sensors and actuators together.
const COMMANDS: usize = 24;

/// A sensor's recent samples, three numbers each.
pub struct Channel {
    /// Oldest first.
    samples: [(u64, [f64; 3]); SAMPLES],
    count: usize,
}

impl Channel {
    pub const fn new() -> Self {
        Self { samples: [(0, [0.0; 3]); SAMPLES], count: 0 }
    }

    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Takes the latest sample, if it is a new one.
    pub fn take(&mut self, latest: Latest<[f64; 3]>) {
        let Some((time_us, value)) = latest else { return };
        let kept = self.kept();
        if kept.last().is_some_and(|(last_us, _)| time_us <= *last_us) {
            return;
        }
        if self.count == SAMPLES {
            self.samples.rotate_left(1);
            self.count -= 1;
        }
        if let Some(place) = self.samples.get_mut(self.count) {
            *place = (time_us, value);
            self.count += 1;
        }
    }

    fn kept(&self) -> &[(u64, [f64; 3])] {
        self.samples.get(..self.count).unwrap_or_default()
    }

    /// Mean time between the kept samples, s; `None` with fewer than three.
    pub fn interval_s(&self) -> Option<f64> {
        let [(first_us, _), .., (last_us, _)] = self.kept() else { return None };
        let intervals = self.count.saturating_sub(1);
        (intervals >= 2).then(|| last_us.saturating_sub(*first_us) as f64 * 1e-6 / intervals as f64)
    }

    /// Its value at a time between two samples; `None` outside, or across a gap.
    pub fn at(&self, time_us: u64) -> Option<[f64; 3]> {
        self.interpolated(time_us, |change| change)
    }

    /// The same of angles, the short way round.
    pub fn angles_at(&self, time_us: u64) -> Option<[f64; 3]> {
        self.interpolated(time_us, wrap_angle)
    }

    fn interpolated(&self, time_us: u64, change: fn(f64) -> f64) -> Option<[f64; 3]> {
        let kept = self.kept();
        let behind = kept.partition_point(|(sample_us, _)| *sample_us < time_us);
        let (after_us, after) = kept.get(behind)?;
        if *after_us == time_us {
            return Some(*after);
        }
        let (before_us, before) = kept.get(behind.checked_sub(1)?)?;
        let gap_us = after_us.saturating_sub(*before_us);
        if gap_us > LONGEST_GAP_US {
            return None;
        }
        let share = time_us.saturating_sub(*before_us) as f64 / gap_us as f64;
        let mut value = *before;
        for (value, after) in value.iter_mut().zip(after) {
            *value += share * change(*after - *value);
        }
        Some(value)
    }
}

/// What the actuators were told, each command from a time on.
pub struct Commands {
    commands: Deque<(u64, ActuatorInput), COMMANDS>,
}

impl Commands {
    pub const fn new() -> Self {
        Self { commands: Deque::new() }
    }

    pub fn clear(&mut self) {
        self.commands.clear();
    }

    /// The actuators do `input` from `time_us` on.
    pub fn push(&mut self, time_us: u64, input: &ActuatorInput) {
        if self.commands.is_full() {
            self.commands.pop_front();
        }
        let _ = self.commands.push_back((time_us, *input));
    }

    /// Mean of what the actuators did from one time to a later one; `None` where that is not known from the beginning.
    pub fn mean(&self, from_us: u64, to_us: u64) -> Option<ActuatorInput> {
        if self.commands.front().is_none_or(|(first_us, _)| *first_us > from_us) {
            return None;
        }
        let span_us = to_us.saturating_sub(from_us);
        let mut mean = ActuatorInput { propeller_radps: 0.0, fins_rad: [0.0; FINS] };
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

    #[test]
    fn val_samples_are_interpolated_and_gaps_are_not() {
        let mut channel = Channel::new();
        for (time_us, x) in [(100_000, 1.0), (100_000, 9.0), (300_000, 2.0), (400_000, -3.0), (1_000_000, 0.0)] {
            channel.take(Some((time_us, [x, 0.0, 0.0])));
        }
        let x = |time_us| channel.at(time_us).map(|value| value[0]);
        assert_eq!([x(99_999), x(100_000), x(150_000), x(350_000)], [None, Some(1.0), Some(1.25), Some(-0.5)]);
        assert_eq!([x(700_000), x(1_000_000), x(1_000_001)], [None, Some(0.0), None]);
        assert_eq!(channel.interval_s(), Some(0.3));
    }

    #[test]
    fn val_angles_go_the_short_way() {
        let mut channel = Channel::new();
        channel.take(Some((0, [0.0, 0.0, 3.1])));
        channel.take(Some((100_000, [0.0, 0.0, -3.1])));
        // halfway between 3.1 and 2π − 3.1
        let heading = channel.angles_at(50_000).unwrap()[2];
        assert!((heading - core::f64::consts::PI).abs() < 1e-12, "{heading}");
    }

    #[test]
    fn only_the_last_samples_are_kept() {
        let mut channel = Channel::new();
        for i in 0..20 {
            channel.take(Some((i * 100_000, [i as f64; 3])));
        }
        assert_eq!(channel.at(1_100_000), None);
        assert_eq!(channel.at(1_250_000), Some([12.5; 3]));
    }

    #[test]
    fn val_commands_are_averaged_over_time() {
        let input = |propeller_radps| ActuatorInput { propeller_radps, fins_rad: [propeller_radps; 4] };
        let mut commands = Commands::new();
        assert_eq!(commands.mean(0, 100), None);
        for (time_us, omega) in [(1000, 1.0), (1100, 2.0), (1150, 4.0)] {
            commands.push(time_us, &input(omega));
        }
        assert_eq!(commands.mean(999, 1100), None);
        assert_eq!(commands.mean(1000, 1100), Some(input(1.0)));
        // 50 µs of 1, 50 of 2, 100 of 4
        assert_eq!(commands.mean(1050, 1250), Some(input(2.75)));
    }
}
