//! A column of a table: its name in words, its unit, its values.

use super::names::{COMMAND, COUNTS, MAGNETIC, MISSING, NAMES, NONE, NOTHING, PRESSURE, unit_names};
use crate::importers::line_time::DateOrder;
use crate::log::units::{self, PASCALS};
use crate::log::{Column, table};
use std::f64::consts::PI;

/// A column of the table.
pub(super) struct Seen {
    pub name: String,
    /// Lower case, without a unit in brackets, words joined by `_`.
    pub plain: String,
    /// Its words, but for the unit and those that say nothing.
    words: Vec<String>,
    /// The unit that its name states, if any.
    pub unit: Option<&'static str>,
    /// What its name has in brackets, where that is no unit.
    pub in_brackets: Option<String>,
    pub numbers: usize,
    texts: usize,
    /// Its texts, each once, as long as they are few.
    words_in_cells: Vec<String>,
    /// Whether every text is a date and a time with the day first, and with the month first.
    reads_as: [bool; 2],
    pub min: f64,
    pub max: f64,
    pub first: Option<f64>,
    pub last: f64,
    /// Values beyond a quarter of a turn, and beyond a turn, if they are radians.
    beyond: [usize; 2],
    /// Largest difference of two values that follow each other.
    largest_step: f64,
    /// All values are whole numbers.
    is_whole: bool,
    pub sample: String,
    /// What stands where there is no sample, as other programs write it.
    missing: Vec<String>,
}

impl Seen {
    pub fn new(name: &str) -> Self {
        let name = name.trim().trim_matches('"').to_owned();
        let lower = name.to_lowercase();
        let (outside, inside) = match lower.find(['(', '[']) {
            Some(at) => (lower[..at].trim(), lower[at + 1..].trim_end_matches([')', ']', ' '])),
            None => (lower.as_str(), ""),
        };
        let plain = outside.replace([' ', '-', '/'], "_");
        let unit = |text: &str| unit_names().find(|(name, _)| *name == text).map(|(_, unit)| unit);
        // at the end of a name psi is a heading
        let in_brackets =
            unit(inside).or_else(|| PASCALS.iter().map(|(known, _)| *known).find(|known| *known == inside));
        // of one word, or of two, as in deg_s
        let tail = |words: usize| {
            let start = plain.rmatch_indices(['_', '.']).nth(words - 1).map(|(at, _)| at + 1);
            start.and_then(|start| Some((start, unit(&plain[start..])?)))
        };
        let ending = tail(2).or_else(|| tail(1));
        let stem = ending.map_or(plain.as_str(), |(start, _)| &plain[..start - 1]);
        let words = stem.split(['_', '.']).filter(|word| !word.is_empty() && !NOTHING.contains(word));
        Self {
            words: words.map(str::to_owned).collect(),
            unit: in_brackets.or(ending.map(|(_, unit)| unit)),
            in_brackets: (!inside.is_empty() && in_brackets.is_none()).then(|| inside.to_owned()),
            plain,
            name,
            numbers: 0,
            texts: 0,
            words_in_cells: Vec::new(),
            reads_as: [true; 2],
            min: f64::INFINITY,
            max: f64::NEG_INFINITY,
            first: None,
            last: f64::NAN,
            beyond: [0; 2],
            largest_step: 0.0,
            is_whole: true,
            sample: String::new(),
            missing: Vec::new(),
        }
    }

