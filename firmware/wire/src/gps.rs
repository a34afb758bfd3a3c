//! `$GPRMC`, `$GPGGA`, `$GPGST` and `$HEHDT`, of any talker.

use crate::calendar::{Date, DateTime, TimeOfDay, two};
use crate::nmea::{Emitter, Fields, Sentence, within};
use crate::units::{KNOT_MPS, degrees, radians};
use crate::{Decimal, Error};
use core::num::NonZeroU64;

/// Recommended minimum: position, velocity and the only sentence with a date.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rmc {
    /// UTC of the fix.
    pub utc: Option<DateTime>,
    /// Status A.
    pub valid: bool,
    /// Latitude and longitude, WGS84, degrees, north and east positive.
    pub position_deg: Option<[f64; 2]>,
    /// Speed over ground, m/s.
    pub speed_mps: Option<f64>,
    /// Course over ground, true, rad.
    pub course_rad: Option<f64>,
    /// Magnetic variation, rad, east positive; `None` also where the sentence gives no direction.
    pub variation_rad: Option<f64>,
}

/// Fix data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gga {
    /// UTC time of day of the fix.
    pub time: Option<TimeOfDay>,
    /// Latitude and longitude, WGS84, degrees, north and east positive.
    pub position_deg: Option<[f64; 2]>,
    /// 0 no fix, 1 GPS, 2 differential, 4 and 5 RTK.
    pub quality: u8,
    /// Satellites used.
    pub satellites: u8,
    /// Horizontal dilution of precision.
    pub hdop: Option<f64>,
    /// Antenna above mean sea level, m.
    pub altitude_m: Option<f64>,
    /// Geoid above the ellipsoid, m.
    pub geoid_m: Option<f64>,
}

/// Pseudorange error statistics: how good the receiver believes its position to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gst {
    /// UTC time of day of the fix.
    pub time: Option<TimeOfDay>,
    /// One sigma of the latitude and of the longitude, m; `None` without a fix.
    pub sigma_m: Option<[f64; 2]>,
}

/// True heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hdt {
    /// Clockwise from true north, rad; `None` while the compass has none.
    pub heading_rad: Option<f64>,
}

impl Rmc {
    /// Reads the sentence.
    ///
    /// # Errors
    /// [`Error::Unknown`] for another sentence; [`Error::Missing`], [`Error::Malformed`], [`Error::OutOfRange`] by
    /// field.
    pub fn parse(sentence: &Sentence<'_>) -> Result<Self, Error> {
        if !is_talker(sentence, b"RMC") {
            return Err(Error::Unknown);
        }
        let mut fields = sentence.fields();
        let time = fields.optional(TimeOfDay::parse)?;
        let valid = match fields.raw() {
            b"A" => true,
            b"V" => false,
            [] => return Err(Error::Missing),
            _ => return Err(Error::Malformed),
        };
        let position_deg = position(&mut fields)?;
        let speed_mps = match fields.optional_number()? {
            Some(knots) => Some(within(knots, 0.0, 2_000.0)? * KNOT_MPS),
            None => None,
        };
        let course_rad = match fields.optional_number()? {
            Some(course) => Some(radians(within(course, 0.0, 360.0)?)),
            None => None,
        };
        let date = fields.optional(parse_date)?;
        let variation = fields.optional_number()?;
        let variation_rad = match (variation, fields.raw()) {
            (Some(angle), b"E") => Some(radians(within(angle, 0.0, 180.0)?)),
            (Some(angle), b"W") => Some(-radians(within(angle, 0.0, 180.0)?)),
            (_, []) => None,
            _ => return Err(Error::Malformed),
        };
        let utc = date.zip(time).map(|(date, time)| DateTime { date, time });
        if valid && (utc.is_none() || position_deg.is_none()) {
            return Err(Error::Missing);
        }
        Ok(Self { utc, valid, position_deg, speed_mps, course_rad, variation_rad })
    }

    /// Writes `$GPRMC` with its line end.
    ///
    /// # Errors
    /// [`Error::BufferFull`], [`Error::OutOfRange`].
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let mut emitter = Emitter::new(buffer, "GPRMC")?;
        write_time(&mut emitter, self.utc.map(|utc| utc.time))?;
        emitter.text(if self.valid { "A" } else { "V" })?;
        write_position(&mut emitter, self.position_deg)?;
        match self.speed_mps {
            Some(speed) => emitter.field(|writer| writer.decimal_padded(Decimal::from_f64(speed / KNOT_MPS, 2)?, 3))?,
            None => emitter.blank()?,
        };
        write_angle(&mut emitter, self.course_rad)?;
        match self.utc {
            Some(utc) => emitter.field(|writer| {
                let (year, month, day) = utc.date.parts();
                [u64::from(day), u64::from(month), u64::from(year % 100)]
                    .into_iter()
                    .try_for_each(|part| writer.unsigned(part, 2))
            })?,
            None => emitter.blank()?,
        };
        write_angle(&mut emitter, self.variation_rad.map(libm::fabs))?;
        emitter.text(match self.variation_rad {
            None => "",
            Some(angle) if Decimal::from_f64(degrees(angle), 1)?.mantissa() < 0 => "W",
            Some(_) => "E",
        })?;
        emitter.text(if self.valid { "A" } else { "N" })?;
        emitter.finish()
    }
}

