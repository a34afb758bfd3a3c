//! NMEA-shaped sentences, `$body*hh`, of every text device: framing, fields, emission.
//!
//! Not the sentences of NMEA 0183 alone: identifiers are of any length and `$C82.8P-3.89` has no comma at all.

use crate::calendar::{DateTime, TimeOfDay};
use crate::framer::LineBuffer;
use crate::write::Writer;
use crate::{Counts, Decimal, Error, hex};

/// Longest body taken; a Micro-Modem frame of 256 bytes is 512 digits and a header.
pub const MAX_BODY: usize = 768;
/// A buffer of this size holds any sentence emitted.
pub const MAX_SENTENCE: usize = MAX_BODY + 6;

/// Whether a sentence may come without `*hh`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Checksum {
    /// It must be there.
    Required,
    /// When it is there it must be right.
    Optional,
}

/// A sentence whose checksum was verified.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sentence<'a> {
    body: &'a [u8],
}

impl<'a> Sentence<'a> {
    /// Verifies one line, with or without its line end.
    ///
    /// # Errors
    /// [`Error::Framing`] without `$` or with characters that are not printable, [`Error::Overflow`],
    /// [`Error::Checksum`], [`Error::ChecksumMissing`], [`Error::Malformed`] when `*` is not followed by one or two hex
    /// digits.
    pub fn from_line(line: &'a [u8], checksum: Checksum) -> Result<Self, Error> {
        let text = line.trim_ascii_end().strip_prefix(b"$").ok_or(Error::Framing)?;
        if text.len() > MAX_BODY {
            return Err(Error::Overflow);
        }
        if text.iter().any(|byte| !matches!(byte, b' '..=b'~') || *byte == b'$') {
            return Err(Error::Framing);
        }
        Self::from_text(text, checksum)
    }

    fn from_text(text: &'a [u8], checksum: Checksum) -> Result<Self, Error> {
        let Some(star) = text.iter().rposition(|byte| *byte == b'*') else {
            return match checksum {
                Checksum::Required => Err(Error::ChecksumMissing),
                Checksum::Optional => Ok(Self { body: text }),
            };
        };
        let (body, tail) = text.split_at_checked(star).ok_or(Error::Malformed)?;
        // One frontseat emulation in the field drops a leading zero.
        let printed = match tail {
            [_, high, low] => hex::decode(*high, *low)?,
            [_, low] => hex::digit(*low)?,
            _ => return Err(Error::Malformed),
        };
        if printed == xor(body) { Ok(Self { body }) } else { Err(Error::Checksum) }
    }

    /// Everything between `$` and `*`.
    pub const fn body(&self) -> &'a [u8] {
        self.body
    }

    /// Everything before the first comma.
    pub fn id(&self) -> &'a [u8] {
        self.fields().id
    }

    /// The fields after the identifier.
    pub fn fields(&self) -> Fields<'a> {
        let mut parts = self.body.splitn(2, |byte| *byte == b',');
        Fields { id: parts.next().unwrap_or(&[]), rest: parts.next() }
    }
}

fn xor(body: &[u8]) -> u8 {
    body.iter().fold(0, |sum, byte| sum ^ byte)
}

/// Finds sentences in a byte stream. Feed it, and count what its sentences turn out to be yourself.
///
/// ```
/// use backseat_wire::nmea::{Checksum, Framer};
/// let mut framer = Framer::new(Checksum::Required);
/// let mut bytes: &[u8] = b"noise$ACK,8,0,0*5D\r\n$ACK,9,0,0*00\r\n";
/// let mut seen = 0;
/// while let Some(outcome) = framer.feed(&mut bytes) {
///     if let Ok(sentence) = outcome {
///         assert_eq!(sentence.id(), b"ACK");
///         seen += 1;
///     }
/// }
/// assert_eq!((seen, framer.counts().rejected()), (1, 1));
/// ```
pub struct Framer {
    line: LineBuffer<MAX_BODY>,
    checksum: Checksum,
    counts: Counts,
}

