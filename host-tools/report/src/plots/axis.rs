//! Axes: what range, which ticks, how the ticks read.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

use crate::lettering::{WIDTH, clean, shortened};

/// A linear axis. A logarithmic one is a linear axis over log10 of the value, with ticks that read as the value.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    pub title: String,
    pub low: f64,
    pub high: f64,
    /// Whether `low`, `high` and the ticks are logarithms.
    pub is_log: bool,
    pub ticks: Vec<(f64, String)>,
}

impl Axis {
    /// About `count` ticks at 1, 2 or 5 times a power of ten.
    pub fn linear(title: &str, low: f64, high: f64, count: usize) -> Self {
        let (low, high) = widened(low, high);
        let step = nice_step((high - low) / count.max(1) as f64);
        Self::with_step(title, low, high, step)
    }

    /// Ticks at multiples of `step`.
    pub fn with_step(title: &str, low: f64, high: f64, step: f64) -> Self {
        let decimals = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
        let first = (low / step - 1e-9).ceil();
        let last = (high / step + 1e-9).floor();
        let ticks = (0..=(last - first).clamp(0.0, 100.0) as usize).map(|i| (first + i as f64) * step).map(|value| {
            // Adding zero turns -0 into 0.
            let value = value + 0.0;
            let text = if value.abs() >= 1e6 || (value != 0.0 && step < 1e-4) {
                format!("{value:.1e}")
            } else {
                format!("{value:.decimals$}")
            };
            (value, text)
        });
        Self { title: title.into(), low, high, is_log: false, ticks: ticks.collect() }
    }

    /// Time from `low` to `high`, in hours; the unit follows the span. Also gives the unit's number in an hour.
    pub fn time(low: f64, high: f64) -> (Self, f64) {
        let (low, high) = widened(low, high);
        let (per_hour, unit) = match high - low {
            span if span >= 2.0 => (1.0, "h"),
            span if span >= 1.0 / 30.0 => (60.0, "min"),
            _ => (3600.0, "s"),
        };
        let mut step = nice_step((high - low) * per_hour / 8.0);
        if per_hour > 1.0 && step >= 20.0 {
            // Minutes and seconds are read in quarters and halves of an hour or minute.
            step = [20.0, 30.0, 60.0].into_iter().find(|s| *s >= step * 0.99).unwrap_or(60.0);
        }
        (Self::with_step(&format!("time [{unit}]"), low * per_hour, high * per_hour, step), per_hour)
    }

    /// A logarithmic axis of a decade or more; the bounds are values, both positive.
    pub fn log(title: &str, low: f64, high: f64) -> Self {
        let (low, high) = (low.log10().min(high.log10() - 1.0), high.log10());
        let decades = high - low;
        let multiples: &[f64] = if decades < 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let stride = (decades / 8.0).ceil().max(1.0) as i32;
        let ticks = (low.floor() as i32..=high.ceil() as i32)
            .filter(|decade| decade.rem_euclid(stride) == 0)
            .flat_map(|decade| multiples.iter().map(move |m| m * 10f64.powi(decade)))
            .filter(|value| (low - 1e-9..=high + 1e-9).contains(&value.log10()))
            .map(|value| (value.log10(), plain(value)));
        Self { title: title.into(), low, high, is_log: true, ticks: ticks.collect() }
    }

    /// One row for each name, from the top.
    pub fn names<'a>(names: impl ExactSizeIterator<Item = &'a str>) -> Self {
        let count = names.len();
        let ticks = names
            .enumerate()
            .map(|(row, name)| (row_position(row, count), shortened(&clean(name), f64::from(WIDTH) * 0.43)))
            .collect();
        Self { title: String::new(), low: -0.5, high: count.max(1) as f64 - 0.5, is_log: false, ticks }
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (start, end): (i32, i32)) -> i32 {
        let share = (value - self.low) / (self.high - self.low);
        (f64::from(start) + share * f64::from(end - start)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        // plotters asks a second time for a finer mesh, which there is none of.
        if hint.weight().allow_light_points() {
            return Vec::new();
        }
        self.ticks.iter().map(|t| t.0).collect()
    }

    fn range(&self) -> Range<f64> {
        self.low..self.high
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, value: &f64) -> String {
        self.ticks.iter().find(|t| t.0 == *value).map_or(String::new(), |t| t.1.clone())
    }
}

