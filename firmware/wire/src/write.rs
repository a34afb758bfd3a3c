//! Writing into a byte slice without panics.

use crate::{Decimal, Error};

/// Appends to a borrowed buffer; past its end everything is [`Error::BufferFull`].
pub(crate) struct Writer<'b> {
    buffer: &'b mut [u8],
    length: usize,
}

impl<'b> Writer<'b> {
    pub(crate) fn new(buffer: &'b mut [u8]) -> Self {
        Self { buffer, length: 0 }
    }

    pub(crate) fn byte(&mut self, byte: u8) -> Result<(), Error> {
        *self.buffer.get_mut(self.length).ok_or(Error::BufferFull)? = byte;
        self.length += 1;
        Ok(())
    }

    pub(crate) fn bytes(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let end = self.length.checked_add(bytes.len()).ok_or(Error::BufferFull)?;
        self.buffer.get_mut(self.length..end).ok_or(Error::BufferFull)?.copy_from_slice(bytes);
        self.length = end;
        Ok(())
    }

    /// Decimal digits, zero-padded to `width`.
    pub(crate) fn unsigned(&mut self, mut value: u64, width: usize) -> Result<(), Error> {
        let mut digits = [b'0'; 20];
        let mut first = digits.len();
        for (index, digit) in digits.iter_mut().enumerate().rev() {
            *digit = b'0' + (value % 10) as u8;
            value /= 10;
            first = index;
            if value == 0 {
                break;
            }
        }
        let first = first.min(digits.len().saturating_sub(width));
        self.bytes(digits.get(first..).unwrap_or(&[]))
    }

    pub(crate) fn signed(&mut self, value: i64) -> Result<(), Error> {
        if value < 0 {
            self.byte(b'-')?;
        }
        self.unsigned(value.unsigned_abs(), 1)
    }

    pub(crate) fn decimal(&mut self, value: Decimal) -> Result<(), Error> {
        self.decimal_padded(value, 1)
    }

    /// A decimal whose integer part is zero-padded to `width` digits.
    pub(crate) fn decimal_padded(&mut self, value: Decimal, width: usize) -> Result<(), Error> {
        let unit = value.unit();
        let magnitude = value.mantissa().unsigned_abs();
        if value.mantissa() < 0 {
            self.byte(b'-')?;
        }
        self.unsigned(magnitude / unit, width)?;
        if value.scale() > 0 {
            self.byte(b'.')?;
            self.unsigned(magnitude % unit, usize::from(value.scale()))?;
        }
        Ok(())
    }

    pub(crate) fn hex(&mut self, byte: u8) -> Result<(), Error> {
        self.bytes(&crate::hex::encode(byte))
    }

    pub(crate) fn written(&self) -> &[u8] {
        self.buffer.get(..self.length).unwrap_or(&[])
    }

    pub(crate) fn finish(self) -> &'b [u8] {
        let Self { buffer, length } = self;
        buffer.get(..length).unwrap_or(&[])
    }
}
