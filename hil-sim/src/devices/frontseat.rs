//! The Iver3 frontseat computer: answers, obeys and refuses as protocols of working drivers have it.
//!
//! What no public source settles is decided here and stated: when a command's own timeout lapses the
//! frontseat centres the fins, stops the motor and returns to normal mode; a request for `$C` or
//! `$GPRMC` is answered with the next fresh sample.

use super::geodesy::LocalFrame;
use super::uart::Uart;
use crate::faults::{FrontseatFault, FrontseatFaults};
use crate::observation::{GnssFix, Observation, ObservationKind};
use crate::truth::Actuators;
use backseat_wire::Error;
use backseat_wire::calendar::DateTime;
use backseat_wire::gps::Rmc;
use backseat_wire::iver::servo::ServoCalibration;
use backseat_wire::iver::{
    Acknowledge, Battery, Compass, FromFrontseat, FrontseatError, FrontseatMode, Power, Request, ServoBytes, State,
    Steer, ToFrontseat, Units,
};
use backseat_wire::nmea::{Checksum, Framer, MAX_SENTENCE};
use std::f64::consts::PI;

/// Deeper than this the frontseat engages its safety rule.
const MAX_DEPTH_M: f64 = 60.0;
/// The safety rule is released above this depth.
const RELEASE_DEPTH_M: f64 = 1.0;
/// Steeper than this the frontseat engages its safety rule.
const MAX_PITCH_RAD: f64 = 50.0 * PI / 180.0;
/// Period of the frontseat's own autopilot (`$OMS`).
const AUTOPILOT_US: u64 = 100_000;

#[derive(Clone, Copy, Debug)]
enum Command {
    None,
    Servo { bytes: ServoBytes, until_us: u64 },
    Steer { steer: Steer, until_us: u64 },
}

/// Fastest propeller that a board's parameters admit, rad/s.
const FASTEST_RADPS: f64 = 1000.0;

/// What servo bytes mean on a vehicle whose propeller turns up to this speed, rad/s: the nominal guess, with a motor byte
/// that reaches a faster propeller, or a motor before its gear where the vehicle file speaks of that.
#[must_use]
pub fn calibration(omega_max_radps: f64) -> ServoCalibration {
    let mut calibration = ServoCalibration::NOMINAL;
    let (motor, fastest) = (&mut calibration.motor, omega_max_radps.min(FASTEST_RADPS));
    if fastest > motor.limit {
        motor.counts_per_unit *= motor.limit / fastest;
        motor.limit = fastest;
    }
    calibration
}

/// The emulated frontseat.
pub struct Frontseat {
    /// Towards the backseat.
    pub transmitter: Uart,
    framer: Framer,
    units: Units,
    calibration: ServoCalibration,
    frame: LocalFrame,
    start_unix_s: u32,
    declination_rad: f64,
    wanted: Request,
    command: Command,
    error: FrontseatError,
    targets: Actuators,
    autopilot_us: u64,
    depth_m: f64,
    euler_rad: [f64; 3],
    rates_radps: [f64; 3],
    fix: Option<GnssFix>,
    faults: FrontseatFaults,
    /// Up to where its own time has come.
    now_us: u64,
}

impl Frontseat {
    /// A frontseat on a line of `baud`, at rest at the surface.
    pub fn new(
        baud: u32,
        calibration: ServoCalibration,
        frame: LocalFrame,
        start_unix_s: u32,
        declination_rad: f64,
        faults: FrontseatFaults,
    ) -> Self {
        Self {
            transmitter: Uart::new(baud),
            framer: Framer::new(Checksum::Required),
            units: Units::remote_helm(5),
            calibration,
            frame,
            start_unix_s,
            declination_rad,
            wanted: Request::default(),
            command: Command::None,
            error: FrontseatError::None,
            targets: Actuators::default(),
            autopilot_us: 0,
            depth_m: 0.0,
            euler_rad: [0.0; 3],
            rates_radps: [0.0; 3],
            fix: None,
            faults,
            now_us: 0,
        }
    }

    /// Commands of fins and propeller at `now_us`.
    pub fn targets(&mut self, now_us: u64) -> Actuators {
        self.now_us = now_us;
        if self.faults.at(now_us).is_some() {
            self.let_go();
        }
        match self.command {
            Command::Servo { until_us, .. } | Command::Steer { until_us, .. } if now_us >= until_us => {
                self.command = Command::None;
                self.targets = Actuators::default();
            }
            Command::Steer { steer, .. } if now_us >= self.autopilot_us => {
                self.autopilot_us = now_us + AUTOPILOT_US;
                self.targets = self.autopilot(&steer);
            }
            _ => {}
        }
        self.targets
    }

    /// When [`Self::targets`] changes without further input, µs.
    pub fn next_us(&self) -> Option<u64> {
        let command_us = match self.command {
            Command::None => None,
            Command::Servo { until_us, .. } => Some(until_us),
            Command::Steer { until_us, .. } => Some(until_us.min(self.autopilot_us)),
        };
        command_us.into_iter().chain(self.faults.next_us(self.now_us)).min()
    }