/// Ordinate of a row counted from the top.
pub(super) fn row_position(row: usize, count: usize) -> f64 {
    count as f64 - 1.0 - row as f64
}

/// Lowest and highest of some values; none of no values.
pub(super) fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.filter(|v| super::is_drawable(*v)).fold(None, |range, v| match range {
        None => Some((v, v)),
        Some((low, high)) => Some((v.min(low), v.max(high))),
    })
}

/// A range with room at both ends.
pub(super) fn padded((low, high): (f64, f64), share: f64) -> (f64, f64) {
    let (low, high) = widened(low, high);
    let pad = (high - low) * share;
    (low - pad, high + pad)
}

/// A value with about three significant digits.
pub(super) fn plain(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude != 0.0 && !(1e-4..1e6).contains(&magnitude) {
        return format!("{value:.1e}");
    }
    let decimals = if magnitude == 0.0 { 0 } else { (2.0 - magnitude.log10().floor()).max(0.0) as usize };
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `raw`.
pub(super) fn nice_step(raw: f64) -> f64 {
    let power = 10f64.powi(raw.log10().floor() as i32);
    [1.0, 2.0, 5.0].into_iter().map(|m| m * power).find(|step| *step >= raw * 0.999).unwrap_or(10.0 * power)
}

/// A range that is not empty: one value gets room around it.
fn widened(low: f64, high: f64) -> (f64, f64) {
    let least = 1e-9_f64.max(low.abs().max(high.abs()) * 1e-9);
    if high - low >= least {
        (low, high)
    } else {
        let half = if low == 0.0 { 0.5 } else { low.abs() * 0.1 };
        (low - half, high + half)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<&str> {
        axis.ticks.iter().map(|t| t.1.as_str()).collect()
    }

    #[test]
    fn ticks_are_round_numbers_inside_the_range() {
        assert_eq!(labels(&Axis::linear("", -0.13, 0.42, 5)), ["0.0", "0.2", "0.4"]);
        assert_eq!(labels(&Axis::linear("", 0.0, 1000.0, 5)), ["0", "200", "400", "600", "800", "1000"]);
        assert_eq!(labels(&Axis::linear("", -3.7, 3.7, 8)), ["-3", "-2", "-1", "0", "1", "2", "3"]);
    }

    #[test]
    fn time_is_in_the_unit_of_its_span() {
        let (hours, per_hour) = Axis::time(0.0, 3.2);
        assert_eq!((hours.title.as_str(), per_hour), ("time [h]", 1.0));
        let (minutes, _) = Axis::time(0.0, 1.6);
        assert_eq!(minutes.title, "time [min]");
        assert_eq!(labels(&minutes), ["0", "20", "40", "60", "80"]);
        let (seconds, _) = Axis::time(0.0, 0.01);
        assert_eq!(
            (seconds.title.as_str(), labels(&seconds)),
            ("time [s]", vec!["0", "5", "10", "15", "20", "25", "30", "35"])
        );
    }

    #[test]
    fn logarithmic_ticks_read_as_values() {
        assert_eq!(labels(&Axis::log("", 0.5, 900.0)), ["1", "10", "100"]);
        assert_eq!(labels(&Axis::log("", 0.09, 1.1)), ["0.1", "0.2", "0.5", "1"]);
    }

    #[test]
    fn values_keep_three_digits() {
        assert_eq!(
            [0.0, 1.0, 0.99, 12.345, 1234.5, 0.00123, -0.5].map(plain),
            ["0", "1", "0.99", "12.3", "1234", "0.00123", "-0.5"]
        );
    }
}
