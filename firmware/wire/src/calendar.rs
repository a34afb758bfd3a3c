//! Dates and times of day as the sentences write them, and seconds since 1970.

use crate::write::Writer;
use crate::{Decimal, Error};

/// Microseconds of a day.
pub const DAY_US: u64 = 86_400_000_000;

/// Julian day of 1970-01-01.
const EPOCH_JULIAN_DAY: i64 = 2_440_588;

/// A time of day, UTC, µs since midnight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TimeOfDay {
    us: u64,
}

impl TimeOfDay {
    /// `us` after midnight, of any day.
    pub const fn from_us(us: u64) -> Self {
        Self { us: us % DAY_US }
    }

    /// µs since midnight, below [`DAY_US`].
    pub const fn us(self) -> u64 {
        self.us
    }

    /// Reads `hhmmss[.ffffff]`; digits beyond the microsecond are dropped.
    ///
    /// # Errors
    /// [`Error::Missing`], [`Error::Malformed`], [`Error::OutOfRange`] (a leap second is one).
    pub fn parse(text: &[u8]) -> Result<Self, Error> {
        if text.is_empty() {
            return Err(Error::Missing);
        }
        let (whole, fraction) = text.split_at_checked(6).ok_or(Error::Malformed)?;
        let us = match fraction {
            [] => 0,
            [b'.', digit, ..] if digit.is_ascii_digit() => {
                Decimal::parse(fraction)?.rescaled(6).ok_or(Error::OutOfRange)?
            }
            _ => return Err(Error::Malformed),
        };
        let [h1, h2, m1, m2, s1, s2] = whole else { return Err(Error::Malformed) };
        let (hour, minute, second) = (two(*h1, *h2)?, two(*m1, *m2)?, two(*s1, *s2)?);
        Self::from_parts(hour, minute, second, us as u64)
    }

    pub(crate) fn from_parts(hour: u64, minute: u64, second: u64, us: u64) -> Result<Self, Error> {
        if hour > 23 || minute > 59 || second > 59 || us >= 1_000_000 {
            return Err(Error::OutOfRange);
        }
        Ok(Self { us: (hour * 3_600 + minute * 60 + second) * 1_000_000 + us })
    }

    /// Hour, minute, second, µs.
    pub const fn parts(self) -> (u8, u8, u8, u32) {
        let s = self.us / 1_000_000;
        ((s / 3_600) as u8, (s / 60 % 60) as u8, (s % 60) as u8, (self.us % 1_000_000) as u32)
    }

    /// To the nearest 100 µs, the resolution of the older sentences.
    pub(crate) const fn to_tenth_ms(self) -> Self {
        Self::from_us((self.us + 50) / 100 * 100)
    }

    /// Writes `hhmmss`, then `decimals` (up to 6) digits of the second, truncated.
    pub(crate) fn write(self, writer: &mut Writer<'_>, decimals: u8) -> Result<(), Error> {
        let (hour, minute, second, _) = self.parts();
        for part in [hour, minute, second] {
            writer.unsigned(u64::from(part), 2)?;
        }
        self.write_fraction(writer, decimals)
    }

    pub(crate) fn write_fraction(self, writer: &mut Writer<'_>, decimals: u8) -> Result<(), Error> {
        if decimals == 0 {
            return Ok(());
        }
        let decimals = decimals.min(6);
        let fraction = Decimal::new((self.us % 1_000_000) as i64, 6).rescaled(decimals).unwrap_or(0);
        writer.byte(b'.')?;
        writer.unsigned(fraction.unsigned_abs(), usize::from(decimals))
    }

    /// The instant nearest to `reference_us` (since 1970) that has this time of day.
    pub fn nearest(self, reference_us: u64) -> u64 {
        let midnight = reference_us - reference_us % DAY_US;
        let today = midnight.saturating_add(self.us);
        if today.saturating_add(DAY_US / 2) < reference_us {
            today.saturating_add(DAY_US)
        } else if today > reference_us.saturating_add(DAY_US / 2) {
            today.saturating_sub(DAY_US)
        } else {
            today
        }
    }
}

/// A date of the years 1970 to 2399.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Date {
    year: u16,
    month: u8,
    day: u8,
}

impl Date {
    /// A day that exists.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] when it does not.
    pub fn new(year: u16, month: u8, day: u8) -> Result<Self, Error> {
        let date = Self { year, month, day };
        if (1970..=2399).contains(&year) {
            date.civil().map(|_| date).ok_or(Error::OutOfRange)
        } else {
            Err(Error::OutOfRange)
        }
    }

    fn civil(self) -> Option<time::Date> {
        time::Date::from_calendar_date(i32::from(self.year), self.month.try_into().ok()?, self.day).ok()
    }

    /// Year, month, day.
    pub const fn parts(self) -> (u16, u8, u8) {
        (self.year, self.month, self.day)
    }

