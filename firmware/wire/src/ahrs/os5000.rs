//! OceanServer OS5000 compass: `$C…`, tagged values without commas, in fixed order, each only when enabled.

use super::AhrsSample;
use crate::Error;
use crate::nmea::Sentence;

/// One sentence, in SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Os5000 {
    /// `C`: heading, [0, 2π), rad.
    pub heading_rad: Option<f64>,
    /// `P`: pitch, rad.
    pub pitch_rad: Option<f64>,
    /// `R`: roll, rad.
    pub roll_rad: Option<f64>,
    /// `T`: temperature, °C.
    pub temperature_degc: Option<f64>,
    /// `D`: depth in feet or sensor voltage, as the device is set up.
    pub depth: Option<f64>,
    /// `Mx My Mz`: magnetic field, device units.
    pub mag: Option<[f64; 3]>,
    /// `Ax Ay Az`: as sent, g; positive down at rest, opposite to specific force.
    pub accel_g: Option<[f64; 3]>,
}

impl Os5000 {
    /// Reads the sentence.
    ///
    /// # Errors
    /// [`Error::Unknown`] for another sentence; [`Error::Missing`], [`Error::Malformed`], [`Error::OutOfRange`] by value.
    pub fn parse(sentence: &Sentence<'_>) -> Result<Self, Error> {
        let _ = sentence;
        Err(Error::Unknown)
    }

    /// Attitude (when all three angles are there) and specific force.
    pub fn sample(&self) -> AhrsSample {
        AhrsSample::default()
    }

    /// Writes the sentence with its line end: angles to 0.1 degree.
    ///
    /// # Errors
    /// [`Error::BufferFull`], [`Error::OutOfRange`].
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let _ = buffer;
        Err(Error::BufferFull)
    }
}
