//! Teledyne PD4 and PD5: little-endian binary records of fixed length. PD5 is PD4 with attitude and distance made good.

use super::{Coordinates, DvlSample};
use crate::framer::{Verdict, Window};
use crate::{Counts, Error};

/// Length of a PD5 record, the longer one, checksum included.
pub const MAX_RECORD: usize = 88;

/// One record, as integers of the wire. Velocities are those of the vehicle; -32768 is invalid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Record {
    /// System configuration: coordinates, tilts, three-beam solutions, frequency.
    pub configuration: u8,
    /// x, y, z, error relative to the bottom, mm/s.
    pub bottom_mmps: [i16; 4],
    /// Vertical range of each beam, cm; 0 is invalid.
    pub range_cm: [u16; 4],
    /// Two bits a beam: low correlation, low amplitude.
    pub bottom_status: u8,
    /// x, y, z, error relative to the water, mm/s.
    pub water_mmps: [i16; 4],
    /// Start and end of the water layer, dm.
    pub layer_dm: [u16; 2],
    /// Bits 0 to 3 beam low correlation, bit 4 altitude too shallow.
    pub water_status: u8,
    /// Hour, minute, second, hundredth of the first ping.
    pub clock: [u8; 4],
    /// Built-in test, 0 good.
    pub built_in_test: u16,
    /// Speed of sound, m/s.
    pub sound_speed_mps: u16,
    /// Temperature, 0.01 °C.
    pub temperature_cdegc: i16,
    /// What PD5 adds.
    pub extended: Option<Extended>,
}

/// The fields that only PD5 has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Extended {
    /// Salinity, parts per thousand.
    pub salinity_ppt: u8,
    /// Depth of the transducer, dm.
    pub depth_dm: u16,
    /// Pitch, 0.01 degree.
    pub pitch_cdeg: i16,
    /// Roll, 0.01 degree.
    pub roll_cdeg: i16,
    /// Heading, 0.01 degree.
    pub heading_cdeg: u16,
    /// Distance made good over the bottom, dm.
    pub bottom_distance_dm: [i32; 4],
    /// Distance made good through the water, dm.
    pub water_distance_dm: [i32; 4],
}

impl Record {
    /// Reads a whole record with its checksum.
    ///
    /// # Errors
    /// [`Error::Framing`] without sync byte, [`Error::Unknown`] for another structure, [`Error::Length`], [`Error::Checksum`].
    pub fn parse(frame: &[u8]) -> Result<Self, Error> {
        let _ = frame;
        Err(Error::Framing)
    }

    /// What it means to the vehicle; `mounting_rad` as in [`Coordinates::to_body`]. A water velocity of exactly zero is
    /// taken as invalid, as units in the field send it.
    pub fn sample(&self, mounting_rad: f64) -> DvlSample {
        let _ = (mounting_rad, Coordinates::Beam);
        DvlSample::default()
    }

    /// The record of an instrument that measured `sample`: PD5 when `extended`.
    pub fn from_sample(sample: &DvlSample, extended: bool, mounting_rad: f64) -> Self {
        let _ = (sample, extended, mounting_rad);
        Self::default()
    }

    /// Writes PD4, or PD5 with its extension.
    ///
    /// # Errors
    /// [`Error::BufferFull`].
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let _ = buffer;
        Err(Error::BufferFull)
    }
}

/// Finds records in a byte stream.
pub struct Decoder {
    window: Window<{ 2 * MAX_RECORD }>,
}

impl Decoder {
    /// An empty decoder.
    pub const fn new() -> Self {
        Self { window: Window::new() }
    }

    /// Consumes bytes up to the next record or rejection; `None` when all were consumed.
    pub fn feed(&mut self, bytes: &mut &[u8]) -> Option<Result<Record, Error>> {
        Some(self.window.feed(bytes, |_| Verdict::Noise)?.and_then(Record::parse))
    }

    /// Records accepted, and the rejections by cause.
    pub const fn counts(&self) -> &Counts {
        &self.window.counts
    }
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}
