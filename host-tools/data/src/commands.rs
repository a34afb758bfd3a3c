//! What fins and propeller do between the samples of a log's commands.
//!
//! A log holds a command at some times. Between them an actuator either stays where it was put (zero-order hold: a
//! computer sets it) or moves on, and the log merely samples it (first-order hold: a straight line from sample to
//! sample is closest). Either may come late. [`Commands`] holds the samples, [`InputTiming`] says how each actuator
//! moves, and both together give [`InputLine`]s: what all actuators do from a time on.

use crate::log::{Column, Log, RADPS_PER_RPM};
use crate::stats::median;
use backseat_core::dynamics::{ActuatorInput, INPUTS};

/// Names of the actuators, in the order of [`InputTiming`].
pub const ACTUATORS: [&str; INPUTS] = ["propeller", "top fin", "bottom fin", "port fin", "starboard fin"];

/// Between samples further apart than this an actuator stays where it was, s.
const LONGEST_RAMP_S: f64 = 1.0;

/// What an actuator does from one sample of its command to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HoldKind {
    /// It stays: zero-order hold.
    #[default]
    Held,
    /// It moves in a straight line: first-order hold.
    Linear,
}

impl HoldKind {
    /// As in reports and in JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Held => "held",
            Self::Linear => "linear",
        }
    }
}

/// How one actuator follows its logged command.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hold {
    /// Between two samples.
    pub kind: HoldKind,
    /// From a sample to the actuator, s.
    pub delay_s: f64,
}

/// How every actuator follows: propeller, top, bottom, port, starboard. The default holds without delay.
pub type InputTiming = [Hold; INPUTS];

/// What all actuators do from a time on: a straight line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InputLine {
    /// From when on, s.
    pub from_s: f64,
    /// At that time.
    pub value: ActuatorInput,
    /// Per second.
    pub slope: ActuatorInput,
}

impl InputLine {
    /// At a time, s.
    #[must_use]
    pub fn at(&self, t_s: f64) -> ActuatorInput {
        let since_s = t_s - self.from_s;
        ActuatorInput {
            propeller_radps: self.value.propeller_radps + self.slope.propeller_radps * since_s,
            fins_rad: std::array::from_fn(|i| self.value.fins_rad[i] + self.slope.fins_rad[i] * since_s),
        }
    }
}

/// The commands of a log as they were sampled, each actuator by itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Commands([Vec<(f64, f64)>; INPUTS]);

impl Commands {
    /// The commands of a log; times are seconds since its first row.
    #[must_use]
    pub fn of(log: &Log) -> Self {
        let start_us = log.rows.first().map_or(0, |row| row.time_us);
        let mut commands = Self::default();
        for row in &log.rows {
            let t_s = (row.time_us - start_us) as f64 * 1e-6;
            for (actuator, samples) in commands.0.iter_mut().enumerate() {
                let column = Column::ALL[Column::PropRpm as usize + actuator];
                let unit = if actuator == 0 { RADPS_PER_RPM } else { 1.0 };
                samples.extend(row.get(column).map(|value| (t_s, value * unit)));
            }
        }
        commands
    }

    /// Whether some actuator has no sample.
    #[must_use]
    pub fn is_incomplete(&self) -> bool {
        self.0.iter().any(Vec::is_empty)
    }

    /// Time of the first moment at which every command is known, s.
    #[must_use]
    pub fn first_s(&self) -> f64 {
        self.0.iter().filter_map(|samples| Some(samples.first()?.0)).fold(0.0, f64::max)
    }

    /// Usual time between two samples of an actuator's command, s.
    #[must_use]
    pub fn period_s(&self, actuator: usize) -> Option<f64> {
        median(&self.0[actuator].windows(2).map(|pair| pair[1].0 - pair[0].0).collect::<Vec<_>>())
    }

    /// What the actuators do, in order of time; before the first sample of its command an actuator rests at zero.
    #[must_use]
    pub fn lines(&self, timing: &InputTiming) -> Vec<InputLine> {
        let mut changes: Vec<(f64, usize, f64, f64)> = Vec::new();
        for (actuator, (samples, hold)) in self.0.iter().zip(timing).enumerate() {
            for (k, (t_s, value)) in samples.iter().enumerate() {
                let slope = match samples.get(k + 1).filter(|_| hold.kind == HoldKind::Linear) {
                    Some((next_s, next)) if next_s - t_s <= LONGEST_RAMP_S && next_s > t_s => {
                        (next - value) / (next_s - t_s)
                    }
                    _ => 0.0,
                };
                changes.push((t_s + hold.delay_s, actuator, *value, slope));
            }
        }
        changes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut lines: Vec<InputLine> = Vec::new();
        let mut line = InputLine::default();
        for (t_s, actuator, value, slope) in changes {
            line = InputLine { from_s: t_s, value: line.at(t_s), ..line };
            let (of_value, of_slope) = (part(&mut line.value, actuator), slope);
            *of_value = value;
            *part(&mut line.slope, actuator) = of_slope;
            match lines.last_mut() {
                Some(last) if last.from_s == t_s => *last = line,
                _ => lines.push(line),
            }
        }
        // what changes nothing is no line of its own
        lines.dedup_by(|now, before| now.slope == before.slope && now.value == before.at(now.from_s));
        lines
    }
}

/// One actuator of an input.
pub fn part(input: &mut ActuatorInput, actuator: usize) -> &mut f64 {
    match actuator.checked_sub(1) {
        None => &mut input.propeller_radps,
        Some(fin) => &mut input.fins_rad[fin],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LogRow;

    fn log() -> Log {
        let mut log = Log::default();
        for k in 0..5_u64 {
            let mut row = LogRow::new(1_000_000 + k * 200_000);
            row.set_actuators(&ActuatorInput { propeller_radps: 100.0, fins_rad: [0.1 * k as f64, 0.0, 0.0, 0.0] });
            log.rows.push(row);
        }
        log
    }

    fn top(lines: &[InputLine], t_s: f64) -> f64 {
        lines[lines.partition_point(|line| line.from_s <= t_s) - 1].at(t_s).fins_rad[0]
    }

    #[test]
    fn val_commands_are_held_or_joined_and_late() {
        let commands = Commands::of(&log());
        assert!((commands.period_s(1).unwrap() - 0.2).abs() < 1e-12);
        assert_eq!((commands.first_s(), commands.is_incomplete()), (0.0, false));
        let mut timing = InputTiming::default();
        let held = commands.lines(&timing);
        assert_eq!(held.len(), 5);
        for (t_s, expected) in [(0.0, 0.0), (0.19, 0.0), (0.3, 0.1), (2.0, 0.4)] {
            assert!((top(&held, t_s) - expected).abs() < 1e-12, "{t_s}");
        }
        timing[1] = Hold { kind: HoldKind::Linear, delay_s: 0.05 };
        let late = commands.lines(&timing);
        for (t_s, expected) in [(0.05, 0.0), (0.15, 0.05), (0.3, 0.125), (2.0, 0.4)] {
            assert!((top(&late, t_s) - expected).abs() < 1e-12, "{t_s}: {}", top(&late, t_s));
        }
        assert!(late.iter().all(|line| (line.at(line.from_s + 0.01).propeller_radps - 100.0).abs() < 1e-9));
    }
}
