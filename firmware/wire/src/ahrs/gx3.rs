//! MicroStrain 3DM-GX3-25, single-byte protocol: big-endian replies that begin with the echo of their command.

use super::AhrsSample;
use crate::framer::{Verdict, Window, at, judged, sum16};
use crate::write::Writer;
use crate::{Counts, Error};

/// Ticks of the device's timer in a second.
pub const TICKS_PER_S: u32 = 62_500;
/// Longest reply.
pub const MAX_REPLY: usize = 79;

const TICK_US: u64 = 1_000_000 / TICKS_PER_S as u64;
/// A timer that seems to have gone further than 10 s between replies was reset.
const MAX_GAP_TICKS: u32 = 10 * TICKS_PER_S;

/// Which reply a frame is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

/// A group of values in a reply.
#[derive(Clone, Copy)]
enum Group {
    Accel,
    Rate,
    Mag,
    Matrix,
    Euler,
}

impl Command {
    const ALL: [Self; 8] = [
        Self::AccelRate,
        Self::Matrix,
        Self::AccelRateMatrix,
        Self::AccelRateMag,
        Self::AccelRateMagMatrix,
        Self::Euler,
        Self::EulerRate,
        Self::Stabilised,
    ];

    fn from_byte(byte: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|command| *command as u8 == byte)
    }

    const fn groups(self) -> &'static [Group] {
        match self {
            Self::AccelRate => &[Group::Accel, Group::Rate],
            Self::Matrix => &[Group::Matrix],
            Self::AccelRateMatrix => &[Group::Accel, Group::Rate, Group::Matrix],
            Self::AccelRateMag | Self::Stabilised => &[Group::Accel, Group::Rate, Group::Mag],
            Self::AccelRateMagMatrix => &[Group::Accel, Group::Rate, Group::Mag, Group::Matrix],
            Self::Euler => &[Group::Euler],
            Self::EulerRate => &[Group::Euler, Group::Rate],
        }
    }

    /// Bytes of the reply: echo, values, timer, checksum.
    fn reply_length(self) -> usize {
        let values = |group: &Group| if matches!(group, Group::Matrix) { 9 } else { 3 };
        1 + 4 * self.groups().iter().map(values).sum::<usize>() + 4 + 2
    }
}

/// One data reply, in units of the wire.
#[derive(Clone, Copy, Debug, PartialEq)]
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
pub enum FromGx3 {
    /// Data: the sample, with the timer unrolled, and which reply it was.
    Data(AhrsSample, Command),
    /// Continuous mode is on with this command byte (0: off).
    Continuous(u8),
}

/// What the host sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToGx3 {
    /// One reply.
    Poll(Command),
    /// Replies without end, at the device's set rate.
    Continuous(Command),
    /// `FA`: stop them.
    Stop,
}

const CONTINUOUS: u8 = 0xC4;
const CONTINUOUS_REPLY: usize = 8;
const CONFIRM: [u8; 2] = [0xC1, 0x29];
const STOP: u8 = 0xFA;

impl ToGx3 {
    /// The command's bytes.
    ///
    /// # Errors
    /// [`Error::BufferFull`].
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let mut writer = Writer::new(buffer);
        match self {
            Self::Poll(command) => writer.byte(*command as u8)?,
            Self::Continuous(command) => {
                writer.byte(CONTINUOUS)?;
                writer.bytes(&CONFIRM)?;
                writer.byte(*command as u8)?;
            }
            Self::Stop => writer.byte(STOP)?,
        }
        Ok(writer.finish())
    }

    /// The command at the front of `bytes` and its length; `None` while it is incomplete.
    ///
    /// # Errors
    /// [`Error::Unknown`] when no command begins here: go on one byte further.
    pub fn parse(bytes: &[u8]) -> Result<Option<(Self, usize)>, Error> {
        match bytes {
            [] | [CONTINUOUS] | [CONTINUOUS, 0xC1] | [CONTINUOUS, 0xC1, 0x29] => Ok(None),
            [CONTINUOUS, 0xC1, 0x29, command, ..] => {
                let command = Command::from_byte(*command).ok_or(Error::Unknown)?;
                Ok(Some((Self::Continuous(command), 4)))
            }
            [STOP, ..] => Ok(Some((Self::Stop, 1))),
            [command, ..] => Ok(Some((Self::Poll(Command::from_byte(*command).ok_or(Error::Unknown)?), 1))),
        }
    }
}

