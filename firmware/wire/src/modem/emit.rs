use super::{FromModem, ToModem};
use crate::Error;

impl FromModem<'_> {
    /// Writes the sentence with its line end.
    ///
    /// # Errors
    /// [`Error::BufferFull`], [`Error::Malformed`] for text with delimiters.
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let _ = buffer;
        Err(Error::BufferFull)
    }
}

impl ToModem<'_> {
    /// Writes the sentence with its line end.
    ///
    /// # Errors
    /// [`Error::BufferFull`], [`Error::Malformed`] for text with delimiters.
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let _ = buffer;
        Err(Error::BufferFull)
    }
}
