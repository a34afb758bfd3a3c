use super::{FromModem, ToModem};
use crate::Error;
use crate::nmea::Sentence;

impl<'a> FromModem<'a> {
    /// Reads what the modem sent.
    ///
    /// # Errors
    /// [`Error::Unhandled`] for sentences no mission needs, [`Error::Unknown`] for others; [`Error::Missing`],
    /// [`Error::Malformed`], [`Error::OutOfRange`] by field.
    pub fn parse(sentence: &Sentence<'a>) -> Result<Self, Error> {
        let _ = sentence;
        Err(Error::Unknown)
    }
}

impl<'a> ToModem<'a> {
    /// Reads what the host sent.
    ///
    /// # Errors
    /// [`Error::Unhandled`] for sentences no mission needs, [`Error::Unknown`] for others; [`Error::Missing`],
    /// [`Error::Malformed`], [`Error::OutOfRange`] by field.
    pub fn parse(sentence: &Sentence<'a>) -> Result<Self, Error> {
        let _ = sentence;
        Err(Error::Unknown)
    }
}