impl Gga {
    /// Reads the sentence.
    ///
    /// # Errors
    /// [`Error::Unknown`] for another sentence; [`Error::Missing`], [`Error::Malformed`], [`Error::OutOfRange`] by
    /// field.
    pub fn parse(sentence: &Sentence<'_>) -> Result<Self, Error> {
        if !is_talker(sentence, b"GGA") {
            return Err(Error::Unknown);
        }
        let mut fields = sentence.fields();
        let time = fields.optional(TimeOfDay::parse)?;
        let position_deg = position(&mut fields)?;
        let quality = fields.integer()?;
        let satellites = fields.optional(crate::nmea::parse_integer)?.unwrap_or(0);
        let hdop = fields.optional_number()?;
        let altitude_m = length_m(&mut fields)?;
        let geoid_m = length_m(&mut fields)?;
        if quality > 0 && (time.is_none() || position_deg.is_none()) {
            return Err(Error::Missing);
        }
        Ok(Self { time, position_deg, quality, satellites, hdop, altitude_m, geoid_m })
    }

    /// Writes `$GPGGA` with its line end.
    ///
    /// # Errors
    /// [`Error::BufferFull`], [`Error::OutOfRange`].
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let mut emitter = Emitter::new(buffer, "GPGGA")?;
        write_time(&mut emitter, self.time)?;
        write_position(&mut emitter, self.position_deg)?;
        emitter.unsigned(self.quality)?.padded(self.satellites, 2)?;
        emitter.optional_number(self.hdop, 2)?;
        emitter.optional_number(self.altitude_m, 3)?.text("M")?;
        emitter.optional_number(self.geoid_m, 3)?.text("M")?;
        emitter.blank()?.blank()?;
        emitter.finish()
    }
}

impl Gst {
    /// Reads the sentence.
    ///
    /// # Errors
    /// [`Error::Unknown`] for another sentence; [`Error::Missing`], [`Error::Malformed`], [`Error::OutOfRange`] by
    /// field.
    pub fn parse(sentence: &Sentence<'_>) -> Result<Self, Error> {
        if !is_talker(sentence, b"GST") {
            return Err(Error::Unknown);
        }
        let mut fields = sentence.fields();
        let time = fields.optional(TimeOfDay::parse)?;
        // RMS of the residuals, and the error ellipse's two axes and direction
        for _ in 0..4 {
            fields.raw();
        }
        let mut sigma_m = || match fields.optional_number()? {
            Some(sigma_m) => within(sigma_m, 0.0, 1.0e6).map(Some),
            None => Ok(None),
        };
        let (latitude, longitude) = (sigma_m()?, sigma_m()?);
        Ok(Self { time, sigma_m: latitude.zip(longitude).map(|(latitude, longitude)| [latitude, longitude]) })
    }

    /// Writes `$GPGST` with its line end.
    ///
    /// # Errors
    /// [`Error::BufferFull`], [`Error::OutOfRange`].
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let mut emitter = Emitter::new(buffer, "GPGST")?;
        write_time(&mut emitter, self.time)?;
        emitter.blank()?.blank()?.blank()?.blank()?;
        for sigma_m in self.sigma_m.map_or([None; 2], |sigma_m| sigma_m.map(Some)) {
            emitter.optional_number(sigma_m, 3)?;
        }
        emitter.blank()?;
        emitter.finish()
    }
}

impl Hdt {
    /// Reads the sentence.
    ///
    /// # Errors
    /// [`Error::Unknown`] for another sentence; [`Error::Malformed`], [`Error::OutOfRange`] by field.
    pub fn parse(sentence: &Sentence<'_>) -> Result<Self, Error> {
        if !is_talker(sentence, b"HDT") {
            return Err(Error::Unknown);
        }
        let heading_rad = match sentence.fields().optional_number()? {
            Some(heading) => Some(radians(within(heading, 0.0, 360.0)?)),
            None => None,
        };
        Ok(Self { heading_rad })
    }

    /// Writes `$HEHDT` with its line end.
    ///
    /// # Errors
    /// [`Error::BufferFull`], [`Error::OutOfRange`].
    pub fn emit<'b>(&self, buffer: &'b mut [u8]) -> Result<&'b [u8], Error> {
        let mut emitter = Emitter::new(buffer, "HEHDT")?;
        emitter.optional_number(self.heading_rad.map(degrees), 2)?.text("T")?;
        emitter.finish()
    }
}

