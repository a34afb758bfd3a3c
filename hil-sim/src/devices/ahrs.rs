//! A 3DM-GX3-25 that streams Euler angles and rates on request.

use super::uart::Uart;
use crate::observation::{Observation, ObservationKind};
use backseat_wire::ahrs::gx3::{Command, Reply, ToGx3, emit_continuous};
use std::f64::consts::PI;

/// Ticks per second of the device's timer.
const TICKS_PER_S: u64 = 62_500;

/// The emulated AHRS.
pub struct Ahrs {
    /// Towards the backseat.
    pub transmitter: Uart,
    declination_rad: f64,
    received: Vec<u8>,
    streaming: bool,
    /// The timer at time zero.
    first_tick: u64,
}

impl Ahrs {
    /// On a line of `baud`; its heading is magnetic. Its timer starts from zero, or so that it rolls over at a given
    /// time.
    pub fn new(baud: u32, declination_rad: f64, rollover_us: Option<u64>) -> Self {
        let first_tick = rollover_us.map_or(0, |us| (1 << 32) - us * TICKS_PER_S / 1_000_000);
        Self { transmitter: Uart::new(baud), declination_rad, received: Vec::new(), streaming: false, first_tick }
    }

    /// The device's timer, which rolls over.
    fn ticks(&self, time_us: u64) -> u32 {
        (self.first_tick + time_us * TICKS_PER_S / 1_000_000) as u32
    }

    /// Bytes of the backseat that arrived at `time_us`.
    pub fn receive(&mut self, time_us: u64, bytes: &[u8]) {
        self.received.extend_from_slice(bytes);
        loop {
            match ToGx3::parse(&self.received) {
                Ok(Some((command, length))) => {
                    self.received.drain(..length);
                    self.obey(time_us, command);
                }
                Ok(None) => break,
                Err(_) => {
                    self.received.remove(0);
                }
            }
        }
    }

    fn obey(&mut self, time_us: u64, command: ToGx3) {
        match command {
            ToGx3::Continuous(Command::EulerRate) => {
                self.streaming = true;
                let mut buffer = [0; 16];
                if let Ok(bytes) = emit_continuous(Command::EulerRate as u8, self.ticks(time_us), &mut buffer) {
                    self.transmitter.send(time_us, bytes);
                }
            }
            ToGx3::Stop => self.streaming = false,
            _ => {}
        }
    }

    /// The device sampled.
    pub fn observe(&mut self, observation: &Observation) {
        let ObservationKind::Ahrs { euler_rad: [roll, pitch, heading], rates_radps } = observation.kind else { return };
        if !self.streaming {
            return;
        }
        let magnetic = (heading - self.declination_rad + PI).rem_euclid(2.0 * PI) - PI;
        let reply = Reply::euler_rate(
            [roll, pitch, magnetic].map(|x| x as f32),
            rates_radps.map(|x| x as f32),
            self.ticks(observation.time_us),
        );
        let mut buffer = [0; 128];
        if let Ok(bytes) = reply.emit(&mut buffer) {
            self.transmitter.send(observation.time_us, bytes);
        }
    }
}
