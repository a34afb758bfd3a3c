//! The ship's GNSS receiver: `$GPGGA`, `$GPGST` and `$GPRMC` each second.

use crate::devices::LocalFrame;
use crate::devices::uart::Uart;
use crate::rng::{Source, Stream};
use backseat_wire::calendar::DateTime;
use backseat_wire::gps::{Gga, Gst, Rmc};
use std::f64::consts::TAU;

/// From a fix to the first byte of its sentences.
const LATENCY_US: u64 = 80_000;
/// One sigma of the speed over ground per axis, m/s.
const VELOCITY_SIGMA_MPS: f64 = 0.05;

/// The receiver.
pub(super) struct Receiver {
    pub(super) transmitter: Uart,
    frame: LocalFrame,
    start_us: u64,
    noise: Stream,
    sigma_m: f64,
}

impl Receiver {
    pub(super) fn new(baud: u32, frame: LocalFrame, start_unix_s: u32, seed: u64, sigma_m: f64) -> Self {
        let noise = Stream::new(seed, Source::ShipGnssVelocity);
        Self { transmitter: Uart::new(baud), frame, start_us: u64::from(start_unix_s) * 1_000_000, noise, sigma_m }
    }

    /// A fix taken at `time_us`.
    pub(super) fn fix(&mut self, time_us: u64, position_m: [f64; 2], velocity_mps: [f64; 2]) {
        let [error_n, error_e] = self.noise.normals::<2>(VELOCITY_SIGMA_MPS);
        let (north, east) = (velocity_mps[0] + error_n, velocity_mps[1] + error_e);
        let Ok(utc) = DateTime::from_unix_us(self.start_us + time_us) else { return };
        let position_deg = Some(self.frame.to_degrees(position_m));
        let rmc = Rmc {
            utc: Some(utc),
            valid: true,
            position_deg,
            speed_mps: Some(libm::hypot(north, east)),
            course_rad: Some(libm::atan2(east, north).rem_euclid(TAU)),
            variation_rad: None,
        };
        let gga = Gga {
            time: Some(utc.time),
            position_deg,
            quality: 1,
            satellites: 11,
            hdop: Some(0.9),
            altitude_m: Some(2.0),
            geoid_m: Some(-30.0),
        };
        let gst = Gst { time: Some(utc.time), sigma_m: Some([self.sigma_m; 2]) };
        let mut buffer = [0; 128];
        let mut send = |bytes: Result<&[u8], _>| {
            if let Ok(bytes) = bytes {
                self.transmitter.send(time_us + LATENCY_US, bytes);
            }
        };
        send(gga.emit(&mut buffer));
        send(gst.emit(&mut buffer));
        send(rmc.emit(&mut buffer));
    }
}