/// Digits after the point of a minute: 2 mm.
const MINUTE_SCALE: u8 = 6;
const MINUTE_UNIT: u64 = 1_000_000;
const HUNDRED: NonZeroU64 = NonZeroU64::MIN.saturating_add(99);

fn is_talker(sentence: &Sentence<'_>, kind: &[u8; 3]) -> bool {
    matches!(sentence.id(), [b'A'..=b'Z', b'A'..=b'Z', rest @ ..] if rest == kind)
}

/// `ddmm.mmmm,N,dddmm.mmmm,E`, or four blanks.
fn position(fields: &mut Fields<'_>) -> Result<Option<[f64; 2]>, Error> {
    let mut coordinate = |digits: usize, limit: u64, positive: &[u8], negative: &[u8]| {
        let (value, side) = (fields.raw(), fields.raw());
        match (value, side) {
            ([], []) => Ok(None),
            ([], _) | (_, []) => Err(Error::Missing),
            _ if side != positive && side != negative => Err(Error::Malformed),
            _ => degrees_minutes(value, digits, limit).map(|angle| Some(if side == negative { -angle } else { angle })),
        }
    };
    let latitude = coordinate(4, 90, b"N", b"S")?;
    let longitude = coordinate(5, 180, b"E", b"W")?;
    match (latitude, longitude) {
        (Some(latitude), Some(longitude)) => Ok(Some([latitude, longitude])),
        (None, None) => Ok(None),
        _ => Err(Error::Missing),
    }
}

/// Degrees of `[d]ddmm[.mmmm]` with `digits` before the point: one rounding.
fn degrees_minutes(text: &[u8], digits: usize, limit: u64) -> Result<f64, Error> {
    let whole = text.iter().position(|byte| *byte == b'.').unwrap_or(text.len());
    if whole != digits || !text.iter().all(|byte| byte.is_ascii_digit() || *byte == b'.') {
        return Err(Error::Malformed);
    }
    let value = Decimal::parse(text)?;
    // The products below stay exact in 64 bits.
    if value.scale() > 10 {
        return Err(Error::OutOfRange);
    }
    let (unit, mantissa) = (value.unit(), value.mantissa().unsigned_abs());
    let hundred = unit.saturating_mul(HUNDRED);
    let (whole_degrees, minutes) = (mantissa / hundred, mantissa % hundred);
    let degree = 60 * unit.get();
    if minutes >= degree || whole_degrees > limit || (whole_degrees == limit && minutes > 0) {
        return Err(Error::OutOfRange);
    }
    Ok((whole_degrees * degree + minutes) as f64 / degree as f64)
}

fn parse_date(text: &[u8]) -> Result<Date, Error> {
    let [d1, d2, m1, m2, y1, y2] = text else { return Err(Error::Malformed) };
    Date::new(2000 + two(*y1, *y2)? as u16, two(*m1, *m2)? as u8, two(*d1, *d2)? as u8)
}

fn length_m(fields: &mut Fields<'_>) -> Result<Option<f64>, Error> {
    let length = fields.optional_number()?;
    match fields.raw() {
        [] | b"M" => Ok(length),
        _ => Err(Error::Malformed),
    }
}

fn write_time(emitter: &mut Emitter<'_>, time: Option<TimeOfDay>) -> Result<(), Error> {
    match time {
        Some(time) => emitter.field(|writer| time.write(writer, 2))?,
        None => emitter.blank()?,
    };
    Ok(())
}

fn write_angle(emitter: &mut Emitter<'_>, angle_rad: Option<f64>) -> Result<(), Error> {
    match angle_rad {
        Some(angle) => emitter.field(|writer| writer.decimal_padded(Decimal::from_f64(degrees(angle), 1)?, 3))?,
        None => emitter.blank()?,
    };
    Ok(())
}

fn write_position(emitter: &mut Emitter<'_>, position_deg: Option<[f64; 2]>) -> Result<(), Error> {
    let Some([latitude, longitude]) = position_deg else {
        emitter.blank()?.blank()?.blank()?.blank()?;
        return Ok(());
    };
    for (angle, limit, width, sides) in [(latitude, 90.0, 2, ["N", "S"]), (longitude, 180.0, 3, ["E", "W"])] {
        let minutes = libm::round(libm::fabs(within(angle, -limit, limit)?) * (60 * MINUTE_UNIT) as f64) as u64;
        emitter.field(|writer| {
            writer.unsigned(minutes / (60 * MINUTE_UNIT), width)?;
            writer.decimal_padded(Decimal::new((minutes % (60 * MINUTE_UNIT)) as i64, MINUTE_SCALE), 2)
        })?;
        let [positive, negative] = sides;
        emitter.text(if angle < 0.0 && minutes > 0 { negative } else { positive })?;
    }
    Ok(())
}
