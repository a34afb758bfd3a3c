//! A column of a table: its name in words, its unit, its values.

use super::names::{COMMAND, COUNTS, MAGNETIC, MISSING, NAMES, NONE, NOTHING, PRESSURE, unit_names};
use crate::log::units::{self, PASCALS};
use crate::log::{Column, table};

/// A column of the table.
pub(super) struct Seen {
    pub name: String,
    /// Lower case, without a unit in brackets, words joined by `_`.
    pub plain: String,
    /// Its words, but for the unit and those that say nothing.
    words: Vec<String>,
    /// The unit that its name states, if any.
    pub unit: Option<&'static str>,
    pub numbers: usize,
    texts: usize,
    pub min: f64,
    pub max: f64,
    pub first: Option<f64>,
    pub last: f64,
    /// All values are whole numbers.
    is_whole: bool,
    pub sample: String,
    /// What stands where there is no sample.
    pub missing: Option<String>,
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
            unit: unit(inside).or(ending.map(|(_, unit)| unit)),
            plain,
            name,
            numbers: 0,
            texts: 0,
            min: f64::INFINITY,
            max: f64::NEG_INFINITY,
            first: None,
            last: f64::NAN,
            is_whole: true,
            sample: String::new(),
            missing: None,
        }
    }

    pub fn add(&mut self, separator: u8, cell: &[u8]) {
        let text = String::from_utf8_lossy(cell);
        let text = text.trim();
        if text.is_empty() {
            return;
        }
        if MISSING.contains(&text.to_lowercase().as_str()) {
            self.missing = Some(text.to_owned());
            return;
        }
        if self.sample.is_empty() {
            self.sample = text.chars().take(24).collect();
        }
        match table::number_between(separator, text.as_bytes()).ok().filter(|value| value.is_finite()) {
            Some(value) => {
                self.numbers += 1;
                (self.min, self.max, self.last) = (self.min.min(value), self.max.max(value), value);
                self.first = self.first.or(Some(value));
                self.is_whole &= value.fract() == 0.0;
            }
            None => self.texts += 1,
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
                Some("rad") => "rad/s",
                _ => stated.unwrap_or(if largest > 3.0 { "deg/s" } else { "rad/s" }),
            },
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
            let is_instant = crate::importers::line_time::instant_us(&self.sample).is_some();
            return if is_instant { Some(("iso", "epoch")) } else { is_clock.then_some(("hms", "start")) };
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

/// Twenty seconds, d.
const SECONDS_IN_DAYS: f64 = 20.0 / 86_400.0;

/// Whether it is a command of a fin, a propeller or a thruster.
pub(super) fn is_actuator(target: &str) -> bool {
    ["rudder", "elevator", "prop_rpm", "thruster_left", "thruster_right", "rudder_rad"].contains(&target)
        || target.starts_with("fin_")
}
