//! Teledyne PD0: little-endian binary ensembles of blocks found through an offset table.

use super::{Coordinates, DvlSample};
use crate::framer::{Verdict, Window};
use crate::{Counts, Error};

/// Longest ensemble taken, checksum included.
pub const MAX_ENSEMBLE: usize = 2_048;

/// One ensemble: the blocks a mission needs, as integers of the wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Ensemble {
    /// Fixed leader.
    pub fixed: Option<FixedLeader>,
    /// Variable leader.
    pub variable: Option<VariableLeader>,
    /// Bottom track.
    pub bottom: Option<BottomTrack>,
    /// Velocity of the first cell of the water profile (water relative to instrument), mm/s.
    pub first_cell_mmps: Option<[i16; 4]>,
}

/// Fixed leader (block 0000h).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FixedLeader {
    /// Firmware version and revision.
    pub firmware: [u8; 2],
    /// System configuration.
    pub configuration: u16,
    /// Beams.
    pub beams: u8,
    /// Depth cells.
    pub cells: u8,
    /// Pings per ensemble.
    pub pings: u16,
    /// Cell length, cm.
    pub cell_cm: u16,
    /// Coordinate byte (`EX`).
    pub coordinates: u8,
    /// Heading alignment (`EA`), 0.01 degree.
    pub heading_alignment_cdeg: i16,
}

/// Variable leader (block 0080h).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct VariableLeader {
    /// Ensemble number, with its most significant byte.
    pub ensemble: u32,
    /// Year of the century, month, day, hour, minute, second, hundredth.
    pub clock: [u8; 7],
    /// Built-in test, 0 good.
    pub built_in_test: u16,
    /// Speed of sound, m/s.
    pub sound_speed_mps: u16,
    /// Depth of the transducer, dm.
    pub depth_dm: u16,
    /// Heading, 0.01 degree.
    pub heading_cdeg: u16,
    /// Pitch, 0.01 degree, beam 3 up positive.
    pub pitch_cdeg: i16,
    /// Roll, 0.01 degree, as sent.
    pub roll_cdeg: i16,
    /// Salinity, parts per thousand.
    pub salinity_ppt: u16,
    /// Temperature, 0.01 °C.
    pub temperature_cdegc: i16,
}

/// Bottom track (block 0600h). Velocities are those of bottom and water relative to the instrument; -32768 is invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BottomTrack {
    /// Vertical range of each beam, cm; 0 is invalid.
    pub range_cm: [u32; 4],
    /// x, y, z, error, mm/s.
    pub velocity_mmps: [i16; 4],
    /// Correlation.
    pub correlation: [u8; 4],
    /// Evaluation amplitude.
    pub amplitude: [u8; 4],
    /// Percent good.
    pub percent_good: [u8; 4],
    /// Velocity of the reference layer, mm/s.
    pub layer_velocity_mmps: [i16; 4],
    /// Largest tracking depth, dm.
    pub max_depth_dm: u16,
}

impl Ensemble {
    /// Reads a whole ensemble with its checksum.
    ///
    /// # Errors
    /// [`Error::Framing`] without `7F 7F`, [`Error::Length`], [`Error::Checksum`], [`Error::Offset`] for a block beyond the ensemble.
    pub fn parse(frame: &[u8]) -> Result<Self, Error> {
        let _ = frame;
        Err(Error::Framing)
    }

    /// What it means to the vehicle; `mounting_rad` as in [`Coordinates::to_body`].
    pub fn sample(&self, mounting_rad: f64) -> DvlSample {
        let _ = (mounting_rad, Coordinates::Beam);
        DvlSample::default()
    }

    /// The ensemble of an instrument that measured `sample`.
    pub fn from_sample(sample: &DvlSample, ensemble: u32, mounting_rad: f64) -> Self {
        let _ = (sample, ensemble, mounting_rad);
        Self::default()
    }

    /// Writes fixed leader, variable leader and bottom track as far as they are there, in an Explorer's block sizes.
    ///
    /// # Errors
    /// [`Error::BufferFull`].
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let _ = buffer;
        Err(Error::BufferFull)
    }
}

/// Finds ensembles in a byte stream.
pub struct Decoder {
    window: Window<MAX_ENSEMBLE>,
}

impl Decoder {
    /// An empty decoder.
    pub const fn new() -> Self {
        Self { window: Window::new() }
    }

    /// Consumes bytes up to the next ensemble or rejection; `None` when all were consumed.
    pub fn feed(&mut self, bytes: &mut &[u8]) -> Option<Result<Ensemble, Error>> {
        Some(self.window.feed(bytes, |_| Verdict::Noise)?.and_then(Ensemble::parse))
    }

    /// Ensembles accepted, and the rejections by cause.
    pub const fn counts(&self) -> &Counts {
        &self.window.counts
    }
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}
