//! Teledyne PD6: sets of text lines, without checksum, so that every field is checked for its range and every line for its length.

use super::DvlSample;
use crate::framer::Line;
use crate::{Counts, Error};

/// Longest line taken.
pub const MAX_LINE: usize = 128;
/// A buffer of this size holds any set emitted.
pub const MAX_SET: usize = 512;

/// Finds lines in a byte stream and gathers them into samples.
pub struct Decoder {
    line: Line<MAX_LINE>,
    mounting_rad: f64,
    counts: Counts,
}

impl Decoder {
    /// An empty decoder; `mounting_rad` as in [`super::Coordinates::to_body`].
    pub const fn new(mounting_rad: f64) -> Self {
        Self { line: Line::new(), mounting_rad, counts: Counts::new() }
    }

    /// Consumes bytes up to the end of the next set or a line refused; `None` when all were consumed.
    ///
    /// A set ends with `:BD`, or, where the instrument sends none, with the `:SA` of the next.
    pub fn feed(&mut self, bytes: &mut &[u8]) -> Option<Result<DvlSample, Error>> {
        let _ = (&self.line, self.mounting_rad);
        *bytes = &[];
        None
    }

    /// Lines accepted, and the ones refused by cause ([`Error::Unhandled`]: lines that add nothing).
    pub const fn counts(&self) -> &Counts {
        &self.counts
    }
}

/// Writes the set of an instrument that measured `sample` in instrument axes.
///
/// # Errors
/// [`Error::BufferFull`], [`Error::OutOfRange`].
pub fn emit<'b>(sample: &DvlSample, mounting_rad: f64, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
    let _ = (sample, mounting_rad, buffer);
    Err(Error::BufferFull)
}
