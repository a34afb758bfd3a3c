//! The ship's state at launch, as the acoustic packet carries it.
//!
//! 24 bytes, little-endian, at the front of the 32-byte FSK frame, or 28 with an authentication code.
//!
//! | offset | type | meaning |
//! |---|---|---|
//! | 0 | u8 | version, 1; with an authentication code 2 |
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
//! | 24 | u32 | version 2 only: the low half of SipHash-2-4 over bytes 0 to 23 by a key of 16 bytes |
//!
//! Position and velocity are those of the transducer at the transmit second.
//!
//! SipHash-2-4 is a keyed pseudo-random function made for messages this short: no tables, 64-bit additions and
//! rotations. Its 64 bits are cut to 32: whoever does not know the key has one chance in 4.3e9 a packet, and at one
//! packet a second (more than the channel carries) an even chance after 94 years. The transmit second is under the
//! code, so that a packet is good for one second of all time: what was recorded cannot be played again later.

pub use crate::packet::Key;

use crate::Error;
use crate::framer::at;
use crate::nmea::within;
use crate::packet::{CODE, Framing, degrees, seal, upward, whole_degrees};
use crate::write::Writer;

/// Bytes of the payload.
pub const LENGTH: usize = 24;
/// Bytes of the payload with its authentication code.
pub const AUTHENTIC_LENGTH: usize = LENGTH + CODE;
/// Version without an authentication code.
pub const VERSION: u8 = 1;
/// Version with one.
pub const AUTHENTIC_VERSION: u8 = 2;

const FRAMING: Framing<LENGTH> = Framing { versions: [VERSION, AUTHENTIC_VERSION] };

/// The ship at the time of launch.
#[derive(Clone, Copy, Debug, PartialEq)]
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
    /// Reads a frame as [`Self::parse`] does, if the key is not set or its authentication code is right.
    ///
    /// # Errors
    /// [`Error::Forged`] without a code, or with a wrong one; else those of [`Self::parse`].
    pub fn parse_authentic(frame: &[u8], key: &Key) -> Result<Self, Error> {
        Self::read(FRAMING.open_authentic(frame, key)?)
    }

    /// Reads the front of a frame, with or without an authentication code, which is not looked at.
    ///
    /// # Errors
    /// [`Error::Length`] when shorter, [`Error::Unknown`] for another version, [`Error::Checksum`],
    /// [`Error::OutOfRange`].
    pub fn parse(frame: &[u8]) -> Result<Self, Error> {
        Self::read(FRAMING.open(frame)?)
    }

    fn read(payload: &[u8; LENGTH]) -> Result<Self, Error> {
        let [source, sequence] = at(payload, 1)?;
        let speed = |offset| Ok::<_, Error>(f64::from(i16::from_le_bytes(at(payload, offset)?)) / 1_000.0);
        let [position_sigma, velocity_sigma, depth] = at(payload, 19)?;
        Ok(Self {
            source,
            sequence,
            transmit_s: u32::from_le_bytes(at(payload, 3)?),
            position_deg: [degrees(at(payload, 7)?, 90.0)?, degrees(at(payload, 11)?, 180.0)?],
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
        self.write(VERSION)
    }

    /// The payload with its authentication code.
    ///
    /// # Errors
    /// Those of [`Self::emit`].
    pub fn emit_authentic(&self, key: &Key) -> Result<[u8; AUTHENTIC_LENGTH], Error> {
        let payload = self.write(AUTHENTIC_VERSION)?;
        let mut whole = [0; AUTHENTIC_LENGTH];
        let mut writer = Writer::new(&mut whole);
        writer.bytes(&payload)?;
        writer.bytes(&key.code(&payload))?;
        Ok(whole)
    }

    fn write(&self, version: u8) -> Result<[u8; LENGTH], Error> {
        let mut payload = [0; LENGTH];
        let mut writer = Writer::new(&mut payload);
        writer.bytes(&[version, self.source, self.sequence])?;
        writer.bytes(&self.transmit_s.to_le_bytes())?;
        let [latitude, longitude] = self.position_deg;
        writer.bytes(&whole_degrees(latitude, 90.0)?)?;
        writer.bytes(&whole_degrees(longitude, 180.0)?)?;
        for speed in self.velocity_mps {
            writer.bytes(&(libm::round(within(speed, -32.7, 32.7)? * 1_000.0) as i16).to_le_bytes())?;
        }
        // casts saturate
        writer.byte(upward(self.position_sigma_m, 0.1)? as u8)?;
        writer.byte(upward(self.velocity_sigma_mps, 0.01)? as u8)?;
        writer.byte(libm::round(within(self.transducer_depth_m, 0.0, 25.5)? * 10.0) as u8)?;
        seal(&mut writer)?;
        Ok(payload)
    }
}
