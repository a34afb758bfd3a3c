//! Images of the firmware in a board's two banks of flash.

use core::fmt;
use serde::{Deserialize, Serialize};

/// Most bytes of an image in one message, a multiple of any flash word.
pub const UPDATE_CHUNK: usize = 256;

/// Which image runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct ImageId {
    /// First four bytes of its build ID (`readelf -n IMAGE`); 0: no image of a chip.
    pub build: u32,
    /// CRC-32 of its bytes in flash, as [`Image::crc`], computed at start.
    pub crc: u32,
    /// First four bytes of the commit of a release; 0: no release.
    pub commit: u32,
    /// Fingerprint of its parameter list: CRC-32 of version, names and units; 0: written before there was one.
    pub parameters: u32,
}

impl fmt::Display for ImageId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { build, crc, commit, parameters } = self;
        match build {
            0 => write!(f, "no image of a chip")?,
            _ => write!(f, "image {build:08x}, CRC {crc:08x}")?,
        }
        if *commit == 0 {
            write!(f, ", no release")?
        } else {
            write!(f, ", commit {commit:08x}")?
        }
        if *parameters == 0 { Ok(()) } else { write!(f, ", parameter list {parameters:08x}") }
    }
}

/// An image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Image {
    /// Bytes, from the start of the bank on.
    pub length: u32,
    /// CRC-32 of them, that of the host link's frames.
    pub crc: u32,
    /// First four bytes of its build ID (`readelf -n IMAGE`).
    pub build: u32,
}

/// What an update has left in the bank that does not run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StoredImage {
    /// Which.
    pub image: Image,
    /// How often it was started on trial.
    pub starts: u8,
    /// It was confirmed.
    pub confirmed: bool,
}

/// What a board knows of its images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Images {
    /// The image that runs is on trial, and this is its start number so and so many, from 1; `None`: it stays.
    pub trial: Option<u8>,
    /// The other bank's; `None`: no update has put one there, or none that is whole.
    pub other: Option<StoredImage>,
}
