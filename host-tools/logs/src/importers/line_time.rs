//! The time in front of a line of a log, and how far its clock is from UTC.

use super::calendar;
use backseat_wire::calendar::{DAY_US, TimeOfDay};

/// Seconds since 1970 from which on a number is such a time and no time since a start: 1973.
const LEAST_UNIX_S: f64 = 1e8;
/// Share of the differences below which the offset of a clock lies: sentences come after the time that they name, by
/// the least delay at best.
const LEAST_DELAY: f64 = 0.05;

/// The time in front of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum LineTime {
    /// µs since 1970 by the clock of the computer that wrote the line.
    Epoch(i64),
    /// µs since some start.
    Running(i64),
    /// There is none.
    None,
}

/// When a sentence says that it was.
#[derive(Clone, Copy)]
pub(super) enum Utc {
    Full(i64),
    OfDay(TimeOfDay),
    Unknown,
}

/// Reads `2026-11-20 12:00:06,120` (or with `T` and a point), seconds, ms, µs or ns since 1970, `12:00:06.120`, or
/// seconds since a start, wherever it stands in the text.
pub(super) fn parse(text: &str) -> LineTime {
    if let Some((days, rest)) = iso_date(text)
        && let Some(us) = clock_us(rest)
    {
        return LineTime::Epoch(days * DAY_US as i64 + us);
    }
    for word in text.split([' ', '\t', '[', ']', '(', ')', ';']).filter(|word| !word.is_empty()) {
        if let Some(us) = clock_us(word) {
            return LineTime::Running(us);
        }
        let Ok(number) = word.trim_end_matches(',').parse::<f64>() else { continue };
        let seconds = [1.0, 1e3, 1e6, 1e9].iter().map(|unit| number / unit).find(|seconds| *seconds < 1e10);
        match seconds.filter(|seconds| *seconds >= 0.0) {
            Some(seconds) if seconds >= LEAST_UNIX_S => return LineTime::Epoch((seconds * 1e6).round() as i64),
            Some(seconds) => return LineTime::Running((seconds * 1e6).round() as i64),
            None => {}
        }
    }
    LineTime::None
}

/// How a cell that holds a date and a time writes its date.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DateOrder {
    /// `2026-11-20`.
    YearMonthDay,
    /// `20/11/2026`, or with points or dashes.
    DayMonthYear,
    /// `11/20/2026`, or with points or dashes.
    MonthDayYear,
}

impl DateOrder {
    /// How such a cell looks.
    pub(super) const fn pattern(self) -> &'static str {
        match self {
            Self::YearMonthDay => "yyyy-mm-dd hh:mm:ss",
            Self::DayMonthYear => "dd/mm/yyyy hh:mm:ss",
            Self::MonthDayYear => "mm/dd/yyyy hh:mm:ss",
        }
    }

    /// µs since 1970 of such a cell; without a zone, which only [`DateOrder::YearMonthDay`] may have, it is UTC.
    pub(super) fn unix_us(self, text: &str) -> Option<i64> {
        if self == Self::YearMonthDay {
            return instant_us(text);
        }
        let (date, clock) = text.trim().split_once([' ', 'T'])?;
        let mut parts = date.split(['/', '.', '-']);
        let [first, second, year] = [parts.next()?, parts.next()?, parts.next()?];
        let (month, day) = if self == Self::DayMonthYear { (second, first) } else { (first, second) };
        let days = calendar::date_days(&format!("{month}/{day}/{year}")).filter(|_| parts.next().is_none())?;
        Some(days * DAY_US as i64 + calendar::time_us(&clock.replace(',', "."))?)
    }
}

/// Reads a cell that holds a date and a time, `2026-11-20 12:00:06.5`, or with `T`, and with `Z` or a zone behind it; without
/// one it is UTC: µs since 1970.
fn instant_us(text: &str) -> Option<i64> {
    let text = text.trim();
    let (days, clock) = iso_date(text).filter(|_| text.starts_with(|c: char| c.is_ascii_digit()))?;
    let end = clock.find(['Z', 'z', '+', '-']).unwrap_or(clock.len());
    let zone_us = match clock.get(end..)?.trim() {
        "" | "Z" | "z" => 0,
        zone => {
            let digits: String = zone.get(1..)?.chars().filter(|c| *c != ':').collect();
            let (hours, minutes) = (digits.get(..2)?.parse::<i64>().ok()?, digits.get(2..)?.parse().unwrap_or(0));
            (hours * 60 + minutes) * 60_000_000 * if zone.starts_with('-') { -1 } else { 1 }
        }
    };
    Some(days * DAY_US as i64 + clock_us(clock.get(..end)?.trim_end())? - zone_us)
}

/// Days since 1970 of the first `yyyy-mm-dd`, and what follows it.
fn iso_date(text: &str) -> Option<(i64, &str)> {
    (0..text.len().saturating_sub(9)).find_map(|at| {
        let date = text.get(at..at + 10)?;
        let [year, month, day] = [date.get(..4)?, date.get(5..7)?, date.get(8..)?];
        let is_date = date.as_bytes()[4] == b'-' && date.as_bytes()[7] == b'-';
        let days = calendar::date_days(&format!("{month}/{day}/{year}")).filter(|_| is_date)?;
        Some((days, text.get(at + 10..)?.trim_start_matches(['T', ' '])))
    })
}

