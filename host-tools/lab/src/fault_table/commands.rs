//! Check of every sentence to the frontseat.

use backseat_core::control::limits::ActuatorLimits;
use backseat_wire::iver::servo::{LinearServo, ServoCalibration};
use backseat_wire::iver::{Servo, ServoBytes, Steer, ToFrontseat, Units};
use backseat_wire::nmea::{Checksum, Framer};
use std::collections::BTreeSet;

/// Longest timeout that a command may carry, s: silence must be safe soon.
const TIMEOUT_S: u8 = 2;
/// Fastest speed asked of the frontseat, m/s.
const SPEED_MPS: f64 = 3.0;

/// Commands against their limits and rates.
pub struct CommandWatch {
    framer: Framer,
    units: Units,
    servo: ServoCalibration,
    limits: ActuatorLimits,
    last: (u64, ServoBytes),
    /// Steering commands.
    pub commands: u32,
    /// Neutral fins with a stopped propeller.
    pub neutral: u32,
    /// `$OMSTOP`.
    pub stops: u32,
    /// Violations, each kind once.
    pub violations: BTreeSet<String>,
}

impl Default for CommandWatch {
    fn default() -> Self {
        Self {
            framer: Framer::new(Checksum::Required),
            units: Units::remote_helm(5),
            servo: ServoCalibration::NOMINAL,
            limits: ActuatorLimits::DEFAULT,
            last: (0, ServoBytes::NEUTRAL),
            commands: 0,
            neutral: 0,
            stops: 0,
            violations: BTreeSet::new(),
        }
    }
}

impl CommandWatch {
    /// The board was reset: a sentence may have been cut, and the fins start again from where the frontseat has put
    /// them.
    pub fn reset(&mut self, time_us: u64) {
        self.framer = Framer::new(Checksum::Required);
        self.last = (time_us, ServoBytes::NEUTRAL);
    }

    /// Takes the bytes of one step.
    pub fn hear(&mut self, time_us: u64, mut bytes: &[u8], mission: bool) {
        let mut framer = std::mem::replace(&mut self.framer, Framer::new(Checksum::Required));
        while let Some(outcome) = framer.feed(&mut bytes) {
            match outcome.map(|sentence| ToFrontseat::parse(&sentence, &self.units)) {
                Ok(Ok(command)) => self.judge(time_us, &command, mission),
                Ok(Err(error)) | Err(error) => {
                    self.violations.insert(format!("a malformed sentence ({error:?})"));
                }
            }
        }
        self.framer = framer;
    }

    fn judge(&mut self, time_us: u64, command: &ToFrontseat<'_>, mission: bool) {
        let timeout_s = match command {
            ToFrontseat::Servo(Servo { servo, timeout_s }) => {
                self.servo(time_us, servo, mission);
                *timeout_s
            }
            ToFrontseat::Steer(Steer { speed_mps, timeout_s, .. }) => {
                self.commands += 1;
                self.check((0.0..=SPEED_MPS).contains(speed_mps), "speed");
                self.check(mission, "steering without a mission");
                *timeout_s
            }
            ToFrontseat::Stop => {
                self.stops += 1;
                return;
            }
            _ => return,
        };
        self.check((1..=TIMEOUT_S).contains(&timeout_s), "timeout");
    }

    fn servo(&mut self, time_us: u64, bytes: &ServoBytes, mission: bool) {
        let (last_us, last) = std::mem::replace(&mut self.last, (time_us, *bytes));
        if *bytes == ServoBytes::NEUTRAL {
            self.neutral += 1;
            return; // at once, whatever was before
        }
        self.commands += 1;
        self.check(mission, "fins or motor moved without a mission");
        let dt_s = time_us.saturating_sub(last_us) as f64 * 1e-6;
        // Each byte is rounded by half a count.
        let count = |servo: &LinearServo| 1.0 / servo.counts_per_unit.abs();
        let (now, before) = (self.servo.fins_rad(bytes), self.servo.fins_rad(&last));
        for i in 0..4 {
            let fin_count = count(&self.servo.fins[i]);
            self.check(now[i].abs() <= self.limits.fin_rad + 0.5 * fin_count, "fin angle");
            self.check((now[i] - before[i]).abs() <= self.limits.fin_rate_radps * dt_s + 1.01 * fin_count, "fin rate");
        }
        let (now, before) = (self.servo.propeller_radps(bytes), self.servo.propeller_radps(&last));
        let motor_count = count(&self.servo.motor);
        let most = self.limits.propeller_radps + 0.5 * motor_count;
        self.check((-0.5 * motor_count..=most).contains(&now), "propeller speed");
        let change = self.limits.propeller_radps2 * dt_s + 1.01 * motor_count;
        self.check((now - before).abs() <= change, "propeller acceleration");
    }

    fn check(&mut self, holds: bool, what: &str) {
        if !holds {
            self.violations.insert(format!("commands: {what}"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sent(commands: &[(u64, [f64; 4], f64, u8)]) -> Vec<String> {
        let mut watch = CommandWatch::default();
        for (time_us, fins_rad, propeller_radps, timeout_s) in commands {
            let servo = ServoCalibration::NOMINAL.bytes(*fins_rad, *propeller_radps);
            let mut buffer = [0; 96];
            let command = ToFrontseat::Servo(Servo { servo, timeout_s: *timeout_s });
            let bytes = command.emit(&Units::remote_helm(5), &mut buffer).unwrap();
            watch.hear(*time_us, bytes, true);
        }
        watch.violations.into_iter().collect()
    }

    #[test]
    fn limits_rates_and_timeouts_are_reported_apart() {
        let step = 100_000;
        let fin = |rad| [rad, 0.0, 0.0, 0.0];
        assert!(sent(&[(step, fin(0.05), 10.0, 2), (2 * step, fin(0.0), 0.0, 2)]).is_empty());
        assert_eq!(sent(&[(step, fin(0.2), 10.0, 2)]), ["commands: fin rate"]);
        assert_eq!(sent(&[(10 * step, fin(0.45), 10.0, 2)]), ["commands: fin angle"]);
        assert_eq!(sent(&[(step, fin(0.05), 30.0, 2)]), ["commands: propeller acceleration"]);
        assert_eq!(sent(&[(10 * step, fin(0.05), -50.0, 2)]), ["commands: propeller speed"]);
        assert_eq!(sent(&[(step, fin(0.05), 10.0, 9)]), ["commands: timeout"]);
        // the stop may be sudden
        assert!(sent(&[(10 * step, fin(0.3), 50.0, 2), (11 * step, fin(0.0), 0.0, 2)]).is_empty());
    }
}