    /// Fins and motor are no longer the backseat's.
    fn let_go(&mut self) {
        self.command = Command::None;
        self.targets = Actuators::default();
    }

    fn is_down(&self, time_us: u64) -> bool {
        self.faults.at(time_us) == Some(FrontseatFault::Reboots)
    }

    /// Bytes of the backseat that arrived at `time_us`.
    pub fn receive(&mut self, time_us: u64, mut bytes: &[u8]) {
        if self.is_down(time_us) {
            self.framer = Framer::new(Checksum::Required);
            self.wanted = Request::default();
            return;
        }
        // Moved out while its sentences borrow it.
        let mut framer = std::mem::replace(&mut self.framer, Framer::new(Checksum::Required));
        while let Some(outcome) = framer.feed(&mut bytes) {
            let Ok(sentence) = outcome else { continue };
            match ToFrontseat::parse(&sentence, &self.units) {
                Ok(command) => self.obey(time_us, &command),
                Err(cause) => self.refuse_malformed(time_us, sentence.id(), cause),
            }
        }
        self.framer = framer;
    }

    fn obey(&mut self, time_us: u64, command: &ToFrontseat<'_>) {
        let fault = self.faults.at(time_us);
        let refused = self.error != FrontseatError::None
            || match fault {
                Some(FrontseatFault::Refuses) => true,
                Some(FrontseatFault::Mode(mode)) => !mode.accepts_commands(),
                Some(FrontseatFault::Reboots) | None => false,
            };
        let (kind, error) = match *command {
            ToFrontseat::Request(request) => {
                self.answer(time_us, request);
                (Acknowledge::REQUEST, 0)
            }
            ToFrontseat::Servo(_) if refused => (Acknowledge::SERVO, Acknowledge::SAFETY_RULE),
            ToFrontseat::Steer(_) if refused => (Acknowledge::STEER, Acknowledge::SAFETY_RULE),
            // Somebody else steers.
            ToFrontseat::Servo(_) if fault.is_some() => (Acknowledge::SERVO, 0),
            ToFrontseat::Steer(_) if fault.is_some() => (Acknowledge::STEER, 0),
            ToFrontseat::Servo(servo) => {
                let until_us = time_us + u64::from(servo.timeout_s) * 1_000_000;
                self.command = Command::Servo { bytes: servo.servo, until_us };
                self.targets = Actuators {
                    fins_rad: self.calibration.fins_rad(&servo.servo),
                    propeller_radps: self.calibration.propeller_radps(&servo.servo),
                };
                (Acknowledge::SERVO, 0)
            }
            ToFrontseat::Steer(steer) => {
                self.command = Command::Steer { steer, until_us: time_us + u64::from(steer.timeout_s) * 1_000_000 };
                self.autopilot_us = time_us;
                (Acknowledge::STEER, 0)
            }
            ToFrontseat::Stop => {
                self.command = Command::None;
                self.targets = Actuators::default();
                (Acknowledge::STOP, 0)
            }
            // No stored missions here: the sounder, the GPS or the file is missing.
            ToFrontseat::Start(_) => (Acknowledge::START, 1),
            ToFrontseat::Jump { .. } => (Acknowledge::JUMP, Acknowledge::NOT_RUNNING),
            ToFrontseat::Position(_) => (Acknowledge::POSITION, 0),
            ToFrontseat::Velocity(_) => (Acknowledge::VELOCITY, 0),
        };
        self.acknowledge(time_us, kind, error);
    }

    fn refuse_malformed(&mut self, time_us: u64, id: &[u8], cause: Error) {
        let kind = match id {
            b"OSD" => Acknowledge::REQUEST,
            b"OMS" => Acknowledge::STEER,
            b"OMP" => Acknowledge::SERVO,
            b"OMSTOP" => Acknowledge::STOP,
            b"OMSTART" => Acknowledge::START,
            _ => return, // not a command of this interface
        };
        debug_assert_ne!(cause, Error::Unknown);
        self.acknowledge(time_us, kind, Acknowledge::malformed(kind));
    }

    fn acknowledge(&mut self, time_us: u64, command: u8, error: u8) {
        self.send(time_us, &FromFrontseat::Acknowledge(Acknowledge { command, accepted: error == 0, error }));
    }

