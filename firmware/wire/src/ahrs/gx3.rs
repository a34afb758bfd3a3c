//! MicroStrain 3DM-GX3-25, single-byte protocol: big-endian replies that begin with the echo of their command.

use super::AhrsSample;
use crate::framer::{Verdict, Window};
use crate::{Counts, Error};

/// Ticks of the device's timer in a second.
pub const TICKS_PER_S: u32 = 62_500;

/// Which reply a frame is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Command {
    /// Acceleration, rate.
    AccelRate = 0xC2,
    /// Orientation matrix.
    Matrix = 0xC5,
    /// Acceleration, rate, matrix.
    AccelRateMatrix = 0xC8,
    /// Acceleration, rate, magnetic field.
    AccelRateMag = 0xCB,
    /// Acceleration, rate, magnetic field, matrix.
    AccelRateMagMatrix = 0xCC,
    /// Roll, pitch, yaw.
    Euler = 0xCE,
    /// Roll, pitch, yaw, rates.
    EulerRate = 0xCF,
    /// Gyro-stabilised acceleration, rate, magnetic field.
    Stabilised = 0xD2,
}

/// One data reply, in units of the wire.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reply {
    /// Which.
    pub command: Command,
    /// Specific force, g.
    pub accel_g: Option<[f32; 3]>,
    /// Rates, rad/s.
    pub rate_radps: Option<[f32; 3]>,
    /// Magnetic field, Gauss.
    pub mag_gauss: Option<[f32; 3]>,
    /// Orientation matrix M (earth to sensor), by rows.
    pub matrix: Option<[f32; 9]>,
    /// Roll, pitch, yaw, rad.
    pub euler_rad: Option<[f32; 3]>,
    /// Timer.
    pub ticks: u32,
}

/// What the device answers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FromGx3 {
    /// Data: the sample, with the timer unrolled, and the reply itself.
    Data(AhrsSample, Reply),
    /// Continuous mode is on with this command byte (0: off).
    Continuous(u8),
}

/// What the host sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ToGx3 {
    /// One reply.
    Poll(Command),
    /// Replies without end, at the device's set rate.
    Continuous(Command),
    /// `FA`: stop them.
    Stop,
}

impl ToGx3 {
    /// The command's bytes.
    ///
    /// # Errors
    /// [`Error::BufferFull`].
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let _ = buffer;
        Err(Error::BufferFull)
    }

    /// The command at the front of `bytes` and its length; `None` while it is incomplete.
    ///
    /// # Errors
    /// [`Error::Unknown`] when no command begins here: go on one byte further.
    pub fn parse(bytes: &[u8]) -> Result<Option<(Self, usize)>, Error> {
        let _ = bytes;
        Err(Error::Unknown)
    }
}

impl Reply {
    /// Reads a whole reply with its checksum.
    ///
    /// # Errors
    /// [`Error::Unknown`], [`Error::Length`], [`Error::Checksum`], [`Error::OutOfRange`] for values no sensor gives.
    pub fn parse(frame: &[u8]) -> Result<Self, Error> {
        let _ = frame;
        Err(Error::Unknown)
    }

    /// Reply `EulerRate` of a device that measured `euler_rad` and `rate_radps`.
    pub const fn euler_rate(euler_rad: [f32; 3], rate_radps: [f32; 3], ticks: u32) -> Self {
        Self {
            command: Command::EulerRate,
            accel_g: None,
            rate_radps: Some(rate_radps),
            mag_gauss: None,
            matrix: None,
            euler_rad: Some(euler_rad),
            ticks,
        }
    }

    /// Writes the reply; values its command needs and that are absent are 0.
    ///
    /// # Errors
    /// [`Error::BufferFull`].
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let _ = buffer;
        Err(Error::BufferFull)
    }
}

/// Writes the acknowledgement of [`ToGx3::Continuous`].
///
/// # Errors
/// [`Error::BufferFull`].
pub fn emit_continuous(command: u8, buffer: &mut [u8]) -> Result<&[u8], Error> {
    let _ = (command, buffer);
    Err(Error::BufferFull)
}

/// Finds replies in a byte stream.
pub struct Decoder {
    window: Window<160>,
}

impl Decoder {
    /// An empty decoder.
    pub const fn new() -> Self {
        Self { window: Window::new() }
    }

    /// Consumes bytes up to the next reply or rejection; `None` when all were consumed.
    pub fn feed(&mut self, bytes: &mut &[u8]) -> Option<Result<FromGx3, Error>> {
        Some(self.window.feed(bytes, |_| Verdict::Noise)?.and(Err(Error::Unknown)))
    }

    /// Replies accepted, and the rejections by cause.
    pub const fn counts(&self) -> &Counts {
        &self.window.counts
    }
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}
