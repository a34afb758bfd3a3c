//! What the examination of a log says of a wrong recording.

use super::change::{Change, Wrong};
use backseat_logs::log::plausibility::{Examination, Finding};
use backseat_logs::log::units;
use backseat_logs::{Column, Log};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// What became of a mistake.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Refused, with the lines that undo it and no others.
    Named,
    /// Refused; the lines that undo it stand among others that the log supports as well.
    AmongOthers,
    /// Refused, but another mend or none is named.
    Refused,
    /// Not refused; a remark names the lines that undo it.
    Remarked,
    /// Not refused; a test of the column is said to be impossible in this log, or the column is remarked upon.
    Told,
    Silent,
}

/// A mistake in one log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Judged {
    pub verdict: Verdict,
    /// What was said: the findings, or the test that the log does not allow.
    pub said: String,
}

/// What a line of a mapping makes of a source: (source + offset) · factor.
#[derive(Clone, Debug)]
struct Entry {
    target: String,
    source: String,
    factor: f64,
    offset: f64,
}

/// Digits of a factor and an offset that a line has.
const DIGITS: f64 = 1e-4;

impl Entry {
    /// Of lines; `None` where one of them is no line of a mapping.
    fn all(lines: &str) -> Option<Vec<Self>> {
        lines.lines().map(Self::of).collect()
    }

    fn of(line: &str) -> Option<Self> {
        let table: toml::Table = line.parse().ok()?;
        let (target, entry) = match table.get("columns").and_then(toml::Value::as_table) {
            Some(columns) => columns.iter().next().map(|(target, entry)| (target.clone(), entry))?,
            None => ("t_s".to_owned(), table.get("time")?),
        };
        let number = |key: &str, otherwise: f64| match entry.get(key) {
            None => Some(otherwise),
            Some(value) => value.as_float().or(value.as_integer().map(|whole| whole as f64)),
        };
        let unit = match entry.get("unit").and_then(toml::Value::as_str) {
            None => 1.0,
            Some(unit) if target == "t_s" => units::TIME.iter().find(|(known, _)| *known == unit)?.1,
            Some(unit) => units::factor(&target, unit)?,
        };
        let source = entry.get("column")?.as_str()?.to_owned();
        let factor = unit * number("scale", 1.0)? * number("sign", 1.0)?;
        Some(Self { target, source, factor, offset: number("offset", 0.0)? })
    }

    /// Whether two lines do the same; a heading may differ by whole turns.
    fn is(&self, other: &Self) -> bool {
        let turn = if self.target == Column::Heading.name() { 2.0 * PI } else { f64::INFINITY };
        let apart = (self.offset * self.factor - other.offset * other.factor).abs();
        let apart = if turn.is_finite() { (apart + DIGITS).rem_euclid(turn) - DIGITS } else { apart };
        (&self.target, &self.source) == (&other.target, &other.source)
            && (self.factor / other.factor - 1.0).abs() < DIGITS
            && apart.abs() <= DIGITS * (1.0 + self.offset.abs() * self.factor.abs())
    }

    fn is_among(&self, others: &[Self]) -> bool {
        others.iter().any(|other| self.is(other))
    }
}

/// Whether two mends have the same lines.
fn is_same(one: &[Entry], other: &[Entry]) -> bool {
    one.len() == other.len() && one.iter().all(|entry| entry.is_among(other))
}

/// Examines a log with a mistake; `None` if the log lacks the columns.
pub fn judge(wrong: &Wrong, log: &Log) -> Option<Judged> {
    let found = Examination::of(&wrong.apply(log)?);
    let mends: Vec<Vec<Entry>> =
        wrong.mends.iter().filter(|mend| !mend.is_empty()).filter_map(|mend| Entry::all(mend)).collect();
    let named = |finding: &Finding| finding.mend.as_deref().and_then(Entry::all).unwrap_or_default();
    let lines: Vec<Entry> = found.suspicions().flat_map(named).collect();
    let columns = wrong.columns();
    // where no mapping mends it, the column must be the right one
    let is_of_columns = |column| columns.contains(&column);
    let is_mapless = wrong.mends.iter().any(String::is_empty);
    let is_right_place = found.suspicions().all(|finding| finding.column.is_none_or(is_of_columns))
        && (matches!(wrong.change, Change::Time(_)) || found.suspicions().any(|f| f.column.is_some_and(is_of_columns)));
    // one finding a column, or one for all
    let is_whole = mends.iter().any(|mend| mend.iter().all(|line| line.is_among(&lines)));
    let is_wanted =
        |text: &String| Entry::all(text).is_some_and(|entries| mends.iter().any(|mend| is_same(mend, &entries)));
    let is_among = |finding: &Finding| finding.alternatives.iter().any(is_wanted);
    let untested = found.untested.iter().find(|untested| untested.columns.iter().any(|c| is_of_columns(*c)));
    let remark = found.findings.iter().find(|finding| finding.column.is_some_and(is_of_columns));
    let verdict = if !found.is_suspicious() {
        let is_remarked = found.findings.iter().any(|finding| finding.mend.as_ref().is_some_and(is_wanted));
        match (is_remarked, untested.is_some() || remark.is_some()) {
            (true, _) => Verdict::Remarked,
            (false, true) => Verdict::Told,
            (false, false) => Verdict::Silent,
        }
    } else if (is_whole && lines.iter().all(|line| mends.iter().any(|mend| line.is_among(mend))))
        || (is_mapless && is_right_place)
    {
        Verdict::Named
    } else if is_whole || found.suspicions().any(is_among) {
        Verdict::AmongOthers
    } else {
        Verdict::Refused
    };
    let said = if found.is_suspicious() {
        found.suspicions().map(|finding| finding.message.as_str()).collect::<Vec<_>>().join(" | ")
    } else {
        let test = untested.map(|untested| format!("{}: {}", untested.test, untested.why));
        remark.map(|finding| finding.message.clone()).or(test).unwrap_or_default()
    };
    Some(Judged { verdict, said })
}