    fn answer(&mut self, time_us: u64, request: Request) {
        self.wanted.compass |= request.compass;
        self.wanted.gps |= request.gps;
        if request.state {
            let bytes = match self.command {
                Command::Servo { bytes, .. } => bytes,
                _ => self.calibration.bytes(self.targets.fins_rad, self.targets.propeller_radps),
            };
            let mode = match (self.faults.at(time_us), self.error, self.command) {
                (Some(FrontseatFault::Mode(mode)), ..) => mode,
                (Some(_), ..) => FrontseatMode::Stopped,
                (None, FrontseatError::None, Command::None) => FrontseatMode::Normal,
                (None, FrontseatError::None, _) => FrontseatMode::Servo,
                _ => FrontseatMode::Stopped,
            };
            let [latitude, longitude] = self.frame.to_degrees(self.fix.map_or([0.0; 2], |fix| fix.position_m));
            self.send(
                time_us,
                &FromFrontseat::State(State {
                    servo: bytes,
                    mode,
                    next_waypoint: 1,
                    position_deg: [latitude, longitude],
                    speed_mps: self.fix.map_or(0.0, |fix| fix.speed_mps),
                    distance_to_next_m: 0.0,
                    error: self.error,
                    altitude_m: None,
                    park_time_s: Some(0),
                    declination_rad: Some(self.declination_rad),
                    mission: "SIM",
                    remaining_time: "00:00:00",
                    heading_rad: self.euler_rad[2].rem_euclid(2.0 * PI),
                    depth_m: self.depth_m.max(0.0),
                }),
            );
        }
        if request.power {
            self.send(
                time_us,
                &FromFrontseat::Power(Power {
                    percent: 90.0,
                    remaining_wh: 700.0,
                    power_w: 60.0,
                    voltage_v: 25.9,
                    current_a: -2.3,
                    minutes: 700,
                    battery: Battery::Discharging,
                    leak: false,
                }),
            );
        }
    }

    /// A sensor of the frontseat's has sampled.
    pub fn observe(&mut self, observation: &Observation) {
        let time_us = observation.time_us;
        match observation.kind {
            ObservationKind::Depth { depth_m } => {
                self.depth_m = depth_m;
                self.watch();
                if std::mem::take(&mut self.wanted.compass) {
                    let [roll_rad, pitch_rad, heading_rad] = self.euler_rad;
                    let heading_rad = (heading_rad - self.declination_rad).rem_euclid(2.0 * PI);
                    self.send(
                        time_us,
                        &FromFrontseat::Compass(Compass {
                            heading_rad,
                            pitch_rad,
                            roll_rad,
                            temperature_degc: Some(15.0),
                            depth_m: Some(depth_m),
                        }),
                    );
                }
            }
            ObservationKind::Ahrs { euler_rad, rates_radps } => {
                self.euler_rad = euler_rad;
                self.rates_radps = rates_radps;
            }
            ObservationKind::VehicleGnss { fix } => {
                self.fix = fix;
                if std::mem::take(&mut self.wanted.gps) {
                    let utc_us = u64::from(self.start_unix_s) * 1_000_000 + fix.map_or(time_us, |fix| fix.time_us);
                    self.send(
                        time_us,
                        &FromFrontseat::Rmc(Rmc {
                            utc: DateTime::from_unix_us(utc_us).ok(),
                            valid: fix.is_some(),
                            position_deg: fix.map(|fix| self.frame.to_degrees(fix.position_m)),
                            speed_mps: fix.map(|fix| fix.speed_mps),
                            course_rad: fix.map(|fix| fix.course_rad),
                            variation_rad: Some(self.declination_rad),
                        }),
                    );
                }
            }
            _ => {}
        }
    }

    /// The safety rule.
    fn watch(&mut self) {
        if self.depth_m > MAX_DEPTH_M {
            self.engage(FrontseatError::DepthExceeded);
        } else if self.euler_rad[1].abs() > MAX_PITCH_RAD {
            self.engage(FrontseatError::OverPitch);
        } else if self.depth_m < RELEASE_DEPTH_M {
            self.error = FrontseatError::None;
        }
    }

    fn engage(&mut self, error: FrontseatError) {
        self.error = error;
        self.let_go();
    }

    /// Heading to the vertical fins, depth through pitch to the horizontal ones, speed to the motor.
    fn autopilot(&self, steer: &Steer) -> Actuators {
        const FIN_LIMIT_RAD: f64 = 20.0 * PI / 180.0;
        let [_, pitch, heading] = self.euler_rad;
        let [_, q, r] = self.rates_radps;
        let heading_error = (steer.heading_rad - heading + PI).rem_euclid(2.0 * PI) - PI;
        let yaw = (0.8 * heading_error - 1.2 * r).clamp(-FIN_LIMIT_RAD, FIN_LIMIT_RAD);
        let limit = steer.max_pitch_rad.abs().min(0.5);
        let pitch_wanted = (0.25 * (self.depth_m - steer.depth_m)).clamp(-limit, limit);
        let nose_up = (0.9 * (pitch_wanted - pitch) - 0.8 * q).clamp(-FIN_LIMIT_RAD, FIN_LIMIT_RAD);
        let fins_rad = [yaw, -yaw, nose_up, -nose_up];
        // A fixed table of speed against propeller speed, as a frontseat has one.
        let asked = self.calibration.bytes(fins_rad, 107.0 * steer.speed_mps);
        Actuators {
            fins_rad: self.calibration.fins_rad(&asked),
            propeller_radps: self.calibration.propeller_radps(&asked),
        }
    }

    fn send(&mut self, time_us: u64, sentence: &FromFrontseat<'_>) {
        if self.is_down(time_us) {
            return;
        }
        let mut buffer = [0; MAX_SENTENCE];
        // Every value above is within its field; a sentence that is not is not sent, as on a real line.
        if let Ok(bytes) = sentence.emit(&self.units, &mut buffer) {
            self.transmitter.send(time_us, bytes);
        }
    }
}
