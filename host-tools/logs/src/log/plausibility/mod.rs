//! Is a log what its column names say? Ranges, rates and gaps of every column, and what contradicts units and signs.
//!
//! Two kinds of evidence: values that no vehicle has (`limits`), and columns that contradict each other (`relations`),
//! such as a yaw rate that is 57 times what the heading does,
//! and velocities that do not carry the vehicle where depth and fixes show it (`velocity`).

mod limits;
mod relations;
mod summary;
mod velocity;

pub use summary::ColumnSummary;

use super::{Column, Log};

/// How much a finding matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Worth knowing; results hold.
    Remark,
    /// A unit, a sign or a time that is probably wrong: results are not to be trusted.
    Suspicious,
}

/// Something about a log that its user should know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// The column, or the first of those that contradict each other; `None`: the time or the log as a whole.
    pub column: Option<Column>,
    /// How much it matters.
    pub severity: Severity,
    /// What was found and what it could mean, one line.
    pub message: String,
}

/// What an examination of a log gave.
#[derive(Clone, Debug)]
pub struct Examination {
    /// From the first to the last row, s.
    pub span_s: f64,
    /// Columns that have samples.
    pub columns: Vec<ColumnSummary>,
    /// What contradicts units, signs and times, and what is merely odd.
    pub findings: Vec<Finding>,
}

impl Examination {
    /// Examines a log as its reader gave it, before the installation is applied.
    #[must_use]
    pub fn of(log: &Log) -> Self {
        let columns: Vec<ColumnSummary> =
            Column::ALL.into_iter().filter_map(|column| ColumnSummary::of(log, column)).collect();
        let mut findings = limits::check(log, &columns);
        findings.extend(relations::check(log, &findings));
        findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
        Self { span_s: log.duration_s(), columns, findings }
    }

    /// What makes the log suspicious.
    pub fn suspicions(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|finding| finding.severity == Severity::Suspicious)
    }

    /// Whether units, signs or times are probably wrong.
    #[must_use]
    pub fn is_suspicious(&self) -> bool {
        self.suspicions().next().is_some()
    }
}

impl Finding {
    fn suspicious(column: Column, message: impl Into<String>) -> Self {
        Self { column: Some(column), severity: Severity::Suspicious, message: message.into() }
    }

    fn remark(column: Column, message: impl Into<String>) -> Self {
        Self { column: Some(column), severity: Severity::Remark, message: message.into() }
    }
}

#[cfg(test)]
mod tests;
