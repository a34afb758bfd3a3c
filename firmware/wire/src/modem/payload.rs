//! Bytes that travel as hexadecimal digits.

use crate::write::Writer;
use crate::{Error, hex};

/// Payload bytes, borrowed as the digits of a sentence or as plain bytes; equal when the bytes are.
#[derive(Clone, Copy, Debug)]
pub struct Payload<'a>(PayloadSource<'a>);

#[derive(Clone, Copy, Debug)]
enum PayloadSource<'a> {
    /// An even number of digits, checked.
    Digits(&'a [u8]),
    Bytes(&'a [u8]),
}

impl<'a> Payload<'a> {
    /// Of plain bytes.
    pub const fn new(bytes: &'a [u8]) -> Self {
        Self(PayloadSource::Bytes(bytes))
    }

    pub(crate) fn from_digits(digits: &'a [u8]) -> Result<Self, Error> {
        if !digits.len().is_multiple_of(2) || digits.iter().any(|digit| hex::digit(*digit).is_err()) {
            return Err(Error::Malformed);
        }
        Ok(Self(PayloadSource::Digits(digits)))
    }

    /// Number of bytes.
    pub const fn len(&self) -> usize {
        match self.0 {
            PayloadSource::Digits(digits) => digits.len() / 2,
            PayloadSource::Bytes(bytes) => bytes.len(),
        }
    }

    /// No bytes.
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The bytes, one by one.
    pub fn bytes(&self) -> impl Iterator<Item = u8> + '_ {
        (0..self.len()).filter_map(|index| match self.0 {
            PayloadSource::Digits(digits) => match digits.get(2 * index..2 * index + 2) {
                Some([high, low]) => hex::decode(*high, *low).ok(),
                _ => None,
            },
            PayloadSource::Bytes(bytes) => bytes.get(index).copied(),
        })
    }

    /// Copies the bytes into `buffer`.
    ///
    /// # Errors
    /// [`Error::BufferFull`].
    pub fn copy_to<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let target = buffer.get_mut(..self.len()).ok_or(Error::BufferFull)?;
        for (slot, byte) in target.iter_mut().zip(self.bytes()) {
            *slot = byte;
        }
        Ok(target)
    }

    pub(crate) fn write(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        self.bytes().try_for_each(|byte| writer.hex(byte))
    }
}

impl PartialEq for Payload<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.len() == other.len() && self.bytes().eq(other.bytes())
    }
}

/// `crc;count;digits` of a flexible data packet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fragment<'a> {
    /// Its CRC was right.
    pub good: bool,
    /// The bytes.
    pub payload: Payload<'a>,
}