    /// Days since 1970-01-01.
    pub fn days(self) -> u64 {
        self.civil().map_or(0, |date| i64::from(date.to_julian_day()).abs_diff(EPOCH_JULIAN_DAY))
    }

    /// The day that is `days` after 1970-01-01.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] after 2399.
    pub fn from_days(days: u64) -> Result<Self, Error> {
        let julian = i32::try_from(days.saturating_add(EPOCH_JULIAN_DAY.unsigned_abs())).ok();
        let date = julian.and_then(|day| time::Date::from_julian_day(day).ok()).ok_or(Error::OutOfRange)?;
        Self::new(u16::try_from(date.year()).map_err(|_| Error::OutOfRange)?, date.month().into(), date.day())
    }
}

/// Date and time of day, UTC.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DateTime {
    /// The day.
    pub date: Date,
    /// The time in it.
    pub time: TimeOfDay,
}

impl DateTime {
    /// µs since 1970, UTC without leap seconds.
    pub fn unix_us(self) -> u64 {
        self.date.days() * DAY_US + self.time.us()
    }

    /// From µs since 1970.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] after 2399.
    pub fn from_unix_us(us: u64) -> Result<Self, Error> {
        match Date::from_days(us / DAY_US) {
            Ok(date) => Ok(Self { date, time: TimeOfDay::from_us(us) }),
            Err(cause) => Err(cause),
        }
    }

    /// Reads `yyyymmddhhmmss[.ffffff]`.
    pub(crate) fn parse_compact(text: &[u8]) -> Result<Self, Error> {
        let (date, time) = text.split_at_checked(8).ok_or(Error::Malformed)?;
        Ok(Self { date: parse_date(date)?, time: TimeOfDay::parse(time)? })
    }

    pub(crate) fn write_compact(self, writer: &mut Writer<'_>, decimals: u8) -> Result<(), Error> {
        write_date(self.date, writer)?;
        self.time.write(writer, decimals)
    }

    /// Reads `yyyy-mm-ddThh:mm:ss[.ffffff][Z]`.
    pub(crate) fn parse_iso(text: &[u8]) -> Result<Self, Error> {
        let text = text.strip_suffix(b"Z").unwrap_or(text);
        let (whole, fraction) = text.split_at_checked(19).ok_or(Error::Malformed)?;
        let [y1, y2, y3, y4, b'-', m1, m2, b'-', d1, d2, b'T', h1, h2, b':', n1, n2, b':', s1, s2] = whole else {
            return Err(Error::Malformed);
        };
        let date = parse_date(&[*y1, *y2, *y3, *y4, *m1, *m2, *d1, *d2])?;
        let TimeOfDay { us: whole_us } = TimeOfDay::parse(&[*h1, *h2, *n1, *n2, *s1, *s2])?;
        let us = match fraction {
            [] => 0,
            [b'.', digit, ..] if digit.is_ascii_digit() => {
                Decimal::parse(fraction)?.rescaled(6).ok_or(Error::OutOfRange)?
            }
            _ => return Err(Error::Malformed),
        };
        Ok(Self { date, time: TimeOfDay { us: whole_us + us as u64 } })
    }

    pub(crate) fn write_iso(self, writer: &mut Writer<'_>, decimals: u8) -> Result<(), Error> {
        let (year, month, day) = self.date.parts();
        let (hour, minute, second, _) = self.time.parts();
        writer.unsigned(u64::from(year), 4)?;
        for (separator, part) in [(b'-', month), (b'-', day), (b'T', hour), (b':', minute), (b':', second)] {
            writer.byte(separator)?;
            writer.unsigned(u64::from(part), 2)?;
        }
        self.time.write_fraction(writer, decimals)
    }
}

/// Reads `yyyymmdd`.
pub(crate) fn parse_date(text: &[u8]) -> Result<Date, Error> {
    let [y1, y2, y3, y4, m1, m2, d1, d2] = text else { return Err(Error::Malformed) };
    let year = two(*y1, *y2)? * 100 + two(*y3, *y4)?;
    Date::new(year as u16, two(*m1, *m2)? as u8, two(*d1, *d2)? as u8)
}

pub(crate) fn write_date(date: Date, writer: &mut Writer<'_>) -> Result<(), Error> {
    let (year, month, day) = date.parts();
    writer.unsigned(u64::from(year), 4)?;
    writer.unsigned(u64::from(month), 2)?;
    writer.unsigned(u64::from(day), 2)
}

/// The number of two digits.
pub(crate) fn two(tens: u8, ones: u8) -> Result<u64, Error> {
    if tens.is_ascii_digit() && ones.is_ascii_digit() {
        Ok(u64::from(tens - b'0') * 10 + u64::from(ones - b'0'))
    } else {
        Err(Error::Malformed)
    }
}
