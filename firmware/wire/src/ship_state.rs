//! The ship's state at launch, as the acoustic packet carries it.
//!
//! 24 bytes, little-endian, at the front of the 32-byte FSK frame: 8 bytes stay free for a message authentication code.
//!
//! | offset | type | meaning |
//! |---|---|---|
//! | 0 | u8 | version, 1 |
//! | 1 | u8 | source, the ship's modem address |
//! | 2 | u8 | sequence number, wraps |
//! | 3 | u32 | transmit second: UTC seconds since 1970 at which the packet leaves |
//! | 7 | i32 | latitude, 1e-7 degree |
//! | 11 | i32 | longitude, 1e-7 degree |
//! | 15 | i16 | velocity north, mm/s |
//! | 17 | i16 | velocity east, mm/s |
//! | 19 | u8 | position accuracy (one sigma per axis), 0.1 m, rounded up; 255: 25.5 m or more |
//! | 20 | u8 | velocity accuracy (one sigma per axis), 0.01 m/s, rounded up; 255: 2.55 m/s or more |
//! | 21 | u8 | depth of the ship's transducer, 0.1 m |
//! | 22 | u16 | CRC-16/IBM-3740 (polynomial 0x1021, initial 0xFFFF) over bytes 0 to 21 |
//!
//! Position and velocity are those of the transducer at the transmit second.

use crate::framer::at;
use crate::nmea::within;
use crate::write::Writer;
use crate::{Decimal, Error};
use crc::{CRC_16_IBM_3740, Crc};

/// Bytes of the payload.
pub const LENGTH: usize = 24;
/// Version written and read.
pub const VERSION: u8 = 1;

const CRC_AT: usize = LENGTH - 2;
const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);

/// The ship at the time of launch.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ShipState {
    /// The ship's modem address.
    pub source: u8,
    /// Sequence number.
    pub sequence: u8,
    /// Time of launch, s since 1970 UTC.
    pub transmit_s: u32,
    /// Latitude and longitude, degrees, north and east positive.
    pub position_deg: [f64; 2],
    /// Velocity over ground, north and east, m/s.
    pub velocity_mps: [f64; 2],
    /// One sigma of the position per axis, m.
    pub position_sigma_m: f64,
    /// One sigma of the velocity per axis, m/s.
    pub velocity_sigma_mps: f64,
    /// Depth of the transducer, m.
    pub transducer_depth_m: f64,
}

impl ShipState {
    /// Reads the front of a frame; what follows the payload is not looked at.
    ///
    /// # Errors
    /// [`Error::Length`] when shorter, [`Error::Unknown`] for another version, [`Error::Checksum`], [`Error::OutOfRange`].
    pub fn parse(frame: &[u8]) -> Result<Self, Error> {
        let payload: &[u8; LENGTH] = frame.first_chunk().ok_or(Error::Length)?;
        let [version, source, sequence, ..] = *payload;
        let covered = payload.get(..CRC_AT).ok_or(Error::Length)?;
        if CRC.checksum(covered) != u16::from_le_bytes(at(payload, CRC_AT)?) {
            return Err(Error::Checksum);
        }
        if version != VERSION {
            return Err(Error::Unknown);
        }
        let angle =
            |offset| Ok::<_, Error>(Decimal::new(i64::from(i32::from_le_bytes(at(payload, offset)?)), 7).to_f64());
        let speed = |offset| Ok::<_, Error>(f64::from(i16::from_le_bytes(at(payload, offset)?)) / 1_000.0);
        let [position_sigma, velocity_sigma, depth] = at(payload, 19)?;
        Ok(Self {
            source,
            sequence,
            transmit_s: u32::from_le_bytes(at(payload, 3)?),
            position_deg: [within(angle(7)?, -90.0, 90.0)?, within(angle(11)?, -180.0, 180.0)?],
            velocity_mps: [speed(15)?, speed(17)?],
            position_sigma_m: f64::from(position_sigma) / 10.0,
            velocity_sigma_mps: f64::from(velocity_sigma) / 100.0,
            transducer_depth_m: f64::from(depth) / 10.0,
        })
    }

    /// The payload, rounded to its resolution; accuracies are rounded up and saturate.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for what it cannot carry.
    pub fn emit(&self) -> Result<[u8; LENGTH], Error> {
        let [latitude, longitude] = self.position_deg;
        let mut payload = [0; LENGTH];
        let mut writer = Writer::new(&mut payload);
        writer.bytes(&[VERSION, self.source, self.sequence])?;
        writer.bytes(&self.transmit_s.to_le_bytes())?;
        for (angle, limit) in [(latitude, 90.0), (longitude, 180.0)] {
            let scaled = libm::round(within(angle, -limit, limit)? * 1.0e7) as i32;
            writer.bytes(&scaled.to_le_bytes())?;
        }
        for speed in self.velocity_mps {
            let scaled = libm::round(within(speed, -32.7, 32.7)? * 1_000.0) as i16;
            writer.bytes(&scaled.to_le_bytes())?;
        }
        // Never claim to be better than is known; casts saturate. The margin keeps 0.3 / 0.1 at 3.
        let upward = |value: f64, unit: f64| Ok(libm::ceil(within(value, 0.0, f64::MAX)? / unit - 1.0e-9) as u8);
        writer.byte(upward(self.position_sigma_m, 0.1)?)?;
        writer.byte(upward(self.velocity_sigma_mps, 0.01)?)?;
        writer.byte(libm::round(within(self.transducer_depth_m, 0.0, 25.5)? * 10.0) as u8)?;
        let crc = CRC.checksum(writer.written());
        writer.bytes(&crc.to_le_bytes())?;
        Ok(payload)
    }
}
