//! What fins and propeller do between the samples of a log's commands.
//!
//! A log holds a command at some times. Between them an actuator either stays where it was put (zero-order hold: a
//! computer sets it) or moves on, and the log merely samples it: then a cubic through the samples is closest (Catmull
//! and Rom 1974: its slope at a sample is that of the parabola through the neighbours). Either may come late.
//! [`Commands`] holds the samples, [`InputTiming`] says how each actuator moves, and both together give [`InputLine`]s:
//! what all actuators do from a time on.

use backseat_core::dynamics::{ActuatorInput, INPUTS};
use backseat_logs::log::{Column, Log, RADPS_PER_RPM};
use backseat_logs::stats::median;

/// Names of the actuators, in the order of [`InputTiming`].
pub const ACTUATORS: [&str; INPUTS] = ["propeller", "top fin", "bottom fin", "port fin", "starboard fin"];

/// Between samples further apart than this an actuator stays where it was, s.
const LONGEST_CURVE_S: f64 = 1.0;

/// What an actuator does from one sample of its command to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HoldKind {
    /// It stays: zero-order hold.
    #[default]
    Held,
    /// It moves on, along a smooth curve through the samples.
    Continuous,
}

impl HoldKind {
    /// As in reports and in JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Held => "held",
            Self::Continuous => "continuous",
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
    pub fn is_incomplete(&self) -> bool {
        self.0.iter().any(Vec::is_empty)
    }

    /// Time of the first moment at which every command is known, s.
    pub fn first_s(&self) -> f64 {
        self.0.iter().filter_map(|samples| Some(samples.first()?.0)).fold(0.0, f64::max)
    }

    /// Usual time between two samples of an actuator's command, s.
    pub fn period_s(&self, actuator: usize) -> Option<f64> {
        median(&self.0[actuator].windows(2).map(|pair| pair[1].0 - pair[0].0).collect::<Vec<_>>())
    }

    /// What the actuators do, in order of time; before the first sample of its command an actuator rests at zero.
    pub fn lines(&self, timing: &InputTiming) -> Vec<InputLine> {
        let mut changes: Vec<(f64, usize, f64, f64)> = Vec::new();
        for (actuator, (samples, hold)) in self.0.iter().zip(timing).enumerate() {
            for (k, (t_s, held)) in samples.iter().enumerate() {
                let curve = if hold.kind == HoldKind::Continuous { line_of_curve(samples, k) } else { None };
                let (value, slope) = curve.unwrap_or((*held, 0.0));
                changes.push((t_s + hold.delay_s, actuator, value, slope));
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

/// The straight line with the mean and the first moment of the cubic from sample `k` to the next: its value at the
/// sample, and its slope. What it leaves of the cubic moves no velocity from sample to sample.
fn line_of_curve(samples: &[(f64, f64)], k: usize) -> Option<(f64, f64)> {
    let rise = |k: usize| {
        let ([from_s, from], [to_s, to]) = ((*samples.get(k)?).into(), (*samples.get(k + 1)?).into());
        let h_s: f64 = to_s - from_s;
        (h_s > 0.0 && h_s <= LONGEST_CURVE_S).then(|| (h_s, (to - from) / h_s))
    };
    let (h_s, secant) = rise(k)?;
    // Slope of the parabola through three samples, at the one between two secants; of one secant at the end of a curve.
    let tangent = |neighbour: Option<(f64, f64)>| {
        neighbour.map_or(secant, |(other_s, other)| (other * h_s + secant * other_s) / (h_s + other_s))
    };
    let [first, last] = [tangent(k.checked_sub(1).and_then(rise)), tangent(rise(k + 1))];
    // Mean and first moment of Hermite's cubic.
    let slope = 1.2 * secant - 0.1 * (first + last);
    let mean = samples[k].1 + h_s * (0.5 * secant + (first - last) / 12.0);
    Some((mean - 0.5 * h_s * slope, slope))
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
    use backseat_logs::LogRow;

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
        timing[1] = Hold { kind: HoldKind::Continuous, delay_s: 0.05 };
        let late = commands.lines(&timing);
        for (t_s, expected) in [(0.05, 0.0), (0.15, 0.05), (0.3, 0.125), (2.0, 0.4)] {
            assert!((top(&late, t_s) - expected).abs() < 1e-12, "{t_s}: {}", top(&late, t_s));
        }
        assert!(late.iter().all(|line| (line.at(line.from_s + 0.01).propeller_radps - 100.0).abs() < 1e-9));
    }
    /// A sine of 2 s sampled at 10 Hz, fins at times of their own: area and first moment over each step against
    /// closed forms.
    #[test]
    fn val_a_sampled_sine_keeps_area_and_moment() {
        let omega = std::f64::consts::PI;
        let times: Vec<f64> = (0..40).map(|k| 0.1 * f64::from(k) + 0.02 * f64::from(k % 3)).collect();
        let samples: Vec<(f64, f64)> = times.iter().map(|t_s| (*t_s, (omega * t_s).sin())).collect();
        let integral = |t_s: f64| -(omega * t_s).cos() / omega;
        let moment = |t_s: f64| (omega * t_s).sin() / (omega * omega) + t_s * integral(t_s);
        for (k, pair) in times.windows(2).enumerate().take(38).skip(1) {
            let (value, slope) = line_of_curve(&samples, k).unwrap();
            let (from_s, h_s) = (pair[0], pair[1] - pair[0]);
            let mean = (integral(pair[1]) - integral(from_s)) / h_s;
            let middle_s = from_s + 0.5 * h_s;
            let tilt = moment(pair[1]) - moment(from_s) - middle_s * mean * h_s;
            // Straight lines between the samples: 1e-2 and 4e-3.
            assert!((value + 0.5 * h_s * slope - mean).abs() < 1.0e-3, "{k}");
            assert!((slope - 12.0 * tilt / h_s.powi(3)).abs() < 2.0e-2 * omega, "{k}");
        }
    }
}
