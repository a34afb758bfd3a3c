//! Common data representation of the OMG (CDR, little and big endian), as ROS 2 writes it.

use crate::log::layout;

/// A message that is read from its beginning on; every value is `None` behind the end.
pub(super) struct Cdr<'a> {
    bytes: &'a [u8],
    at: usize,
    is_little: bool,
}

impl<'a> Cdr<'a> {
    pub(super) fn new(message: &'a [u8]) -> Option<Self> {
        let (head, bytes) = message.split_at_checked(4)?;
        Some(Self { bytes, at: 0, is_little: head[1] & 1 == 1 })
    }

    /// A number by its letter.
    pub(super) fn number(&mut self, code: u8) -> Option<f64> {
        let size = layout::size(code);
        self.at = self.at.next_multiple_of(size.max(1));
        let number = layout::number(code, self.bytes.get(self.at..)?, !self.is_little)?;
        self.at += size;
        Some(number)
    }

    pub(super) fn numbers(&mut self, code: u8, count: usize) -> Option<Vec<f64>> {
        (0..count).map(|_| self.number(code)).collect()
    }

    /// Number of elements that follow.
    pub(super) fn length(&mut self) -> Option<usize> {
        self.number(b'i').filter(|length| *length >= 0.0).map(|length| length as usize)
    }

    /// A text without the zero at its end.
    pub(super) fn string(&mut self) -> Option<&'a [u8]> {
        let length = self.length()?;
        let text = self.bytes.get(self.at..self.at.checked_add(length)?)?;
        self.at += length;
        Some(text.strip_suffix(&[0]).unwrap_or(text))
    }

    /// The stamp of a header, µs since its clock began.
    pub(super) fn header_us(&mut self) -> Option<i64> {
        let (seconds, nanoseconds) = (self.number(b'i')? as i64, self.number(b'I')? as i64);
        self.string()?; // frame_id
        Some(seconds * 1_000_000 + nanoseconds / 1000)
    }
}
