//! Teledyne PD6: sets of text lines, without checksum, so that every field is checked for its range and every line for
//! its number of fields. Prefer PD0 or PD4 on a noisy link.

use super::{Coordinates, DvlSample, INVALID, error_mps, to_mmps, velocity_mps};
use crate::calendar::{DAY_US, TimeOfDay};
use crate::framer::LineBuffer;
use crate::nmea::{parse_integer, within};
use crate::units::{degrees, radians};
use crate::write::Writer;
use crate::{Counts, Decimal, Error};

/// Longest line taken.
pub const MAX_LINE: usize = 128;
/// A buffer of this size holds any set emitted.
pub const MAX_SET: usize = 512;

/// No vehicle moves faster, mm/s.
const MAX_MMPS: i32 = 20_000;
/// Nor is any bottom further away, m.
const MAX_RANGE_M: f64 = 12_000.0;

/// Finds lines in a byte stream and gathers them into samples.
pub struct Decoder {
    line: LineBuffer<MAX_LINE>,
    set: Set,
    counts: Counts,
}

/// What the lines of the present set gave.
struct Set {
    mounting_rad: f64,
    sample: DvlSample,
    /// A velocity line has come.
    begun: bool,
    /// It was in instrument axes, which go before ship axes.
    instrument: bool,
}

impl Decoder {
    /// An empty decoder; `mounting_rad` as in [`Coordinates::to_body`], applied to `:BI` and `:WI`. Without those,
    /// `:BS` and `:WS` are taken as they are.
    pub const fn new(mounting_rad: f64) -> Self {
        Self { line: LineBuffer::new(), set: Set::new(mounting_rad), counts: Counts::new() }
    }

    /// Consumes bytes up to the end of the next set or a line refused; `None` when all were consumed.
    ///
    /// A set ends with `:BD`, or, where the instrument sends none, with the `:SA` of the next.
    pub fn feed(&mut self, bytes: &mut &[u8]) -> Option<Result<DvlSample, Error>> {
        loop {
            let (byte, rest) = bytes.split_first()?;
            *bytes = rest;
            let complete = match self.line.push(*byte, b':', &mut self.counts) {
                Ok(complete) => complete,
                Err(cause) => {
                    self.counts.note_error(cause);
                    return Some(Err(cause));
                }
            };
            if !complete {
                continue;
            }
            match self.set.take(self.line.text()) {
                Ok(sample) => {
                    self.counts.note_accepted();
                    if let Some(sample) = sample {
                        return Some(Ok(sample));
                    }
                }
                Err(cause) => {
                    self.counts.note_error(cause);
                    if cause != Error::Unhandled {
                        return Some(Err(cause));
                    }
                }
            }
        }
    }

    /// Lines accepted, and the ones refused by cause ([`Error::Unhandled`]: lines that add nothing).
    pub const fn counts(&self) -> &Counts {
        &self.counts
    }
}

impl Set {
    const fn new(mounting_rad: f64) -> Self {
        Self { mounting_rad, sample: EMPTY, begun: false, instrument: false }
    }

