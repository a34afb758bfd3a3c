//! Span, rate, gaps and range of one column.

use crate::log::{Column, Log};
use crate::stats::percentile_sorted;

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColumnSummary {
    /// Which.
    pub column: Column,
    /// Samples.
    pub samples: usize,
    /// Share of the rows that have a sample, 0 to 1.
    pub filled: f64,
    /// Median time between samples, s; zero with fewer than two.
    pub interval_s: f64,
    /// Longest time between two samples, s, and the time at which it begins.
    pub longest_gap_s: (f64, f64),
    /// Smallest value.
    pub min: f64,
    /// Median value.
    pub median: f64,
    /// Largest value.
    pub max: f64,
    /// Value below which one percent of the samples lies, and one percent above which.
    pub percentile_1_99: [f64; 2],
    /// Share of the samples that are equal to the one before, 0 to 1.
    pub repeated: f64,
}

impl ColumnSummary {
    /// Of a column; `None` without samples.
    pub(super) fn of(log: &Log, column: Column) -> Option<Self> {
        let (mut values, mut intervals) = (Vec::new(), Vec::new());
        let (mut repeated, mut longest_gap_s) = (0_usize, (0.0, 0.0));
        let mut previous: Option<(u64, f64)> = None;
        for (time_us, value) in log.column(column) {
            if let Some((before_us, before)) = previous {
                let interval_s = (time_us - before_us) as f64 * 1e-6;
                repeated += usize::from(value == before);
                if interval_s > longest_gap_s.0 {
                    longest_gap_s = (interval_s, before_us as f64 * 1e-6);
                }
                intervals.push(interval_s);
            }
            previous = Some((time_us, value));
            values.push(value);
        }
        values.sort_unstable_by(f64::total_cmp);
        intervals.sort_unstable_by(f64::total_cmp);
        let (min, max) = (*values.first()?, *values.last()?);
        let at = |q| percentile_sorted(&values, q);
        Some(Self {
            column,
            samples: values.len(),
            filled: values.len() as f64 / log.rows.len() as f64,
            interval_s: percentile_sorted(&intervals, 0.5).unwrap_or(0.0),
            longest_gap_s,
            min,
            median: at(0.5)?,
            max,
            percentile_1_99: [at(0.01)?, at(0.99)?],
            repeated: repeated as f64 / values.len() as f64,
        })
    }

    /// Samples a second, by the median time between two; `None` with fewer than two.
    pub fn rate_hz(&self) -> Option<f64> {
        (self.interval_s > 0.0).then(|| 1.0 / self.interval_s)
    }
}
