//! What the examination of a log says of a wrong recording.

use super::change::{Change, Wrong};
use backseat_logs::Log;
use backseat_logs::log::plausibility::Examination;
use serde::{Deserialize, Serialize};

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

/// Examines a log with a mistake; `None` if the log lacks the columns.
pub fn judge(wrong: &Wrong, log: &Log) -> Option<Judged> {
    let found = Examination::of(&wrong.apply(log)?);
    let wanted: Vec<&str> = wrong.mends.iter().flat_map(|mend| mend.lines()).collect();
    let lines: Vec<&str> = found.suspicions().filter_map(|f| f.mend.as_deref()).flat_map(str::lines).collect();
    let columns = wrong.columns();
    let mends: Vec<&String> = wrong.mends.iter().filter(|mend| !mend.is_empty()).collect();
    // where no mapping mends it, the column must be the right one
    let is_of_columns = |column| columns.contains(&column);
    let is_mapless = wrong.mends.iter().any(String::is_empty);
    let is_right_place = found.suspicions().all(|finding| finding.column.is_none_or(is_of_columns))
        && (matches!(wrong.change, Change::Time(_)) || found.suspicions().any(|f| f.column.is_some_and(is_of_columns)));
    // one finding a column, or one for all
    let is_whole = mends.iter().any(|mend| mend.lines().all(|line| lines.contains(&line)));
    let is_wanted = |text: &String| mends.contains(&text);
    let is_among = |finding: &backseat_logs::log::plausibility::Finding| finding.alternatives.iter().any(is_wanted);
    let untested = found.untested.iter().find(|untested| untested.columns.iter().any(|c| is_of_columns(*c)));
    let remark = found.findings.iter().find(|finding| finding.column.is_some_and(is_of_columns));
    let verdict = if !found.is_suspicious() {
        let is_remarked = found.findings.iter().any(|finding| finding.mend.as_ref().is_some_and(is_wanted));
        match (is_remarked, untested.is_some() || remark.is_some()) {
            (true, _) => Verdict::Remarked,
            (false, true) => Verdict::Told,
            (false, false) => Verdict::Silent,
        }
    } else if (is_whole && lines.iter().all(|line| wanted.contains(line))) || (is_mapless && is_right_place) {
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
