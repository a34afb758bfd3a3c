//! What the packets of ship and vehicle have in common: units, CRC, key and authentication code.

use crate::framer::at;
use crate::nmea::within;
use crate::write::Writer;
use crate::{Decimal, Error, hex};
use core::fmt;
use core::hash::Hasher as _;
use core::str::FromStr;
use crc::{CRC_16_IBM_3740, Crc};
use serde::{Deserialize, Serialize};
use siphasher::sip::SipHasher24;

/// Bytes of the authentication code.
pub(crate) const CODE: usize = 4;
/// Bytes of the CRC, the last of a payload.
const CRC_LENGTH: usize = 2;
const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);

/// A payload of `N` bytes: its first byte is the version, its last two the CRC; a code may follow it.
pub(crate) struct Framing<const N: usize> {
    /// Version without an authentication code, and with one.
    pub versions: [u8; 2],
}

impl<const N: usize> Framing<N> {
    /// The payload at the front of a frame; the code, if there is one, is not looked at.
    ///
    /// # Errors
    /// [`Error::Length`] when shorter, [`Error::Unknown`] for another version, [`Error::Checksum`].
    pub fn open<'f>(&self, frame: &'f [u8]) -> Result<&'f [u8; N], Error> {
        let version = frame.first().ok_or(Error::Length)?;
        let known = self.versions.contains(version);
        // a shorter packet of another kind is not a broken one of this
        let short = if known { Error::Length } else { Error::Unknown };
        let payload: &[u8; N] = frame.first_chunk().ok_or(short)?;
        let (covered, crc) = payload.split_last_chunk::<CRC_LENGTH>().ok_or(Error::Length)?;
        if CRC.checksum(covered) != u16::from_le_bytes(*crc) {
            return Err(Error::Checksum);
        }
        if known { Ok(payload) } else { Err(Error::Unknown) }
    }

    /// [`Self::open`], if the key is not set or the authentication code is right.
    ///
    /// # Errors
    /// [`Error::Forged`] without a code, or with a wrong one; else those of [`Self::open`].
    pub fn open_authentic<'f>(&self, frame: &'f [u8], key: &Key) -> Result<&'f [u8; N], Error> {
        let payload = self.open(frame)?;
        if key.is_set() {
            let [_, authentic] = self.versions;
            let code: [u8; CODE] = at(frame, N).map_err(|_| Error::Forged)?;
            // compared whole: its time reveals nothing
            if frame.first() != Some(&authentic) || u32::from_le_bytes(code) != u32::from_le_bytes(key.code(payload)) {
                return Err(Error::Forged);
            }
        }
        Ok(payload)
    }

    /// The version of a packet that is signed by this key, if it is set.
    pub fn version(&self, key: &Key) -> u8 {
        let [plain, authentic] = self.versions;
        if key.is_set() { authentic } else { plain }
    }
}

/// Appends the CRC over what was written.
pub(crate) fn seal(writer: &mut Writer<'_>) -> Result<(), Error> {
    let crc = CRC.checksum(writer.written());
    writer.bytes(&crc.to_le_bytes())
}

/// An angle of a position from units of 1e-7 degree.
pub(crate) fn degrees(bytes: [u8; 4], limit: f64) -> Result<f64, Error> {
    within(Decimal::new(i64::from(i32::from_le_bytes(bytes)), 7).to_f64(), -limit, limit)
}

/// An angle of a position in units of 1e-7 degree.
pub(crate) fn whole_degrees(angle: f64, limit: f64) -> Result<[u8; 4], Error> {
    Ok((libm::round(within(angle, -limit, limit)? * 1.0e7) as i32).to_le_bytes())
}

/// An accuracy in units, rounded up: never claim to be better than is known. The margin keeps 0.3 / 0.1 at 3.
pub(crate) fn upward(value: f64, unit: f64) -> Result<f64, Error> {
    Ok(libm::ceil(within(value, 0.0, f64::MAX)? / unit - 1.0e-9))
}

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

    /// The same of a message in parts.
    pub(crate) fn hash_of(&self, parts: [&[u8]; 4]) -> u64 {
        let mut hasher = SipHasher24::new_with_key(&self.0);
        parts.iter().for_each(|part| hasher.write(part));
        hasher.finish()
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
