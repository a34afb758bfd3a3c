//! Commands to the frontseat: `$OMP` or `$OMS` while a mission runs, neutral and `$OMSTOP` at its end.

use crate::parameters::{AppSettings, ControlMode};
use backseat_core::control::Command;
use backseat_wire::Error;
use backseat_wire::iver::{Servo, ServoBytes, Steer, ToFrontseat};

/// `$OMSTOP` is repeated at this interval until it is acknowledged, µs.
const STOP_REPEAT_US: u64 = 2_000_000;
/// Most repetitions.
const STOP_REPEATS: u8 = 5;
/// `$OMS` is sent every so many steps.
const HELM_STEPS: u8 = 5;

/// Progress of a stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stopping {
    next_us: u64,
    left: u8,
}

/// The stop was repeated `STOP_REPEATS` times and never acknowledged.
pub struct Unanswered;

/// Writes commands and remembers the last one.
#[derive(Debug)]
pub struct Commander {
    stopping: Option<Stopping>,
    helm_phase: u8,
    /// `None` before the first.
    bytes: Option<ServoBytes>,
}

impl Commander {
    pub const fn new() -> Self {
        Self { stopping: None, helm_phase: 0, bytes: None }
    }

    /// Fins and motor as last sent.
    pub fn sent(&self) -> ServoBytes {
        self.bytes.unwrap_or(ServoBytes::NEUTRAL)
    }

    /// Writes the command of this step, if one is due.
    pub fn steer<'b>(
        &mut self,
        command: &Command,
        settings: &AppSettings,
        buffer: &'b mut [u8],
    ) -> Result<Option<&'b [u8]>, Error> {
        self.stopping = None;
        let timeout_s = settings.command_timeout_s;
        match (settings.control_mode, command.helm) {
            (ControlMode::Direct, _) => {
                let servo = settings.servo.bytes(command.input.fins_rad, command.input.propeller_radps);
                self.bytes = Some(servo);
                ToFrontseat::Servo(Servo { servo, timeout_s }).emit(&settings.units, buffer).map(Some)
            }
            (ControlMode::Helm, Some(helm)) => {
                let due = self.helm_phase == 0;
                self.helm_phase = (self.helm_phase + 1) % HELM_STEPS;
                if !due {
                    return Ok(None);
                }
                let steer = Steer {
                    heading_rad: helm.heading_rad,
                    depth_m: helm.depth_m.max(0.0),
                    max_pitch_rad: settings.helm_pitch_max_rad,
                    speed_mps: helm.speed_mps.max(0.0),
                    timeout_s,
                };
                ToFrontseat::Steer(steer).emit(&settings.units, buffer).map(Some)
            }
            (ControlMode::Helm, None) => Ok(None),
        }
    }

    /// Fins, and a stopped propeller.
    pub fn fins<'b>(
        &mut self,
        fins_rad: [f64; 4],
        settings: &AppSettings,
        buffer: &'b mut [u8],
    ) -> Result<&'b [u8], Error> {
        let servo = settings.servo.bytes(fins_rad, 0.0);
        self.bytes = Some(servo);
        self.helm_phase = 0;
        let servo = Servo { servo, timeout_s: settings.command_timeout_s };
        ToFrontseat::Servo(servo).emit(&settings.units, buffer)
    }

    /// `$OMSTOP` waits to be acknowledged.
    pub fn is_stopping(&self) -> bool {
        self.stopping.is_some()
    }

    /// From now on `$OMSTOP` is sent until it is acknowledged.
    pub fn stop(&mut self, now_us: u64) {
        self.stopping = Some(Stopping { next_us: now_us, left: STOP_REPEATS });
    }

    /// Writes `$OMSTOP` when it is due (again).
    ///
    /// # Errors
    /// [`Unanswered`], once.
    pub fn stopping<'b>(
        &mut self,
        now_us: u64,
        acknowledged: bool,
        settings: &AppSettings,
        buffer: &'b mut [u8],
    ) -> Result<Option<&'b [u8]>, Unanswered> {
        let Some(Stopping { next_us, left }) = self.stopping else { return Ok(None) };
        if acknowledged {
            self.stopping = None;
        }
        if acknowledged || now_us < next_us {
            return Ok(None);
        }
        if left == 0 {
            self.stopping = None;
            return Err(Unanswered);
        }
        self.stopping = Some(Stopping { next_us: now_us.saturating_add(STOP_REPEAT_US), left: left - 1 });
        // a buffer for commands holds it
        Ok(ToFrontseat::Stop.emit(&settings.units, buffer).ok())
    }
}
