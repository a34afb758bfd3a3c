//! MicroStrain MIP (3DM-GX3-35/45, GX4, GX5, CX5): big-endian packets of fields.

use super::AhrsSample;
use crate::framer::{Verdict, Window, at};
use crate::units::G_MPS2;
use crate::write::Writer;
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
pub struct Packet<'a> {
    /// Descriptor set.
    pub set: u8,
    payload: &'a [u8],
}

/// A field of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field<'a> {
    /// Descriptor.
    pub descriptor: u8,
    /// Its data.
    pub data: &'a [u8],
}

/// Answer to a command (field F1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Descriptor of the command.
    pub command: u8,
    /// 0 ok, 1 unknown, 2 checksum, 3 invalid parameter, 4 failed, 5 timeout.
    pub code: u8,
}

const SYNC: [u8; 2] = [0x75, 0x65];
/// Sync, set, length; and the checksum behind the payload.
const HEADER: usize = 4;
const CHECKSUM: usize = 2;

const ANSWER: u8 = 0xF1;
const REFERENCE_TIME_NS: u8 = 0xD5;
const SENSOR_ACCEL: u8 = 0x04;
const SENSOR_RATE: u8 = 0x05;
const SENSOR_EULER: u8 = 0x0C;
const FILTER_EULER: u8 = 0x05;
const COMMAND_IMU_FORMAT: u8 = 0x08;
const COMMAND_STREAM: u8 = 0x11;
const APPLY: u8 = 1;
const STREAM_IMU: u8 = 1;

impl<'a> Packet<'a> {
    /// Reads a whole packet with its checksum.
    ///
    /// # Errors
    /// [`Error::Framing`] without `75 65`, [`Error::Length`], [`Error::Checksum`].
    pub fn parse(frame: &'a [u8]) -> Result<Self, Error> {
        match examine(frame) {
            Verdict::Frame(length, ()) if length == frame.len() => Self::view(frame),
            Verdict::Frame(..) | Verdict::Incomplete => Err(Error::Length),
            Verdict::Noise => Err(Error::Framing),
            Verdict::Reject(cause) => Err(cause),
        }
    }

    /// Of a frame that was examined.
    fn view(frame: &'a [u8]) -> Result<Self, Error> {
        let [set] = at(frame, 2)?;
        let payload = frame.get(HEADER..frame.len().saturating_sub(CHECKSUM)).ok_or(Error::Length)?;
        Ok(Self { set, payload })
    }

    /// The fields in turn; one that is shorter than its header or reaches beyond the payload is [`Error::Offset`] and
    /// the last.
    pub fn fields(&self) -> impl Iterator<Item = Result<Field<'a>, Error>> + use<'a> {
        let mut rest = self.payload;
        core::iter::from_fn(move || {
            let (length, _) = rest.split_first()?;
            let Some((field, next)) = rest.split_at_checked(usize::from(*length)) else {
                rest = &[];
                return Some(Err(Error::Offset));
            };
            let [_, descriptor, data @ ..] = field else {
                rest = &[];
                return Some(Err(Error::Offset));
            };
            rest = next;
            Some(Ok(Field { descriptor: *descriptor, data }))
        })
    }

    /// Sensor or filter data; `None` for other sets and for packets with none of it.
    ///
    /// # Errors
    /// [`Error::Offset`], [`Error::Length`], [`Error::Invalid`] when the filter marks its attitude as not valid,
    /// [`Error::OutOfRange`] for values no sensor gives.
    pub fn sample(&self) -> Result<Option<AhrsSample>, Error> {
        let mut sample = AhrsSample::default();
        for field in self.fields() {
            let Field { descriptor, data } = field?;
            match (self.set, descriptor) {
                (set::SENSOR, SENSOR_ACCEL) => sample.specific_force_mps2 = Some(super::specific_force(three(data)?)?),
                (set::SENSOR, SENSOR_RATE) => sample.rates_radps = Some(super::rates(three(data)?)?),
                (set::SENSOR, SENSOR_EULER) => sample.euler_rad = Some(super::euler(three(data)?)?),
                (set::FILTER, FILTER_EULER) => {
                    let (angles, valid) = data.split_last_chunk().ok_or(Error::Length)?;
                    if u16::from_be_bytes(*valid) != 1 {
                        return Err(Error::Invalid);
                    }
                    sample.euler_rad = Some(super::euler(three(angles)?)?);
                }
                (set::SENSOR | set::FILTER, REFERENCE_TIME_NS) => {
                    let ns = u64::from_be_bytes(data.try_into().map_err(|_| Error::Length)?);
                    sample.timer_us = Some(ns / 1_000);
                }
                _ => {}
            }
        }
        let AhrsSample { euler_rad, rates_radps, specific_force_mps2, .. } = sample;
        let some = euler_rad.or(rates_radps).or(specific_force_mps2).is_some();
        Ok(some.then_some(sample))
    }