    pub fn add(&mut self, separator: u8, cell: &[u8]) {
        let text = String::from_utf8_lossy(cell);
        let text = text.trim();
        if text.is_empty() {
            return;
        }
        if MISSING.contains(&text.to_lowercase().as_str()) {
            if !self.missing.iter().any(|known| known == text) {
                self.missing.push(text.to_owned());
            }
            return;
        }
        if self.sample.is_empty() {
            self.sample = text.chars().take(24).collect();
        }
        match table::number_between(separator, text.as_bytes()).ok().filter(|value| value.is_finite()) {
            Some(value) => {
                self.numbers += 1;
                for (count, limit) in self.beyond.iter_mut().zip(BEYOND_RAD) {
                    *count += usize::from(value.abs() > limit);
                }
                if self.numbers > 1 {
                    self.largest_step = self.largest_step.max((value - self.last).abs());
                }
                (self.min, self.max, self.last) = (self.min.min(value), self.max.max(value), value);
                self.first = self.first.or(Some(value));
                self.is_whole &= value.fract() == 0.0;
            }
            None => {
                self.texts += 1;
                for (reads, order) in self.reads_as.iter_mut().zip(ORDERS) {
                    *reads = *reads && order.unix_us(text).is_some();
                }
                if self.words_in_cells.len() <= MOST_MARKS && !self.words_in_cells.iter().any(|known| known == text) {
                    self.words_in_cells.push(text.to_owned());
                }
            }
        }
    }

    /// What stands where there is no sample; a few words among numbers are taken for that, too.
    pub fn marks(&self) -> impl Iterator<Item = &String> {
        self.missing.iter().chain(self.guessed_marks())
    }

    /// Words among numbers.
    pub fn guessed_marks(&self) -> &[String] {
        let are_few = self.is_number() && self.words_in_cells.len() <= MOST_MARKS;
        if are_few { &self.words_in_cells } else { &[] }
    }

    /// Whether its dates can be read with the day first and with the month first.
    pub fn is_open_date(&self) -> bool {
        self.texts > 0 && self.reads_as == [true; 2]
    }

    /// Whether so many of its values are beyond that angle that they are no outliers.
    fn is_often_beyond(&self, which: usize) -> bool {
        self.numbers > 0 && 100 * self.beyond[which] >= self.numbers
    }

    /// Whether its values are too large for radians.
    fn shows_degrees(&self, target: &str) -> bool {
        match target {
            "heading_rad" | "usbl_bearing_rad" => self.is_often_beyond(1) && !self.is_counted_on(),
            "roll_rad" => self.is_often_beyond(1),
            target if target.ends_with("_radps") => self.is_often_beyond(1),
            _ => self.is_often_beyond(0),
        }
    }

    /// Whether an angle in radians may go on over several turns: it begins within one, and leaps nowhere.
    fn is_counted_on(&self) -> bool {
        self.first.is_some_and(|first| first.abs() <= BEYOND_RAD[1]) && self.largest_step < PI
    }

    /// What speaks against the unit that its name states, where the draft takes that unit or another.
    pub fn against_its_name(&self, unit: &str) -> Option<String> {
        let stated = self.unit.filter(|stated| ["rad", "rad/s"].contains(stated))?;
        let range = format!("its name says {stated}, its values are {} to {}", self.min, self.max);
        match unit {
            "deg" | "deg/s" => Some(format!("{range}: taken for {unit}")),
            "rad" if self.is_often_beyond(1) => Some(format!("{range}: radians over several turns, or deg?")),
            _ => None,
        }
    }

    pub fn is_number(&self) -> bool {
        self.numbers > 0 && self.numbers >= 9 * self.texts
    }

    /// Whether its name has one of these words.
    pub fn says(&self, words: &[&str]) -> bool {
        words.iter().any(|word| self.words.iter().any(|own| own == word))
    }

    pub fn is_pressure(&self) -> bool {
        self.plain.contains(PRESSURE)
    }

    pub fn is_magnetic(&self) -> bool {
        self.says(&MAGNETIC)
    }

