//! The abort: the one acoustic packet that reaches a command. It ends a mission, and can do nothing else.
//!
//! 14 bytes, little-endian, at the front of the 32-byte FSK frame.
//!
//! | offset | type | meaning |
//! |---|---|---|
//! | 0 | u8 | kind, 0xAB |
//! | 1 | u8 | destination, the vehicle's modem address; 255: every vehicle that has the key |
//! | 2 | u32 | transmit second: UTC seconds since 1970 at which the packet leaves |
//! | 6 | u64 | SipHash-2-4 over bytes 0 to 5 by the key of 16 bytes that [ship and vehicle share](crate::ship_state) |
//!
//! There is no abort without a key. The code is whole, not cut as in the ship's state: a guess is right once in 1.8e19.
//! The transmit second is under it, so that a recording cannot end a later mission: the vehicle takes an abort for the
//! mission that was under way when it was sent.

use crate::Error;
use crate::framer::at;
use crate::packet::Key;

/// Bytes of the payload.
pub const LENGTH: usize = 14;
/// First byte of the payload.
pub const KIND: u8 = 0xAB;
/// The address of every vehicle.
pub const EVERYBODY: u8 = 255;

/// Bytes under the code.
const COVERED: usize = LENGTH - 8;

/// The order to end the mission.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Abort {
    /// The vehicle's modem address, or [`EVERYBODY`].
    pub destination: u8,
    /// Time of launch, s since 1970 UTC.
    pub transmit_s: u32,
}

impl Abort {
    /// Whether a frame says that it is one.
    #[must_use]
    pub fn is_announced(frame: &[u8]) -> bool {
        frame.first() == Some(&KIND)
    }

    /// Whether it is for the vehicle with this modem address.
    #[must_use]
    pub fn is_for(&self, address: u8) -> bool {
        self.destination == address || self.destination == EVERYBODY
    }

    /// Reads the front of a frame if its code is right.
    ///
    /// # Errors
    /// [`Error::Unknown`] for another kind, [`Error::Length`] when shorter, [`Error::Forged`] with a wrong code or
    /// without a key.
    pub fn parse_authentic(frame: &[u8], key: &Key) -> Result<Self, Error> {
        if !Self::is_announced(frame) {
            return Err(Error::Unknown);
        }
        let covered = frame.get(..COVERED).ok_or(Error::Length)?;
        let code = u64::from_le_bytes(at(frame, COVERED).map_err(|_| Error::Length)?);
        // compared whole: its time reveals nothing
        if !key.is_set() || code != key.hash(covered) {
            return Err(Error::Forged);
        }
        let [_, destination] = at(frame, 0)?;
        Ok(Self { destination, transmit_s: u32::from_le_bytes(at(frame, 2)?) })
    }

    /// The payload.
    ///
    /// # Errors
    /// [`Error::Forged`] without a key.
    pub fn emit_authentic(&self, key: &Key) -> Result<[u8; LENGTH], Error> {
        if !key.is_set() {
            return Err(Error::Forged);
        }
        let [a, b, c, d] = self.transmit_s.to_le_bytes();
        let covered: [u8; COVERED] = [KIND, self.destination, a, b, c, d];
        let mut payload = [0; LENGTH];
        for (place, byte) in payload.iter_mut().zip(covered.into_iter().chain(key.hash(&covered).to_le_bytes())) {
            *place = byte;
        }
        Ok(payload)
    }
}