impl Reply {
    const fn empty(command: Command, ticks: u32) -> Self {
        Self { command, accel_g: None, rate_radps: None, mag_gauss: None, matrix: None, euler_rad: None, ticks }
    }

    /// Reads a whole reply with its checksum.
    ///
    /// # Errors
    /// [`Error::Unknown`], [`Error::Length`], [`Error::Checksum`], [`Error::OutOfRange`] for values no sensor gives.
    pub fn parse(frame: &[u8]) -> Result<Self, Error> {
        let command = frame.first().copied().and_then(Command::from_byte).ok_or(Error::Unknown)?;
        if frame.len() != command.reply_length() {
            return Err(Error::Length);
        }
        verify(frame)?;
        let mut offset = 1;
        let mut reply = Self::empty(command, 0);
        for group in command.groups() {
            match group {
                Group::Accel => reply.accel_g = Some(floats(frame, &mut offset)?),
                Group::Rate => reply.rate_radps = Some(floats(frame, &mut offset)?),
                Group::Mag => reply.mag_gauss = Some(floats(frame, &mut offset)?),
                Group::Matrix => reply.matrix = Some(floats(frame, &mut offset)?),
                Group::Euler => reply.euler_rad = Some(floats(frame, &mut offset)?),
            }
        }
        reply.ticks = u32::from_be_bytes(at(frame, offset)?);
        Ok(reply)
    }

    /// Reply `EulerRate` of a device that measured `euler_rad` and `rate_radps`.
    pub const fn euler_rate(euler_rad: [f32; 3], rate_radps: [f32; 3], ticks: u32) -> Self {
        Self { rate_radps: Some(rate_radps), euler_rad: Some(euler_rad), ..Self::empty(Command::EulerRate, ticks) }
    }

    /// What it means, without the timer; attitude from the matrix where there are no angles.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for values no sensor gives.
    pub fn sample(&self) -> Result<AhrsSample, Error> {
        let angles = match (self.euler_rad, self.matrix) {
            (Some(euler), _) => Some(euler.map(f64::from)),
            (None, Some(matrix)) => Some(matrix_to_euler(matrix)?),
            (None, None) => None,
        };
        if self.mag_gauss.is_some_and(|mag| super::finite_within(mag.map(f64::from), 100.0).is_err()) {
            return Err(Error::OutOfRange);
        }
        Ok(AhrsSample {
            euler_rad: angles.map(super::euler).transpose()?,
            rates_radps: self.rate_radps.map(|rate| super::rates(rate.map(f64::from))).transpose()?,
            specific_force_mps2: self.accel_g.map(|accel| super::specific_force(accel.map(f64::from))).transpose()?,
            timer_us: None,
        })
    }

    /// Writes the reply; values its command needs and that are absent are 0.
    ///
    /// # Errors
    /// [`Error::BufferFull`].
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let mut writer = Writer::new(buffer);
        writer.byte(self.command as u8)?;
        for group in self.command.groups() {
            let three = match group {
                Group::Accel => self.accel_g,
                Group::Rate => self.rate_radps,
                Group::Mag => self.mag_gauss,
                Group::Euler => self.euler_rad,
                Group::Matrix => {
                    let matrix = self.matrix.unwrap_or_default();
                    matrix.iter().try_for_each(|value| writer.bytes(&value.to_be_bytes()))?;
                    continue;
                }
            };
            three.unwrap_or_default().iter().try_for_each(|value| writer.bytes(&value.to_be_bytes()))?;
        }
        finish(writer, self.ticks)
    }
}

/// Writes the acknowledgement of [`ToGx3::Continuous`].
///
/// # Errors
/// [`Error::BufferFull`].
pub fn emit_continuous(command: u8, ticks: u32, buffer: &mut [u8]) -> Result<&[u8], Error> {
    let mut writer = Writer::new(buffer);
    writer.bytes(&[CONTINUOUS, command])?;
    finish(writer, ticks)
}