    /// Whether its name is that of a column of the vehicle log.
    pub fn exact(&self) -> Option<&'static str> {
        Column::from_name(&self.name.to_lowercase()).map(Column::name)
    }

    /// Its unit, if it is a pressure, in Pa.
    pub fn pascals(&self) -> f64 {
        let unit = self.unit_for("depth_m", false);
        PASCALS.iter().find(|(known, _)| *known == unit).map_or(1e4, |(_, pa)| *pa)
    }

    /// Which part of a quaternion it is by its name: 0 for w, 1 to 3 for x, y, z.
    pub fn quaternion_part(&self) -> Option<usize> {
        let split = self.plain.rsplit_once(['.', '_']);
        let (stem, part) = split.or_else(|| self.plain.strip_prefix('q').map(|part| ("q", part)))?;
        let part = ["w", "x", "y", "z"].iter().position(|name| *name == part)?;
        (stem == "q" || ["quat", "orient"].iter().any(|name| stem.contains(name))).then_some(part)
    }

    /// Whether it is what a servo or a motor takes, in no unit.
    pub fn is_in_counts(&self) -> bool {
        let looks_so =
            self.unit.is_none() && self.is_whole && self.min >= 0.0 && self.max > 45.0 && self.max < 65_536.0;
        self.unit == Some(COUNTS) || looks_so
    }

    /// What its name says it is: a column of the vehicle log, a position on the globe, or `rudder` and `elevator`, one
    /// command for a pair of fins.
    pub fn target(&self) -> Option<&'static str> {
        // labels of runs may be texts
        if let Some(exact) = self.exact().filter(|exact| self.is_number() || *exact == "run") {
            return Some(exact);
        }
        if !self.is_number() {
            return None;
        }
        let is_none = |part: &str| if part.contains('_') { self.plain.contains(part) } else { self.says(&[part]) };
        if NONE.split(' ').any(is_none) {
            return None;
        }
        let stem = self.words.join("_");
        let is = |part: &str| match (part.strip_prefix('='), part.strip_prefix('~')) {
            (Some(whole), _) => stem == whole,
            (_, Some(word)) => self.says(&[word]),
            _ => self.plain.contains(part),
        };
        let is_command = self.says(&COMMAND);
        let is_of_fin = self.says(&["fin", "servo", "plane"]);
        let fits = |(parts, target): &&(&str, &'static str)| {
            // a place and a velocity have the same words
            let is_velocity = !target.starts_with("ref_") || self.unit.is_some() || self.plain.starts_with('v');
            let is_allowed = (is_actuator(target) || !(is_command || is_of_fin)) && is_velocity;
            parts.split(' ').any(is) && is_allowed && self.takes_unit(target)
        };
        NAMES.iter().find(fits).map(|(_, target)| *target)
    }

    /// Whether the unit of its name is one of the target.
    fn takes_unit(&self, target: &str) -> bool {
        let Some(unit) = self.unit else { return true };
        match (target, unit) {
            (target, COUNTS) => is_actuator(target),
            ("rudder" | "elevator", unit) => ["rad", "deg"].contains(&unit),
            // a rate named by its angle
            (target, "rad" | "deg") if target.ends_with("_radps") => true,
            (target, unit) => units::factor(target, unit).is_some(),
        }
    }

    /// Its unit, by its name or by its range.
    pub fn unit_for(&self, target: &str, has_degrees: bool) -> &'static str {
        let largest = self.min.abs().max(self.max.abs());
        let stated = self.unit.filter(|unit| units::factor(target, unit).is_some());
        match target {
            t if t.ends_with("_radps") => match self.unit {
                Some("deg") => "deg/s",
                Some("rad" | "rad/s") if self.shows_degrees(target) => "deg/s",
                Some("rad") => "rad/s",
                _ => stated.unwrap_or(if largest > 3.0 { "deg/s" } else { "rad/s" }),
            },
            t if t.ends_with("_rad") && stated == Some("rad") && self.shows_degrees(target) => "deg",
            t if t.ends_with("_rad") => stated.unwrap_or(if has_degrees || largest > 6.3 { "deg" } else { "rad" }),
            t if t.ends_with("_mps") => stated.unwrap_or(match largest {
                l if t != "sound_speed_mps" && l > 1000.0 => "mm/s",
                l if t != "sound_speed_mps" && l > 15.0 => "cm/s",
                _ => "m/s",
            }),
            t if t.ends_with("_rpm") => stated.unwrap_or("rpm"),
            t if t.ends_with("_deg") => stated.unwrap_or("deg"),
            t if t.ends_with("_per_m3") => stated.unwrap_or(if largest < 10.0 { "g/cm^3" } else { "kg/m^3" }),
            t if t.ends_with("_m3") => "m^3",
            t if t.ends_with("_m") => stated.unwrap_or(if self.is_pressure() { "dbar" } else { "m" }),
            t if t.ends_with("_s") => stated.unwrap_or("s"),
            _ => "",
        }
    }

    pub fn range(&self) -> String {
        if self.is_number() {
            format!("{} to {}, {} values", self.min, self.max, self.numbers)
        } else {
            format!("for example {:?}", self.sample)
        }
    }

    /// What a time column is: unit and base.
    pub fn time_unit(&self) -> Option<(&'static str, &'static str)> {
        const NAMES: [&str; 8] = ["time", "stamp", "epoch", "zeit", "seconds", "clock", "date", "utc"];
        let is_named = NAMES.iter().any(|part| self.plain.contains(part))
            || ["t", "t_s", "sec", "secs", "ms", "us", "ns"].contains(&self.plain.as_str());
        if !is_named {
            return None;
        }
        if !self.is_number() {
            let calendar = crate::importers::calendar::time_us(&self.sample);
            let is_clock = calendar.or(crate::importers::calendar::minutes_us(&self.sample)).is_some();
            let dated = match self.reads_as {
                _ if DateOrder::YearMonthDay.unix_us(&self.sample).is_some() => Some("iso"),
                [true, _] if self.texts > 0 => Some("dmy"),
                [_, true] if self.texts > 0 => Some("mdy"),
                _ => None,
            };
            return dated.map(|unit| (unit, "epoch")).or(is_clock.then_some(("hms", "start")));
        }
        let first = self.first?;
        let span = (self.last - first) / self.numbers.max(2) as f64;
        let stated = self.unit.filter(|unit| units::TIME.iter().any(|(known, _)| known == unit));
        // nanoseconds, microseconds, milliseconds, seconds since 1970, then by the time between two rows
        let (unit, base) = match (first, span) {
            // days of this century in MATLAB and in spreadsheets, where rows are seconds apart
            (f, s) if (730_000.0..800_000.0).contains(&f) && s < SECONDS_IN_DAYS => ("datenum", "epoch"),
            (f, s) if (36_000.0..73_000.0).contains(&f) && s < SECONDS_IN_DAYS => ("excel", "epoch"),
            (f, _) if f > 1e17 => ("ns", "epoch"),
            (f, _) if f > 1e14 => ("us", "epoch"),
            (f, _) if f > 1e11 => ("ms", "epoch"),
            (f, _) if f > 1e8 => ("s", "epoch"),
            (_, s) if s > 1e6 => ("ns", "start"),
            (_, s) if s > 5e3 => ("us", "start"),
            (_, s) if s > 5.0 => ("ms", "start"),
            _ => ("s", "start"),
        };
        Some((stated.unwrap_or(unit), base))
    }
}

/// A quarter of a turn and a whole one, a little more than each, rad.
const BEYOND_RAD: [f64; 2] = [1.6, 6.3];
/// Orders in which a date is written where the year is last.
const ORDERS: [DateOrder; 2] = [DateOrder::DayMonthYear, DateOrder::MonthDayYear];
/// Most different words among the numbers of a column that are taken for marks of no sample.
const MOST_MARKS: usize = 3;
/// Twenty seconds, d.
const SECONDS_IN_DAYS: f64 = 20.0 / 86_400.0;

/// Whether it is a command of a fin, a propeller or a thruster.
pub(super) fn is_actuator(target: &str) -> bool {
    ["rudder", "elevator", "prop_rpm", "thruster_left", "thruster_right", "rudder_rad"].contains(&target)
        || target.starts_with("fin_")
}