    /// Takes a line; gives the sample that it ends.
    fn take(&mut self, line: &[u8]) -> Result<Option<DvlSample>, Error> {
        let (id, fields) = line.split_at_checked(2).ok_or(Error::Unknown)?;
        match id {
            b"SA" => {
                let [pitch, roll, heading] = split(fields)?;
                let attitude =
                    [number(roll, 180.0)?, number(pitch, 90.0)?, within(number(heading, 360.0)?, 0.0, 360.0)?];
                let ended = self.begun.then(|| self.finish());
                self.sample.attitude_rad = Some(attitude.map(radians));
                Ok(ended)
            }
            b"TS" => self.take_time(split(fields)?).map(|()| None),
            b"BI" | b"WI" => {
                let mmps = instrument_velocity(split(fields)?)?;
                let body = velocity_mps(mmps).and_then(|xyz| Coordinates::Instrument.to_body(xyz, self.mounting_rad));
                if id == b"BI" {
                    (self.sample.bottom_mps, self.sample.error_mps) = (body, error_mps(mmps));
                } else {
                    self.sample.water_mps = body;
                }
                (self.begun, self.instrument, self.sample.frame) = (true, true, Coordinates::Instrument);
                Ok(None)
            }
            b"BS" | b"WS" => {
                let mmps = three_velocity(split(fields)?)?;
                if !self.instrument {
                    let body = velocity_mps(mmps).and_then(|xyz| Coordinates::Ship.to_body(xyz, 0.0));
                    if id == b"BS" {
                        self.sample.bottom_mps = body
                    } else {
                        self.sample.water_mps = body
                    }
                    (self.begun, self.sample.frame) = (true, Coordinates::Ship);
                }
                Ok(None)
            }
            b"BE" | b"WE" => three_velocity(split(fields)?).map(|_| None),
            b"BD" | b"WD" => {
                let [east, north, up, range, age] = split(fields)?;
                for distance in [east, north, up] {
                    number(distance, 1.0e7)?;
                }
                let range = within(number(range, MAX_RANGE_M)?, 0.0, MAX_RANGE_M)?;
                within(number(age, 1.0e6)?, 0.0, 1.0e6)?;
                if id == b"WD" {
                    return Ok(None);
                }
                self.sample.altitude_m = Some(range).filter(|range| *range > 0.0);
                Ok(Some(self.finish()))
            }
            b"HM" | b"RA" => Err(Error::Unhandled),
            _ => Err(Error::Unknown),
        }
    }

    fn take_time(&mut self, fields: [&[u8]; 6]) -> Result<(), Error> {
        let [time, salinity, temperature, depth, sound_speed, test] = fields;
        if time.len() != 14 || !time.iter().all(u8::is_ascii_digit) {
            return Err(Error::Malformed);
        }
        let (clock, hundredths) = time.get(6..).and_then(|time| time.split_at_checked(6)).ok_or(Error::Malformed)?;
        let clock_s = TimeOfDay::parse(clock)?.us() as f64 / 1.0e6;
        number(salinity, 100.0)?;
        number(temperature, 100.0)?;
        number(test, 65_535.0)?;
        let depth = number(depth, MAX_RANGE_M)?;
        let sound_speed = within(number(sound_speed, 2_000.0)?, 1_000.0, 2_000.0)?;
        self.sample.time_of_day_s = Some(clock_s + Decimal::parse(hundredths)?.to_f64() / 100.0);
        (self.sample.depth_m, self.sample.sound_speed_mps) = (Some(depth), Some(sound_speed));
        Ok(())
    }

    fn finish(&mut self) -> DvlSample {
        let sample = self.sample;
        *self = Self::new(self.mounting_rad);
        sample
    }
}

const EMPTY: DvlSample = DvlSample {
    bottom_mps: None,
    water_mps: None,
    altitude_m: None,
    error_mps: None,
    attitude_rad: None,
    depth_m: None,
    sound_speed_mps: None,
    time_of_day_s: None,
    frame: Coordinates::Instrument,
};

/// Exactly `N` fields behind commas, without their blanks.
fn split<const N: usize>(fields: &[u8]) -> Result<[&[u8]; N], Error> {
    let mut parts = fields.strip_prefix(b",").ok_or(Error::Length)?.split(|byte| *byte == b',');
    let mut split: [&[u8]; N] = [&[]; N];
    for slot in &mut split {
        *slot = parts.next().ok_or(Error::Length)?.trim_ascii();
    }
    if parts.next().is_some() { Err(Error::Length) } else { Ok(split) }
}

fn number(field: &[u8], limit: f64) -> Result<f64, Error> {
    within(Decimal::parse(field)?.to_f64(), -limit, limit)
}

fn mmps(field: &[u8]) -> Result<i16, Error> {
    let value: i32 = parse_integer(field)?;
    if value != i32::from(INVALID) && value.abs() > MAX_MMPS {
        return Err(Error::OutOfRange);
    }
    i16::try_from(value).map_err(|_| Error::OutOfRange)
}