/// µs since midnight of a leading `hh:mm:ss` with a point or a comma before the fraction.
fn clock_us(text: &str) -> Option<i64> {
    let end = text.find(|c: char| !(c.is_ascii_digit() || [':', '.', ','].contains(&c))).unwrap_or(text.len());
    calendar::time_us(&text.get(..end)?.trim_end_matches([',', '.', ':']).replace(',', "."))
}

/// The clock of the lines beside UTC.
pub(super) struct Clock {
    /// Clock of the lines minus UTC, µs, and from how many sentences.
    offset: Option<(i64, usize)>,
    /// The first time with a date, µs since 1970.
    pub first_full_us: Option<i64>,
    is_epoch: bool,
}

impl Clock {
    /// From the lines of sentences that come promptly after the time that they name.
    pub(super) fn of(pairs: impl Iterator<Item = (LineTime, Utc)>) -> Self {
        let (mut differences, mut first_full_us, mut last_us, mut is_epoch) = (Vec::new(), None, None, true);
        for (line, utc) in pairs {
            let utc_us = match (utc, line) {
                (Utc::Full(us), _) => us,
                (Utc::OfDay(time), LineTime::Epoch(line_us)) => nearest(time, line_us),
                (Utc::OfDay(time), _) => match last_us {
                    Some(last_us) => nearest(time, last_us),
                    None => continue,
                },
                (Utc::Unknown, _) => continue,
            };
            if matches!(utc, Utc::Full(_)) {
                first_full_us.get_or_insert(utc_us);
            }
            last_us = Some(utc_us);
            match line {
                LineTime::Epoch(us) => differences.push(us - utc_us),
                LineTime::Running(us) => {
                    is_epoch = false;
                    differences.push(us - utc_us);
                }
                LineTime::None => {}
            }
        }
        differences.sort_unstable();
        let place = (differences.len() as f64 * LEAST_DELAY) as usize;
        Self { offset: differences.get(place).map(|us| (*us, differences.len())), first_full_us, is_epoch }
    }

    /// The time of a line in UTC, as near as the clock is known; by its own clock if no sentence dates it.
    pub(super) fn utc_us(&self, line: LineTime) -> Option<i64> {
        match line {
            LineTime::Epoch(us) | LineTime::Running(us) => Some(us - self.offset.map_or(0, |(offset_us, _)| offset_us)),
            LineTime::None => None,
        }
    }

    /// The instant of a time of day, on the day of its line, or else of the sentence before.
    pub(super) fn nearest(&self, time: TimeOfDay, line: LineTime, last_us: Option<i64>) -> i64 {
        let reference_us = match line {
            LineTime::Epoch(_) => self.utc_us(line),
            _ => last_us.or(self.first_full_us),
        };
        nearest(time, reference_us.unwrap_or(time.us() as i64))
    }

    /// What a user should know of it.
    pub(super) fn note(&self) -> Option<String> {
        let (offset_us, count) = self.offset?;
        if !self.is_epoch {
            return Some(format!("the lines' own clock was set to UTC by {count} sentences"));
        }
        let seconds = offset_us as f64 * 1e-6;
        let way = if seconds >= 0.0 { "ahead of" } else { "behind" };
        Some(format!("the clock of the lines is {:.2} s {way} UTC by {count} sentences: moved", seconds.abs()))
    }
}

fn nearest(time: TimeOfDay, reference_us: i64) -> i64 {
    time.nearest(reference_us.max(0) as u64) as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_instants_in_cells() {
        const NOON: i64 = 1_795_176_000_000_000; // date -u -d '2026-11-20 12:00' +%s
        for text in [
            "2026-11-20 12:00:00",
            "2026-11-20T12:00:00Z",
            " 2026-11-20T14:00:00.000+02:00",
            "2026-11-20 06:30:00-0530",
            "2026-11-20T13:00:00+01",
        ] {
            assert_eq!(instant_us(text), Some(NOON), "{text}");
        }
        assert_eq!(instant_us("2026-11-20 12:00:00,25"), Some(NOON + 250_000));
        for text in ["2026-11-20", "20.11.2026 12:00:00", "t 2026-11-20 12:00:00", "2026-11-20 12:00:00 +x", "", "é"] {
            assert_eq!(instant_us(text), None, "{text}");
        }
    }

    #[test]
    fn times_in_front_of_lines() {
        const NOON: i64 = 1_795_176_000_000_000; // date -u -d '2026-11-20 12:00' +%s
        for (text, expected) in [
            ("2026-11-20 12:00:00,250 - INFO - ", LineTime::Epoch(NOON + 250_000)),
            ("[2026-11-20T12:00:00.5Z] RX ", LineTime::Epoch(NOON + 500_000)),
            ("1795176000.25 ", LineTime::Epoch(NOON + 250_000)),
            ("1795176000250, ", LineTime::Epoch(NOON + 250_000)),
            ("12:00:00.5 < ", LineTime::Running(43_200_500_000)),
            ("3.5\t", LineTime::Running(3_500_000)),
            ("RX: ", LineTime::None),
            ("", LineTime::None),
            ("2026-13-20 é ", LineTime::None),
        ] {
            assert_eq!(parse(text), expected, "{text}");
        }
    }
}
