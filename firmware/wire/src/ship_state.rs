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
//! | 19 | u8 | position accuracy (one sigma per axis), 0.1 m; 255: 25.5 m or more |
//! | 20 | u8 | velocity accuracy (one sigma per axis), 0.01 m/s; 255: 2.55 m/s or more |
//! | 21 | u8 | depth of the ship's transducer, 0.1 m |
//! | 22 | u16 | CRC-16/IBM-3740 (polynomial 0x1021, initial 0xFFFF) over bytes 0 to 21 |
//!
//! Position and velocity are those of the transducer at the transmit second.

use crate::Error;

/// Bytes of the payload.
pub const LENGTH: usize = 24;
/// Version written and read.
pub const VERSION: u8 = 1;

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
        let _ = frame;
        Err(Error::Length)
    }

    /// The payload, rounded to its resolution; accuracies saturate.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for what it cannot carry.
    pub fn emit(&self) -> Result<[u8; LENGTH], Error> {
        Err(Error::OutOfRange)
    }
}