    /// The first answer to a command.
    pub fn answer(&self) -> Option<Answer> {
        self.fields().flatten().find_map(|field| match (field.descriptor, field.data) {
            (ANSWER, [command, code]) => Some(Answer { command: *command, code: *code }),
            _ => None,
        })
    }
}

/// Three values, exactly.
fn three(data: &[u8]) -> Result<[f64; 3], Error> {
    if data.len() != 12 {
        return Err(Error::Length);
    }
    let float = |offset| Ok::<_, Error>(f64::from(f32::from_be_bytes(at(data, offset)?)));
    Ok([float(0)?, float(4)?, float(8)?])
}

/// Fletcher's two bytes, over everything before them.
fn fletcher(covered: &[u8]) -> [u8; 2] {
    let (first, second) = covered.iter().fold((0_u8, 0_u8), |(first, second), byte| {
        let first = first.wrapping_add(*byte);
        (first, second.wrapping_add(first))
    });
    [first, second]
}

fn examine(bytes: &[u8]) -> Verdict<()> {
    if !bytes.iter().zip(SYNC).all(|(byte, sync)| *byte == sync) {
        return Verdict::Noise;
    }
    let Some(length) = bytes.get(3) else { return Verdict::Incomplete };
    let covered = HEADER + usize::from(*length);
    let (Some(packet), Ok(printed)) = (bytes.get(..covered), at(bytes, covered)) else { return Verdict::Incomplete };
    if fletcher(packet) == printed { Verdict::Frame(covered + CHECKSUM, ()) } else { Verdict::Reject(Error::Checksum) }
}

/// Writes a packet of fields.
///
/// # Errors
/// [`Error::BufferFull`], [`Error::Length`] beyond 255 bytes.
pub fn emit<'b>(set: u8, fields: &[Field<'_>], buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
    let payload: usize = fields.iter().map(|field| field.data.len() + 2).sum();
    let mut writer = Writer::new(buffer);
    writer.bytes(&SYNC)?;
    writer.bytes(&[set, u8::try_from(payload).map_err(|_| Error::Length)?])?;
    for field in fields {
        writer.bytes(&[(field.data.len() + 2) as u8, field.descriptor])?;
        writer.bytes(field.data)?;
    }
    let checksum = fletcher(writer.written());
    writer.bytes(&checksum)?;
    Ok(writer.finish())
}

/// Writes a sensor data packet (set 80): timer, specific force, rates and attitude (complementary filter), absent ones
/// as 0.
///
/// # Errors
/// [`Error::BufferFull`].
pub fn emit_sample<'b>(sample: &AhrsSample, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
    let ns = sample.timer_us.unwrap_or(0).wrapping_mul(1_000).to_be_bytes();
    let accel = bytes_of(sample.specific_force_mps2.unwrap_or_default().map(|force| force / G_MPS2));
    let rates = bytes_of(sample.rates_radps.unwrap_or_default());
    let euler = bytes_of(sample.euler_rad.unwrap_or_default());
    let fields = [
        Field { descriptor: REFERENCE_TIME_NS, data: &ns },
        Field { descriptor: SENSOR_ACCEL, data: accel.as_flattened() },
        Field { descriptor: SENSOR_RATE, data: rates.as_flattened() },
        Field { descriptor: SENSOR_EULER, data: euler.as_flattened() },
    ];
    emit(set::SENSOR, &fields, buffer)
}

fn bytes_of(values: [f64; 3]) -> [[u8; 4]; 3] {
    values.map(|value| (value as f32).to_be_bytes())
}

/// Writes the command (0C/08) that makes sensor packets of specific force, rates and attitude, at the base rate /
/// `decimation`.
///
/// # Errors
/// [`Error::BufferFull`].
pub fn emit_format(decimation: u16, buffer: &mut [u8]) -> Result<&[u8], Error> {
    let [high, low] = decimation.to_be_bytes();
    let data = [APPLY, 3, SENSOR_ACCEL, high, low, SENSOR_RATE, high, low, SENSOR_EULER, high, low];
    emit(set::THREE_DM, &[Field { descriptor: COMMAND_IMU_FORMAT, data: &data }], buffer)
}

/// Writes the command (0C/11) that switches the sensor data stream.
///
/// # Errors
/// [`Error::BufferFull`].
pub fn emit_stream(on: bool, buffer: &mut [u8]) -> Result<&[u8], Error> {
    let data = [APPLY, STREAM_IMU, u8::from(on)];
    emit(set::THREE_DM, &[Field { descriptor: COMMAND_STREAM, data: &data }], buffer)
}

/// Writes the answer to a command of set `set`.
///
/// # Errors
/// [`Error::BufferFull`].
pub fn emit_answer(set: u8, answer: Answer, buffer: &mut [u8]) -> Result<&[u8], Error> {
    emit(set, &[Field { descriptor: ANSWER, data: &[answer.command, answer.code] }], buffer)
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
        Some(self.window.feed(bytes, examine)?.and_then(|()| Packet::view(self.window.frame())))
    }

    /// Packets accepted, and the rejections by cause.
    pub const fn counts(&self) -> &Counts {
        &self.window.counts
    }
}
