use super::{FromFrontseat, ToFrontseat, Units};
use crate::Error;
use crate::nmea::Sentence;

impl<'a> FromFrontseat<'a> {
    /// Reads what the frontseat sent.
    ///
    /// # Errors
    /// [`Error::Unknown`] for another sentence; [`Error::Missing`], [`Error::Malformed`], [`Error::OutOfRange`] by field.
    pub fn parse(sentence: &Sentence<'a>, units: &Units) -> Result<Self, Error> {
        let _ = (sentence, units);
        Err(Error::Unknown)
    }
}

impl<'a> ToFrontseat<'a> {
    /// Reads what the backseat sent.
    ///
    /// # Errors
    /// [`Error::Unknown`] for another sentence; [`Error::Missing`], [`Error::Malformed`], [`Error::OutOfRange`] by field.
    pub fn parse(sentence: &Sentence<'a>, units: &Units) -> Result<Self, Error> {
        let _ = (sentence, units);
        Err(Error::Unknown)
    }
}
