//! Marks of no reading: one number far beyond all others, written where a sensor measured nothing.

use super::{ColumnSummary, Finding, limits};
use crate::log::Log;
use std::borrow::Cow;

/// Samples alike from which on a number is no outlier.
const FEWEST: usize = 10;
/// A mark is so many times the largest reading that is no mark, or more.
const FAR: f64 = 3.0;

/// The marks that are found, and the log without them.
pub(super) fn taken_out<'a>(log: &'a Log, columns: &[ColumnSummary]) -> (Vec<Finding>, Cow<'a, Log>) {
    let (mut findings, mut log) = (Vec::new(), Cow::Borrowed(log));
    for summary in columns {
        let Some((mark, count)) = mark(&log, summary) else { continue };
        let name = summary.column.name();
        let message = format!(
            "{name} reads {mark} in {count} of {} samples, far beyond all others: a mark of no reading. Leave these cells \
             empty, or they count as measurements; a mapping does so by its line missing = [\"{mark}\"], with the number as \
             it stands in the table",
            summary.samples
        );
        findings.push(Finding::suspicious(summary.column, message));
        for row in log.to_mut().rows.iter_mut().filter(|row| row.get(summary.column) == Some(mark)) {
            row.set(summary.column, f64::NAN);
        }
    }
    (findings, log)
}

/// The number outside what is plausible that a column repeats, and how often, where all others are plausible.
fn mark(log: &Log, summary: &ColumnSummary) -> Option<(f64, usize)> {
    let [low, high] = limits::of(log, summary.column)?;
    let is_outside = |value: f64| !(low..=high).contains(&value);
    if !is_outside(summary.min) && !is_outside(summary.max) {
        return None;
    }
    let (outside, inside): (Vec<f64>, Vec<f64>) =
        log.column(summary.column).map(|(_, value)| value).partition(|value| is_outside(*value));
    let mark = if is_outside(summary.max) { summary.max } else { summary.min };
    let count = outside.iter().filter(|value| **value == mark).count();
    let largest = inside.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let is_alone = count >= FEWEST && count * 2 > outside.len() && inside.len() >= FEWEST;
    (is_alone && mark.abs() >= FAR * largest).then_some((mark, count))
}

#[cfg(test)]
mod tests {
    use super::super::Examination;
    use super::*;
    use crate::log::{Column, LogRow};

    /// A DVL that loses the bottom for a third of the time and says so by 25.032 m/s astern, beside a clean heave.
    #[test]
    fn a_number_in_the_place_of_no_reading_is_no_unit() {
        let mut log = Log::default();
        for k in 0..900_u64 {
            let mut row = LogRow::new(k * 200_000);
            let (speed, is_lost) = (1.2 + 0.1 * (k as f64 * 0.05).sin(), k % 300 < 100);
            row.set(Column::DvlU, if is_lost { -25.032 } else { speed })
                .set(Column::DvlW, 0.1 * (k as f64 * 0.1).sin());
            log.rows.push(row);
        }
        let said: Vec<String> = Examination::of(&log).suspicions().map(|finding| finding.message.clone()).collect();
        assert!(said.len() == 1 && said[0].contains("-25.032 in 300 of 900 samples"), "{said:?}");
        // All of it in mm/s is a unit, and one reading beyond all others an outlier.
        let speed = |k: usize| 1.2 + 0.001 * (k % 100) as f64;
        for change in [&(|k| 1e3 * speed(k)) as &dyn Fn(usize) -> f64, &|k| if k == 50 { -25.032 } else { speed(k) }] {
            let mut log = log.clone();
            for (k, row) in log.rows.iter_mut().enumerate() {
                row.set(Column::DvlU, change(k));
            }
            let said: Vec<String> = Examination::of(&log).findings.iter().map(|f| f.message.clone()).collect();
            assert!(said.iter().all(|said| !said.contains("mark of no reading. Leave")), "{said:?}");
        }
    }
}