fn finish(mut writer: Writer<'_>, ticks: u32) -> Result<&[u8], Error> {
    writer.bytes(&ticks.to_be_bytes())?;
    let sum = sum16(writer.written());
    writer.bytes(&sum.to_be_bytes())?;
    Ok(writer.finish())
}

fn verify(frame: &[u8]) -> Result<(), Error> {
    let (covered, printed) = frame.split_last_chunk().ok_or(Error::Length)?;
    if sum16(covered) == u16::from_be_bytes(*printed) { Ok(()) } else { Err(Error::Checksum) }
}

fn floats<const N: usize>(frame: &[u8], offset: &mut usize) -> Result<[f32; N], Error> {
    let mut values = [0.0; N];
    for value in &mut values {
        *value = f32::from_be_bytes(at(frame, *offset)?);
        *offset += 4;
    }
    Ok(values)
}

/// Roll, pitch, yaw of M, which takes earth axes to sensor axes (the transpose of body to NED).
fn matrix_to_euler(matrix: [f32; 9]) -> Result<[f64; 3], Error> {
    let matrix = matrix.map(f64::from);
    // A rotation, to the rounding of single precision.
    if !matrix.iter().all(|entry| libm::fabs(*entry) <= 1.0 + 1.0e-5) {
        return Err(Error::OutOfRange);
    }
    let [m11, m12, m13, _, _, m23, _, _, m33] = matrix;
    Ok([libm::atan2(m23, m33), libm::asin((-m13).clamp(-1.0, 1.0)), libm::atan2(m12, m11)])
}

/// Finds replies in a byte stream and unrolls the timer.
pub struct Decoder {
    window: Window<{ 2 * MAX_REPLY }>,
    ticks: Option<u32>,
    elapsed_us: u64,
    timer_resets: u32,
}

impl Decoder {
    /// An empty decoder.
    pub const fn new() -> Self {
        Self { window: Window::new(), ticks: None, elapsed_us: 0, timer_resets: 0 }
    }

    /// Consumes bytes up to the next reply or rejection; `None` when all were consumed.
    pub fn feed(&mut self, bytes: &mut &[u8]) -> Option<Result<FromGx3, Error>> {
        Some(self.window.feed(bytes, examine)?.map(|(mut answer, ticks)| {
            if let FromGx3::Data(sample, _) = &mut answer {
                sample.timer_us = Some(self.unroll(ticks));
            }
            answer
        }))
    }

    /// µs since the first reply. The timer rolls over each 19.1 h; after a reset time stands still for one reply.
    fn unroll(&mut self, ticks: u32) -> u64 {
        let gap = ticks.wrapping_sub(self.ticks.unwrap_or(ticks));
        if gap <= MAX_GAP_TICKS {
            self.elapsed_us = self.elapsed_us.saturating_add(u64::from(gap) * TICK_US);
        } else {
            self.timer_resets = self.timer_resets.saturating_add(1);
        }
        self.ticks = Some(ticks);
        self.elapsed_us
    }

    /// How often the timer was reset, or ran on for more than 10 s unseen.
    pub const fn timer_resets(&self) -> u32 {
        self.timer_resets
    }

    /// Replies accepted, and the rejections by cause.
    pub const fn counts(&self) -> &Counts {
        &self.window.counts
    }
}

/// Answer and timer. The echo byte occurs in data as well: only length and checksum confirm it.
fn examine(bytes: &[u8]) -> Verdict<(FromGx3, u32)> {
    let Some(first) = bytes.first() else { return Verdict::Incomplete };
    let command = Command::from_byte(*first);
    let length = match command {
        Some(command) => command.reply_length(),
        None if *first == CONTINUOUS => CONTINUOUS_REPLY,
        None => return Verdict::Noise,
    };
    let Some(frame) = bytes.get(..length) else { return Verdict::Incomplete };
    let content = match command {
        Some(command) => {
            Reply::parse(frame).and_then(|reply| Ok((FromGx3::Data(reply.sample()?, command), reply.ticks)))
        }
        None => acknowledgement(frame),
    };
    judged(length, content)
}

fn acknowledgement(frame: &[u8]) -> Result<(FromGx3, u32), Error> {
    verify(frame)?;
    let [command] = at(frame, 1)?;
    Ok((FromGx3::Continuous(command), u32::from_be_bytes(at(frame, 2)?)))
}
