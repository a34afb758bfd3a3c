//! MicroStrain MIP (3DM-GX3-35/45, GX4, GX5, CX5): big-endian packets of fields.

use super::AhrsSample;
use crate::framer::{Verdict, Window};
use crate::{Counts, Error};

/// Longest packet.
pub const MAX_PACKET: usize = 261;

/// Descriptor sets.
pub mod set {
    /// Base commands.
    pub const BASE: u8 = 0x01;
    /// 3DM commands.
    pub const THREE_DM: u8 = 0x0C;
    /// Sensor data.
    pub const SENSOR: u8 = 0x80;
    /// Filter data.
    pub const FILTER: u8 = 0x82;
}

/// A packet whose checksum was verified.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet<'a> {
    /// Descriptor set.
    pub set: u8,
    payload: &'a [u8],
}

/// A field of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Field<'a> {
    /// Descriptor.
    pub descriptor: u8,
    /// Its data.
    pub data: &'a [u8],
}

/// Answer to a command (field F1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Answer {
    /// Descriptor of the command.
    pub command: u8,
    /// 0 ok, 1 unknown, 2 checksum, 3 invalid parameter, 4 failed, 5 timeout.
    pub code: u8,
}

impl<'a> Packet<'a> {
    /// Reads a whole packet with its checksum.
    ///
    /// # Errors
    /// [`Error::Framing`] without `75 65`, [`Error::Length`], [`Error::Checksum`].
    pub fn parse(frame: &'a [u8]) -> Result<Self, Error> {
        let _ = frame;
        Err(Error::Framing)
    }

    /// The fields in turn; one that is shorter than its header or reaches beyond the payload is [`Error::Offset`] and the last.
    pub fn fields(&self) -> impl Iterator<Item = Result<Field<'a>, Error>> + use<'a> {
        let _ = self.payload;
        core::iter::empty()
    }

    /// Sensor or filter data; `None` for other sets and for packets with none of it.
    ///
    /// # Errors
    /// [`Error::Offset`], [`Error::Length`], [`Error::Invalid`] when the filter marks its attitude as not valid,
    /// [`Error::OutOfRange`] for values no sensor gives.
    pub fn sample(&self) -> Result<Option<AhrsSample>, Error> {
        Ok(None)
    }

    /// The first answer to a command.
    pub fn answer(&self) -> Option<Answer> {
        None
    }
}

/// Writes a packet of fields.
///
/// # Errors
/// [`Error::BufferFull`], [`Error::Length`] beyond 255 bytes.
pub fn emit<'b>(set: u8, fields: &[Field<'_>], buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
    let _ = (set, fields, buffer);
    Err(Error::BufferFull)
}

/// Writes a sensor data packet (set 80): attitude (complementary filter), rates and specific force as far as they are there.
///
/// # Errors
/// [`Error::BufferFull`].
pub fn emit_sample<'b>(sample: &AhrsSample, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
    let _ = (sample, buffer);
    Err(Error::BufferFull)
}

/// Writes the command (0C/08) that makes sensor packets of specific force, rates and attitude, at the base rate / `decimation`.
///
/// # Errors
/// [`Error::BufferFull`].
pub fn emit_format(decimation: u16, buffer: &mut [u8]) -> Result<&[u8], Error> {
    let _ = (decimation, buffer);
    Err(Error::BufferFull)
}

/// Writes the command (0C/11) that switches the sensor data stream.
///
/// # Errors
/// [`Error::BufferFull`].
pub fn emit_stream(on: bool, buffer: &mut [u8]) -> Result<&[u8], Error> {
    let _ = (on, buffer);
    Err(Error::BufferFull)
}

/// Finds packets in a byte stream.
pub struct Decoder {
    window: Window<{ 2 * MAX_PACKET }>,
}

impl Decoder {
    /// An empty decoder.
    pub const fn new() -> Self {
        Self { window: Window::new() }
    }

    /// Consumes bytes up to the next packet or rejection; `None` when all were consumed.
    pub fn feed(&mut self, bytes: &mut &[u8]) -> Option<Result<Packet<'_>, Error>> {
        Some(self.window.feed(bytes, |_| Verdict::Noise)?.and_then(Packet::parse))
    }

    /// Packets accepted, and the rejections by cause.
    pub const fn counts(&self) -> &Counts {
        &self.window.counts
    }
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}
