//! Frames of the host link: `00`, COBS of (postcard message, CRC-32 little-endian), `00`.
//!
//! The leading delimiter parts a frame from noise before it; empty frames are nothing. Own COBS, because postcard's can panic.

use crate::{Counts, Error};
use serde::{Deserialize, Serialize};

/// Longest message, in postcard bytes: a `Step` with all its chunks has 482.
pub const MAX_MESSAGE: usize = 768;
/// A buffer of this size holds any frame.
pub const MAX_FRAME: usize = MAX_MESSAGE + 16;

/// Writes one message as a frame.
///
/// # Errors
/// [`Error::BufferFull`] when buffer or [`MAX_MESSAGE`] do not suffice.
pub fn encode<'b, T: Serialize>(message: &T, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
    let _ = (message, buffer);
    Err(Error::BufferFull)
}

/// A frame whose CRC was verified.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a>(&'a [u8]);

impl<'a> Frame<'a> {
    /// The message, borrowing its text from the decoder.
    ///
    /// # Errors
    /// [`Error::Malformed`] when it is no such message.
    pub fn message<T: Deserialize<'a>>(&self) -> Result<T, Error> {
        postcard::from_bytes(self.0).map_err(|_| Error::Malformed)
    }
}

/// Finds frames in a byte stream.
pub struct Decoder {
    counts: Counts,
}

impl Decoder {
    /// An empty decoder.
    pub const fn new() -> Self {
        Self { counts: Counts::new() }
    }

    /// Consumes bytes up to the next frame or rejection; `None` when all were consumed.
    pub fn feed(&mut self, bytes: &mut &[u8]) -> Option<Result<Frame<'_>, Error>> {
        *bytes = &[];
        None
    }

    /// Frames whose CRC was right, and the rejections by cause.
    pub const fn counts(&self) -> &Counts {
        &self.counts
    }
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}