impl Framer {
    /// An empty framer.
    pub const fn new(checksum: Checksum) -> Self {
        Self { line: LineBuffer::new(), checksum, counts: Counts::new() }
    }

    /// From now on `checksum` holds.
    pub fn set_checksum(&mut self, checksum: Checksum) {
        self.checksum = checksum;
    }

    /// Consumes bytes up to the end of the next sentence, good or bad; `None` when all were consumed without one.
    pub fn feed(&mut self, bytes: &mut &[u8]) -> Option<Result<Sentence<'_>, Error>> {
        loop {
            let (first, rest) = bytes.split_first()?;
            *bytes = rest;
            match self.line.push(*first, b'$', &mut self.counts) {
                Ok(false) => {}
                Ok(true) => break,
                Err(cause) => {
                    self.counts.note_error(cause);
                    return Some(Err(cause));
                }
            }
        }
        Some(self.counts.note(Sentence::from_text(self.line.text(), self.checksum)))
    }

    /// Sentences whose frame was good, and the bad ones by cause.
    pub const fn counts(&self) -> &Counts {
        &self.counts
    }
}

/// Reads the fields of a sentence from the left. Past the last one every field is blank.
#[derive(Clone, Debug)]
pub struct Fields<'a> {
    id: &'a [u8],
    rest: Option<&'a [u8]>,
}

impl<'a> Fields<'a> {
    /// Whether the sentence has no further field, not even a blank one.
    pub const fn is_empty(&self) -> bool {
        self.rest.is_none()
    }

    /// What was not read yet, commas included.
    pub fn remaining(&self) -> &'a [u8] {
        self.rest.unwrap_or(&[])
    }

    /// The next field's characters, perhaps none.
    pub fn raw(&mut self) -> &'a [u8] {
        let Some(rest) = self.rest else { return &[] };
        let mut parts = rest.splitn(2, |byte| *byte == b',');
        let field = parts.next().unwrap_or(&[]);
        self.rest = parts.next();
        field
    }

    /// The next field, which must not be blank.
    pub(crate) fn some(&mut self) -> Result<&'a [u8], Error> {
        match self.raw() {
            [] => Err(Error::Missing),
            field => Ok(field),
        }
    }

    pub(crate) fn text(&mut self) -> Result<&'a str, Error> {
        core::str::from_utf8(self.raw()).map_err(|_| Error::Malformed)
    }

    pub(crate) fn decimal(&mut self) -> Result<Decimal, Error> {
        Decimal::parse(self.raw())
    }

    pub(crate) fn number(&mut self) -> Result<f64, Error> {
        Ok(self.decimal()?.to_f64())
    }

    pub(crate) fn optional<T>(&mut self, parse: impl FnOnce(&'a [u8]) -> Result<T, Error>) -> Result<Option<T>, Error> {
        match self.raw() {
            [] => Ok(None),
            field => parse(field).map(Some),
        }
    }

    pub(crate) fn optional_number(&mut self) -> Result<Option<f64>, Error> {
        self.optional(|field| Ok(Decimal::parse(field)?.to_f64()))
    }

    pub(crate) fn integer<T: TryFrom<i64>>(&mut self) -> Result<T, Error> {
        parse_integer(self.raw())
    }

    pub(crate) fn flag(&mut self) -> Result<bool, Error> {
        parse_flag(self.raw())
    }

    pub(crate) fn time(&mut self) -> Result<TimeOfDay, Error> {
        TimeOfDay::parse(self.raw())
    }

    pub(crate) fn iso_time(&mut self) -> Result<DateTime, Error> {
        DateTime::parse_iso(self.some()?)
    }
}