/// `A` is good; `V` and, in one emulator, `I` are bad.
fn status(field: &[u8]) -> Result<bool, Error> {
    match field {
        b"A" => Ok(true),
        b"V" | b"I" => Ok(false),
        [] => Err(Error::Missing),
        _ => Err(Error::Malformed),
    }
}

fn instrument_velocity(fields: [&[u8]; 5]) -> Result<[i16; 4], Error> {
    let [x, y, z, error, good] = fields;
    let velocity = [mmps(x)?, mmps(y)?, mmps(z)?, mmps(error)?];
    Ok(if status(good)? { velocity } else { [INVALID; 4] })
}

fn three_velocity(fields: [&[u8]; 4]) -> Result<[i16; 4], Error> {
    let [x, y, z, good] = fields;
    let velocity = [mmps(x)?, mmps(y)?, mmps(z)?, INVALID];
    Ok(if status(good)? { velocity } else { [INVALID; 4] })
}

/// Writes the set of an instrument that measured `sample`, in instrument axes: `:SA :TS :WI :BI :BD`.
///
/// # Errors
/// [`Error::BufferFull`], [`Error::OutOfRange`].
pub fn emit<'b>(sample: &DvlSample, mounting_rad: f64, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
    let mut writer = Writer::new(buffer);
    let [roll, pitch, heading] = sample.attitude_rad.unwrap_or_default().map(degrees);
    let heading = Decimal::from_f64(heading, 2)?.mantissa().rem_euclid(36_000);
    writer.bytes(b":SA,")?;
    signed(&mut writer, Decimal::from_f64(pitch, 2)?)?;
    writer.byte(b',')?;
    signed(&mut writer, Decimal::from_f64(roll, 2)?)?;
    writer.byte(b',')?;
    writer.decimal(Decimal::new(heading, 2))?;
    writer.bytes(b"\r\n:TS,260101")?;
    let us = libm::round(sample.time_of_day_s.unwrap_or(0.0) * 100.0) as u64 % (DAY_US / 10_000) * 10_000;
    let (hour, minute, second, us) = TimeOfDay::from_us(us).parts();
    for part in [u32::from(hour), u32::from(minute), u32::from(second), us / 10_000] {
        writer.unsigned(u64::from(part), 2)?;
    }
    writer.bytes(b",35.0,+15.0,")?;
    writer.decimal(Decimal::from_f64(sample.depth_m.unwrap_or(0.0), 1)?)?;
    writer.byte(b',')?;
    writer.decimal(Decimal::from_f64(sample.sound_speed_mps.unwrap_or(1_500.0), 1)?)?;
    writer.bytes(b",0\r\n")?;
    for (id, body, error) in [("WI", sample.water_mps, None), ("BI", sample.bottom_mps, sample.error_mps)] {
        let xyz = body.and_then(|body| Coordinates::Instrument.from_body(body, mounting_rad));
        let [x, y, z] = xyz.map_or([INVALID; 3], |xyz| xyz.map(to_mmps));
        writer.byte(b':')?;
        writer.bytes(id.as_bytes())?;
        for component in [x, y, z, if xyz.is_some() { error.map_or(INVALID, to_mmps) } else { INVALID }] {
            writer.byte(b',')?;
            signed(&mut writer, Decimal::new(i64::from(component), 0))?;
        }
        writer.bytes(if xyz.is_some() { b",A\r\n" } else { b",V\r\n" })?;
    }
    writer.bytes(b":BD,+0.00,+0.00,+0.00,")?;
    writer.decimal(Decimal::from_f64(sample.altitude_m.unwrap_or(0.0), 2)?)?;
    writer.bytes(b",0.00\r\n")?;
    Ok(writer.finish())
}

fn signed(writer: &mut Writer<'_>, value: Decimal) -> Result<(), Error> {
    if value.mantissa() >= 0 {
        writer.byte(b'+')?;
    }
    writer.decimal(value)
}
