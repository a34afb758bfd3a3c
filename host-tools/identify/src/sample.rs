//! One instant of a log.

use backseat_core::dynamics::ActuatorInput;
use backseat_estimation::commands::{InputLine, part};
use nalgebra::{Vector3, Vector6};

/// Time between samples, s.
pub const PERIOD_S: f64 = 0.1;
/// Steps of integration in a period: roll, the fastest motion at 1 Hz, is right to 1e-4 of its amplitude.
pub const STEPS: usize = 2;

/// All channels at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time, µs.
    pub time_us: u64,
    /// Roll, pitch, heading, rad.
    pub attitude: Vector3<f64>,
    /// u, v, w through the water and p, q, r, m/s and rad/s.
    pub velocity: Vector6<f64>,
    /// What fins and propeller do from this instant until the next sample.
    pub input: PeriodInput,
}

/// What fins and propeller do over one period: in each step of integration a straight line, by its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeriodInput([[ActuatorInput; 2]; STEPS]);

impl PeriodInput {
    /// The same over the whole period.
    #[must_use]
    pub const fn held(input: ActuatorInput) -> Self {
        Self([[input; 2]; STEPS])
    }

    /// From lines in order of time, for the period that begins at a time, s: each step has the mean and the first moment
    /// of what the actuators do in it, so that neither velocity nor angle misses a jump within a step.
    #[must_use]
    pub fn of(lines: &[InputLine], from_s: f64) -> Self {
        let step_s = PERIOD_S / STEPS as f64;
        Self(core::array::from_fn(|step| over(lines, from_s + step as f64 * step_s, step_s)))
    }

    /// The ends of the line in one step.
    pub const fn step(&self, step: usize) -> &[ActuatorInput; 2] {
        &self.0[step]
    }

    /// After so many steps of integration: 0 is the start of the period, 2 its end.
    pub fn at_step(&self, instant: usize) -> ActuatorInput {
        match instant {
            0 => self.0[0][0],
            STEPS => self.0[STEPS - 1][1],
            _ => mean(&self.0[instant - 1][1], &self.0[instant][0]),
        }
    }

    /// Mean over the period.
    pub fn mean(&self) -> ActuatorInput {
        let [first, second] = self.0.map(|[from, to]| mean(&from, &to));
        mean(&first, &second)
    }

    /// Every actuator changed by a function of the mean over the period: what an effect makes of a command.
    pub fn changed(&self, change: impl FnOnce(&ActuatorInput) -> ActuatorInput) -> Self {
        let mut before = self.mean();
        let mut after = change(&before);
        let mut moved = *self;
        for actuator in 0..backseat_core::dynamics::INPUTS {
            let by = *part(&mut after, actuator) - *part(&mut before, actuator);
            for end in moved.0.iter_mut().flatten() {
                *part(end, actuator) += by;
            }
        }
        moved
    }
}

/// Between two inputs.
#[must_use]
pub fn mean(a: &ActuatorInput, b: &ActuatorInput) -> ActuatorInput {
    ActuatorInput {
        propeller_radps: 0.5 * (a.propeller_radps + b.propeller_radps),
        fins_rad: core::array::from_fn(|i| 0.5 * (a.fins_rad[i] + b.fins_rad[i])),
    }
}

/// The line with the mean and the first moment of the lines from a time on, s; by its ends.
fn over(lines: &[InputLine], from_s: f64, length_s: f64) -> [ActuatorInput; 2] {
    /// Changes this near to an end of a step are at that end, s: times are whole microseconds.
    const SAME_S: f64 = 1.0e-7;
    let to_s = from_s + length_s;
    let first = lines.partition_point(|line| line.from_s <= from_s + SAME_S).saturating_sub(1);
    let last = lines.partition_point(|line| line.from_s < to_s - SAME_S);
    let inside = lines.get(first..last).unwrap_or_default();
    match inside {
        [] => return [ActuatorInput::default(); 2],
        [only] => return [only.at(from_s), only.at(to_s)],
        _ => {}
    }
    let mut ends = [ActuatorInput::default(); 2];
    for actuator in 0..backseat_core::dynamics::INPUTS {
        let (mut area, mut moment) = (0.0, 0.0);
        for (k, line) in inside.iter().enumerate() {
            let begin_s = line.from_s.max(from_s);
            let end_s = inside.get(k + 1).map_or(to_s, |next| next.from_s);
            let (width_s, [a, b]) = (end_s - begin_s, [begin_s, end_s].map(|t_s| *part(&mut line.at(t_s), actuator)));
            let middle = 0.5 * (a + b);
            area += middle * width_s;
            moment += middle * width_s * (0.5 * (begin_s + end_s) - from_s - 0.5 * length_s);
            moment += (b - a) * width_s * width_s / 12.0;
        }
        let (mean, rise) = (area / length_s, 12.0 * moment / (length_s * length_s));
        *part(&mut ends[0], actuator) = mean - 0.5 * rise;
        *part(&mut ends[1], actuator) = mean + 0.5 * rise;
    }
    ends
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_a_step_has_the_area_and_the_moment_of_what_happens_in_it() {
        let line = |from_s: f64, value: f64, slope: f64| InputLine {
            from_s,
            value: ActuatorInput { propeller_radps: value, ..ActuatorInput::default() },
            slope: ActuatorInput { propeller_radps: slope, ..ActuatorInput::default() },
        };
        let lines = [line(0.0, 1.0, 0.0), line(0.02, 3.0, 10.0), line(0.06, 2.0, 0.0)];
        let found = PeriodInput::of(&lines, 0.0);
        for (step, from_s) in [0.0, 0.05].into_iter().enumerate() {
            // Sums over fine slices of the step, and of the line that stands for it.
            let [from, to] = found.step(step).map(|input| input.propeller_radps);
            let (mut area, mut moment) = (0.0, 0.0);
            for k in 0..5000 {
                let s = (f64::from(k) + 0.5) / 5000.0;
                let at = lines[lines.partition_point(|line| line.from_s <= from_s + 0.05 * s) - 1];
                let difference = at.at(from_s + 0.05 * s).propeller_radps - (from + (to - from) * s);
                area += difference / 5000.0;
                moment += difference * (s - 0.5) / 5000.0;
            }
            assert!(area.abs() < 1e-3 && moment.abs() < 1e-3, "{area} {moment}");
        }
        let held = PeriodInput::of(&lines[..1], 0.3);
        assert_eq!(held, PeriodInput::held(lines[0].value));
        assert_eq!(held.mean(), lines[0].value);
    }
}
