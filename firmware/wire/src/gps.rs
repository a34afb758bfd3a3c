//! `$GPRMC` and `$GPGGA`, of any talker.

use crate::Error;
use crate::calendar::{DateTime, TimeOfDay};
use crate::nmea::Sentence;

/// Recommended minimum: position, velocity and the only sentence with a date.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Rmc {
    /// UTC of the fix.
    pub utc: Option<DateTime>,
    /// Status A.
    pub valid: bool,
    /// Latitude and longitude, WGS84, degrees, north and east positive.
    pub position_deg: Option<[f64; 2]>,
    /// Speed over ground, m/s.
    pub speed_mps: Option<f64>,
    /// Course over ground, true, rad.
    pub course_rad: Option<f64>,
    /// Magnetic variation, rad, east positive; `None` also where the sentence gives no direction.
    pub variation_rad: Option<f64>,
}

/// Fix data.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Gga {
    /// UTC time of day of the fix.
    pub time: Option<TimeOfDay>,
    /// Latitude and longitude, WGS84, degrees, north and east positive.
    pub position_deg: Option<[f64; 2]>,
    /// 0 no fix, 1 GPS, 2 differential, 4 and 5 RTK.
    pub quality: u8,
    /// Satellites used.
    pub satellites: u8,
    /// Horizontal dilution of precision.
    pub hdop: Option<f64>,
    /// Antenna above mean sea level, m.
    pub altitude_m: Option<f64>,
    /// Geoid above the ellipsoid, m.
    pub geoid_m: Option<f64>,
}

impl Rmc {
    /// Reads the sentence.
    ///
    /// # Errors
    /// [`Error::Unknown`] for another sentence; [`Error::Missing`], [`Error::Malformed`], [`Error::OutOfRange`] by field.
    pub fn parse(sentence: &Sentence<'_>) -> Result<Self, Error> {
        let _ = sentence;
        Err(Error::Unknown)
    }

    /// Writes `$GPRMC` with its line end.
    ///
    /// # Errors
    /// [`Error::BufferFull`], [`Error::OutOfRange`].
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let _ = buffer;
        Err(Error::BufferFull)
    }
}

impl Gga {
    /// Reads the sentence.
    ///
    /// # Errors
    /// [`Error::Unknown`] for another sentence; [`Error::Missing`], [`Error::Malformed`], [`Error::OutOfRange`] by field.
    pub fn parse(sentence: &Sentence<'_>) -> Result<Self, Error> {
        let _ = sentence;
        Err(Error::Unknown)
    }

    /// Writes `$GPGGA` with its line end.
    ///
    /// # Errors
    /// [`Error::BufferFull`], [`Error::OutOfRange`].
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let _ = buffer;
        Err(Error::BufferFull)
    }
}