/// A whole number without point.
pub(crate) fn parse_integer<T: TryFrom<i64>>(field: &[u8]) -> Result<T, Error> {
    let decimal = Decimal::parse(field)?;
    if field.contains(&b'.') {
        return Err(Error::Malformed);
    }
    T::try_from(decimal.mantissa()).map_err(|_| Error::OutOfRange)
}

pub(crate) fn parse_flag(field: &[u8]) -> Result<bool, Error> {
    match field {
        b"0" => Ok(false),
        b"1" => Ok(true),
        [] => Err(Error::Missing),
        _ => Err(Error::Malformed),
    }
}

/// Refuses what is outside `[min, max]`, NaN included.
pub(crate) fn within(value: f64, min: f64, max: f64) -> Result<f64, Error> {
    if value >= min && value <= max { Ok(value) } else { Err(Error::OutOfRange) }
}

/// Writes one sentence.
pub(crate) struct Emitter<'b> {
    writer: Writer<'b>,
}

impl<'b> Emitter<'b> {
    /// Begins `$id`.
    pub(crate) fn new(buffer: &'b mut [u8], id: &str) -> Result<Self, Error> {
        let mut writer = Writer::new(buffer);
        writer.byte(b'$')?;
        writer.bytes(id.as_bytes())?;
        Ok(Self { writer })
    }

    /// A comma, and then what `write` writes.
    pub(crate) fn field(
        &mut self,
        write: impl FnOnce(&mut Writer<'b>) -> Result<(), Error>,
    ) -> Result<&mut Self, Error> {
        self.writer.byte(b',')?;
        write(&mut self.writer)?;
        Ok(self)
    }

    /// Writes without a comma.
    pub(crate) fn tagged(&mut self, tag: &str, value: Decimal) -> Result<&mut Self, Error> {
        self.writer.bytes(tag.as_bytes())?;
        self.writer.decimal(value)?;
        Ok(self)
    }

    pub(crate) fn blank(&mut self) -> Result<&mut Self, Error> {
        self.field(|_| Ok(()))
    }

    /// Text that contains no delimiter.
    pub(crate) fn text(&mut self, text: &str) -> Result<&mut Self, Error> {
        if text.bytes().any(|byte| !matches!(byte, b' '..=b'~') || matches!(byte, b'$' | b'*')) {
            return Err(Error::Malformed);
        }
        self.field(|writer| writer.bytes(text.as_bytes()))
    }

    pub(crate) fn unsigned(&mut self, value: impl Into<u64>) -> Result<&mut Self, Error> {
        self.padded(value, 1)
    }

    pub(crate) fn padded(&mut self, value: impl Into<u64>, width: usize) -> Result<&mut Self, Error> {
        let value = value.into();
        self.field(|writer| writer.unsigned(value, width))
    }

    pub(crate) fn signed(&mut self, value: impl Into<i64>) -> Result<&mut Self, Error> {
        let value = value.into();
        self.field(|writer| writer.signed(value))
    }

    pub(crate) fn flag(&mut self, value: bool) -> Result<&mut Self, Error> {
        self.unsigned(u64::from(value))
    }

    pub(crate) fn decimal(&mut self, value: Decimal) -> Result<&mut Self, Error> {
        self.field(|writer| writer.decimal(value))
    }

    pub(crate) fn number(&mut self, value: f64, decimals: u8) -> Result<&mut Self, Error> {
        self.decimal(Decimal::from_f64(value, decimals)?)
    }

    pub(crate) fn optional_number(&mut self, value: Option<f64>, decimals: u8) -> Result<&mut Self, Error> {
        match value {
            Some(value) => self.number(value, decimals),
            None => self.blank(),
        }
    }

    /// `*hh` and the line end.
    pub(crate) fn finish(mut self) -> Result<&'b [u8], Error> {
        let sum = xor(self.writer.written().get(1..).unwrap_or(&[]));
        self.writer.byte(b'*')?;
        self.writer.hex(sum)?;
        self.writer.bytes(b"\r\n")?;
        Ok(self.writer.finish())
    }
}
