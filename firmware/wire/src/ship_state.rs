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

use crate::framer::at;
use crate::nmea::within;
use crate::write::Writer;
use crate::{Decimal, Error, hex};
use core::fmt;
use core::str::FromStr;
use crc::{CRC_16_IBM_3740, Crc};
use serde::{Deserialize, Serialize};
use siphasher::sip::SipHasher24;

/// Bytes of the payload.
pub const LENGTH: usize = 24;
/// Bytes of the payload with its authentication code.
pub const AUTHENTIC_LENGTH: usize = LENGTH + CODE;
/// Version without an authentication code.
pub const VERSION: u8 = 1;
/// Version with one.
pub const AUTHENTIC_VERSION: u8 = 2;

pub(crate) const CODE: usize = 4;

const CRC_AT: usize = LENGTH - 2;
pub(crate) const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);

/// The secret that ship and vehicle share. Its bytes cannot be read, only sent.
#[derive(Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Key([u8; 16]);

impl Key {
    /// No key: nothing is authenticated.
    pub const NONE: Self = Self([0; 16]);

    /// Of 16 bytes; all zero is [`Self::NONE`].
    #[must_use]
    pub const fn new(bytes: [u8; 16]) -> Self {
        Self(bytes)
    }

    /// Whether there is one.
    #[must_use]
    pub fn is_set(&self) -> bool {
        *self != Self::NONE
    }

    /// The halves, for the memory that keeps it.
    #[must_use]
    pub fn halves(&self) -> [[u8; 8]; 2] {
        let [a, b] = self.0.as_chunks().0 else { return [[0; 8]; 2] };
        [*a, *b]
    }

    /// With one half (0 or 1) replaced.
    #[must_use]
    pub fn with_half(mut self, half: usize, bytes: [u8; 8]) -> Self {
        if let Some(place) = self.0.as_chunks_mut().0.get_mut(half) {
            *place = bytes;
        }
        self
    }

    /// SipHash-2-4 of a message by this key.
    pub(crate) fn hash(&self, message: &[u8]) -> u64 {
        SipHasher24::new_with_key(&self.0).hash(message)
    }

    pub(crate) fn code(&self, payload: &[u8]) -> [u8; CODE] {
        (self.hash(payload) as u32).to_le_bytes()
    }
}

impl FromStr for Key {
    type Err = Error;

    /// 32 hexadecimal digits; `none` for no key.
    fn from_str(text: &str) -> Result<Self, Error> {
        if text == "none" {
            return Ok(Self::NONE);
        }
        let mut key = [0; 16];
        hex::decode_exact(text.as_bytes(), &mut key)?;
        Ok(Self(key))
    }
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.is_set() { "set" } else { "not set" })
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for Key {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "{=bool}", self.is_set());
    }
}

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
    /// Reads a frame as [`Self::parse`] does, if the key is not set or its authentication code is right.
    ///
    /// # Errors
    /// [`Error::Forged`] without a code, or with a wrong one; else those of [`Self::parse`].
    pub fn parse_authentic(frame: &[u8], key: &Key) -> Result<Self, Error> {
        let state = Self::parse(frame)?;
        if key.is_set() {
            let payload = frame.get(..LENGTH).ok_or(Error::Length)?;
            let code: [u8; CODE] = at(frame, LENGTH).map_err(|_| Error::Forged)?;
            // compared whole: its time reveals nothing
            if frame.first() != Some(&AUTHENTIC_VERSION)
                || u32::from_le_bytes(code) != u32::from_le_bytes(key.code(payload))
            {
                return Err(Error::Forged);
            }
        }
        Ok(state)
    }

    /// Reads the front of a frame, with or without an authentication code, which is not looked at.
    ///
    /// # Errors
    /// [`Error::Length`] when shorter, [`Error::Unknown`] for another version, [`Error::Checksum`],
    /// [`Error::OutOfRange`].
    pub fn parse(frame: &[u8]) -> Result<Self, Error> {
        let payload: &[u8; LENGTH] = frame.first_chunk().ok_or(Error::Length)?;
        let [version, source, sequence, ..] = *payload;
        let covered = payload.get(..CRC_AT).ok_or(Error::Length)?;
        if CRC.checksum(covered) != u16::from_le_bytes(at(payload, CRC_AT)?) {
            return Err(Error::Checksum);
        }
        if version != VERSION && version != AUTHENTIC_VERSION {
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
        let [latitude, longitude] = self.position_deg;
        let mut payload = [0; LENGTH];
        let mut writer = Writer::new(&mut payload);
        writer.bytes(&[version, self.source, self.sequence])?;
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

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    /// The reference implementation's vectors (Aumasson and Bernstein, `vectors.h`): key 00 to 0F, messages 00, 01, ...
    #[test]
    fn val_the_code_is_the_low_half_of_siphash_2_4() {
        let key = Key::new(core::array::from_fn(|i| i as u8));
        let message: [u8; 15] = core::array::from_fn(|i| i as u8);
        for (length, hash) in [(0, 0x726f_db47_dd0e_0e31), (1, 0x74f8_39c5_93dc_67fd), (15, 0xa129_ca61_49be_45e5_u64)]
        {
            assert_eq!(key.code(&message[..length]), (hash as u32).to_le_bytes());
        }
    }

    #[test]
    fn a_key_shows_nothing_of_itself() {
        assert_eq!(std::format!("{:?} {:?}", Key::new([3; 16]), Key::NONE), "set not set");
        let key = Key::new(core::array::from_fn(|i| i as u8));
        let [low, high] = key.halves();
        assert_eq!(Key::NONE.with_half(1, high).with_half(0, low), key);
        assert_eq!(key.with_half(2, [0; 8]), key);
        assert_eq!("000102030405060708090a0B0c0D0e0F".parse(), Ok(key));
        assert_eq!("none".parse(), Ok(Key::NONE));
        for text in ["", "0", "000102030405060708090a0B0c0D0e0", "000102030405060708090a0B0c0D0e0g", "None"] {
            assert!(text.parse::<Key>().is_err(), "{text}");
        }
    }
}
