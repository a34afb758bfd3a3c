//! What was found in a log, as text and as JSON.

use backseat_analysis::read_log::ReadLog;
use backseat_analysis::uses::{self, Use};
use backseat_logs::log::plausibility::{ColumnSummary, Finding, Severity};
use serde_json::{Map, Value, json};
use std::fmt::Write as _;

pub fn text(read: &ReadLog) -> String {
    let mut out = String::new();
    let (log, examination) = (&read.log, &read.examination);
    let start_s = log.rows.first().map_or(0.0, |row| row.time_us as f64 * 1e-6);
    let _ = writeln!(
        out,
        "{}: {}, {} rows, {} from t_s {start_s}\n",
        log.path.display(),
        read.format,
        log.rows.len(),
        span(examination.span_s)
    );
    let _ = writeln!(
        out,
        "{:<21} {:>8} {:>7} {:>7} {:>10} {:>10} {:>10}",
        "column", "samples", "rate Hz", "gap s", "min", "median", "max"
    );
    for summary in &examination.columns {
        let _ = writeln!(
            out,
            "{:<21} {:>8} {:>7} {:>7} {:>10} {:>10} {:>10}",
            summary.column.name(),
            summary.samples,
            summary.rate_hz().map_or_else(|| "-".to_owned(), short),
            short(summary.longest_gap_s.0),
            short(summary.min),
            short(summary.median),
            short(summary.max),
        );
    }
    out.push('\n');
    for Use { command, possible, how } in uses::of(log) {
        let _ = writeln!(out, "{command:<10} {}: {how}", if possible { "yes" } else { "no" });
    }
    for note in &read.reader_notes {
        let _ = writeln!(out, "note: {note}");
    }
    for finding in examination.findings.iter().filter(|finding| finding.severity == Severity::Remark) {
        let _ = writeln!(out, "remark: {}", finding.message);
    }
    let (verdict, reasons) = verdict(read);
    match reasons.as_slice() {
        [] => out += &format!("\n{verdict}\n"),
        [one] => out += &format!("\n{verdict} because {one}\n"),
        many => out += &format!("\n{verdict} because:\n  {}\n", many.join("\n  ")),
    }
    out
}

/// "usable", or what else, and why.
pub fn verdict(read: &ReadLog) -> (&'static str, Vec<String>) {
    let suspicions = read.examination.suspicions().map(|finding| finding.message.clone());
    let uses = uses::of(&read.log);
    if uses.iter().any(|found| found.possible) {
        let suspicions: Vec<String> = suspicions.collect();
        return (if suspicions.is_empty() { "usable" } else { "suspicious" }, suspicions);
    }
    let lacks = uses.iter().map(|found| format!("{} {}", found.command, found.how));
    ("of no use", lacks.chain(suspicions).collect())
}

pub fn json(read: &ReadLog) -> String {
    let (log, examination) = (&read.log, &read.examination);
    let uses: Map<String, Value> = uses::of(log)
        .into_iter()
        .map(|found| (found.command.to_owned(), json!({"possible": found.possible, "how": found.how})))
        .collect();
    let (verdict, reasons) = verdict(read);
    let object = json!({
        "file": log.path,
        "format": read.format,
        "rows": log.rows.len(),
        "span_s": examination.span_s,
        "columns": examination.columns.iter().map(column).collect::<Vec<_>>(),
        "findings": examination.findings.iter().map(finding).collect::<Vec<_>>(),
        "uses": uses,
        "notes": read.reader_notes,
        "verdict": verdict,
        "reasons": reasons,
    });
    format!("{object}\n")
}

fn column(summary: &ColumnSummary) -> Value {
    json!({
        "name": summary.column.name(),
        "samples": summary.samples,
        "filled": summary.filled,
        "rate_hz": summary.rate_hz(),
        "longest_gap_s": summary.longest_gap_s.0,
        "longest_gap_from_s": summary.longest_gap_s.1,
        "min": summary.min,
        "median": summary.median,
        "max": summary.max,
        "repeated": summary.repeated,
    })
}

fn finding(finding: &Finding) -> Value {
    json!({
        "column": finding.column.map(|column| column.name()),
        "suspicious": finding.severity == Severity::Suspicious,
        "message": finding.message,
    })
}

/// Four significant digits, in at most ten characters.
fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size if !(1e-3..1e7).contains(&size) => format!("{value:.2e}"),
        size if size < 1.0 => format!("{value:.4}"),
        size if size < 100.0 => format!("{value:.2}"),
        _ => format!("{value:.1}"),
    }
}

/// A time in the unit that suits it.
pub fn span(seconds: f64) -> String {
    match seconds {
        s if s < 120.0 => format!("{s:.1} s"),
        s if s < 7200.0 => format!("{:.1} min", s / 60.0),
        s => format!("{:.2} h", s / 3600.0),
    }
}
