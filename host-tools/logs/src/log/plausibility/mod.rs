//! Is a log what its column names say? Ranges, rates and gaps of every column, and what contradicts units and signs.
//!
//! Evidence of five kinds: names that are almost those of columns (`names`), values that no vehicle has (`limits`,
//! `angles`), numbers that stand for no reading (`marks`), readings that stand still or in no order (`held`) or twice (`repeated`), and
//! columns
//! that contradict each other by physics that needs no vehicle (`recording`), such as a heading that falls where the yaw
//! rate is positive.

mod angles;
mod held;
mod limits;
mod magnetic;
mod marks;
mod names;
mod recording;
mod repeated;
mod sources;
mod summary;

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
    /// What was found, by what evidence, and what would mend it, one line.
    pub message: String,
    /// The mistake in a few words.
    pub what: String,
    /// Numbers that show it; empty where `what` says all.
    pub evidence: String,
    /// Lines of a column mapping that mend it, one for each column, where a mapping can.
    pub mend: Option<String>,
    /// Mends of other mistakes that would explain the same evidence as well.
    pub alternatives: Vec<String>,
}

/// A test that this log does not allow.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Untested {
    /// What would have been compared.
    pub test: &'static str,
    /// Columns of which it would have told.
    pub columns: Vec<Column>,
    /// Whether the log lacks what would be compared.
    pub lacks_columns: bool,
    /// Whether it was compared, and neither holds nor is contradicted.
    pub is_inconclusive: bool,
    /// Why it was not.
    pub why: String,
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
    /// What could not be tested.
    pub untested: Vec<Untested>,
    /// Tests that hold, and the columns that they are of.
    pub holding: Vec<(&'static str, Vec<Column>)>,
}

impl Examination {
    /// Examines a log as its reader gave it, before the installation is applied.
    #[must_use]
    pub fn of(log: &Log) -> Self {
        let columns = summaries(log);
        let mut findings = names::check(log);
        findings.extend(limits::time(log, &columns));
        let (mut untested, mut holding) = (Vec::new(), Vec::new());
        // with times that are wrong nothing else can be compared
        if findings.iter().all(|finding| finding.column.is_some() || finding.severity == Severity::Remark) {
            // what stands for no reading is compared with nothing
            let (marks, log) = marks::taken_out(log, &columns);
            let columns = if marks.is_empty() { columns.clone() } else { summaries(&log) };
            let log = &*log;
            let odd = held::check(log, &columns);
            let mut values = limits::check(log, &columns);
            findings.extend(marks);
            let is_doubted = |column| {
                odd.iter().any(|finding| finding.column == Some(column) && finding.severity == Severity::Suspicious)
            };
            let headings = angles::heading_units(log);
            let beyond: Vec<Column> = values
                .iter()
                .filter(|finding| finding.severity == Severity::Suspicious)
                .filter_map(|finding| finding.column)
                .chain(headings.first().map(|_| Column::Heading))
                .collect();
            let tests = recording::check(log, &beyond, &headings, is_doubted);
            values.extend(tests.heading.map(|unit| angles::heading(log, &unit)));
            findings.extend(tests.turn.and_then(|turn| magnetic::check(log, turn)));
            for finding in values.iter_mut().filter(|f| f.column.is_some_and(|column| tests.changed.contains(&column)))
            {
                finding.without_mend();
            }
            let contradictions = tests.findings;
            (untested, holding) = (tests.untested, tests.holding);
            // a value beyond all limits whose cause is found needs no second finding
            let is_explained = |finding: &Finding| {
                let entry = finding.column.map_or_else(String::new, |column| format!("columns.{} =", column.name()));
                let is_mended = |lines: &String| lines.contains(&entry);
                finding.column.is_some()
                    && contradictions.iter().any(|found| found.mend.as_ref().is_some_and(is_mended))
            };
            findings.extend(values.into_iter().filter(|finding| !is_explained(finding)));
            findings.extend(odd);
            findings.extend(repeated::check(log));
            findings.extend(contradictions);
        }
        if let Some(sources) = &log.sources {
            findings.iter_mut().for_each(|finding| sources::name(finding, sources, log.time_column.as_deref()));
        }
        findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
        Self { span_s: log.duration_s(), columns, findings, untested, holding }
    }

    /// What makes the log suspicious.
    pub fn suspicions(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|finding| finding.severity == Severity::Suspicious)
    }

    /// Whether units, signs or times are probably wrong.
    pub fn is_suspicious(&self) -> bool {
        self.suspicions().next().is_some()
    }
}

fn summaries(log: &Log) -> Vec<ColumnSummary> {
    Column::ALL.into_iter().filter_map(|column| ColumnSummary::of(log, column)).collect()
}

/// What stands in a finding's message before its lines.
const MENDED_BY: &str = "; mended by ";

impl Finding {
    fn new(severity: Severity, column: Option<Column>, message: impl Into<String>) -> Self {
        let message = message.into();
        let (what, evidence) = (message.clone(), String::new());
        Self { column, severity, message, what, evidence, mend: None, alternatives: Vec::new() }
    }

    fn suspicious(column: Column, message: impl Into<String>) -> Self {
        Self::new(Severity::Suspicious, Some(column), message)
    }

    fn remark(column: Column, message: impl Into<String>) -> Self {
        Self::new(Severity::Remark, Some(column), message)
    }

    /// Of a mistake in a part of a log.
    fn without_mend(&mut self) {
        if let Some((said, _)) = self.message.rsplit_once(MENDED_BY) {
            self.message.truncate(said.len());
        }
        self.mend = None;
        self.alternatives.clear();
    }

    fn mended_by(mut self, lines: String) -> Self {
        self.message = format!("{}{MENDED_BY}{}", self.message, lines.replace('\n', " and "));
        self.mend = Some(lines);
        self
    }
}

#[cfg(test)]
mod tests;
