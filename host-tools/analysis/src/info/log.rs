//! What was found in a log.

use crate::duration::span;
use crate::read_log::{ReadLog, finding};
use crate::uses::{self, Use};
use backseat_logs::log::plausibility::{ColumnSummary, Severity, Untested};
use backseat_report::{Report, Table, word};
use serde_json::{Map, Value, json};

/// The report on a log.
pub fn report(read: &ReadLog) -> Report {
    let (log, examination) = (&read.log, &read.examination);
    let start_s = log.rows.first().map_or(0.0, |row| row.time_us as f64 * 1e-6);
    let (verdict, reasons) = verdict(read);
    let suspicions: Vec<String> = examination.suspicions().map(|finding| finding.message.clone()).collect();
    let what = format!("{}, {} rows, {} from t_s {start_s}", read.format, log.rows.len(), span(examination.span_s));
    let file = log.path.display().to_string();
    let uses = uses::of(log);
    let mut report = Report::new(file.clone(), format!("{file}: {verdict}")).warnings(&suspicions).fact("log", what);
    for Use { command, possible, how } in &uses {
        report = report.fact(command, format!("{}: {how}", if *possible { "yes" } else { "no" }));
    }
    let name = word(&log.path);
    let commands: Vec<String> = uses.iter().filter_map(|found| found.command_line(&name, &read.options)).collect();
    let declination = log.declination();
    if let Some((_, words)) = &declination {
        report = report.fact("declination", format!("{words}, of a compass that is not corrected"));
    }
    let remarks = examination.findings.iter().filter(|finding| finding.severity == Severity::Remark);
    let header = ["column", "samples", "rate Hz", "gap s", "min", "median", "max"];
    let uses =
        uses.into_iter().map(|found| (found.command.to_owned(), json!({"possible": found.possible, "how": found.how})));
    let report = report
        .table(examination.columns.iter().fold(Table::new("", &header), row))
        .notes(&not_tested(read))
        .notes(&read.log.notes)
        .notes(&remarks.map(|finding| finding.message.clone()).collect::<Vec<_>>())
        .value("file", file)
        .value("format", read.format)
        .value("rows", log.rows.len())
        .value("span_s", examination.span_s)
        .value("declination_rad", declination.map(|(declination, _)| declination))
        .value("columns", examination.columns.iter().map(column).collect::<Vec<_>>())
        .value("findings", examination.findings.iter().map(finding).collect::<Vec<_>>())
        .value("untested", examination.untested.iter().map(untested).collect::<Vec<_>>())
        .value("uses", uses.collect::<Map<_, _>>())
        .value("notes", read.log.notes.clone())
        .value("verdict", verdict)
        .value("reasons", reasons)
        .value("commands", commands.clone());
    // what contradicts physics is mended first
    if commands.is_empty() || !suspicions.is_empty() {
        return report;
    }
    let report = report.section("Next");
    let report = if commands.iter().any(|command| command.starts_with("cargo")) {
        report.text("In a clone of the repository:")
    } else {
        report
    };
    commands.iter().fold(report, |report, command| report.command(command))
}

fn row(table: Table, summary: &ColumnSummary) -> Table {
    table.row([
        summary.column.name().to_owned(),
        summary.samples.to_string(),
        summary.rate_hz().map_or_else(|| "-".to_owned(), short),
        short(summary.longest_gap_s.0),
        short(summary.min),
        short(summary.median),
        short(summary.max),
    ])
}

/// "usable", "suspicious" or "of no use", and why.
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

/// Tests without a conclusion, and those that the log does not allow: those whose columns are there one by one, the others
/// by what is missing.
fn not_tested(read: &ReadLog) -> Vec<String> {
    let untested = &read.examination.untested;
    let (lacking, shown): (Vec<&Untested>, Vec<&Untested>) = untested.iter().partition(|test| test.lacks_columns);
    let line = |test: &&Untested| {
        let word = if test.is_inconclusive { "inconclusive" } else { "not tested" };
        format!("{word}: {} ({})", test.test, test.why)
    };
    let mut lines: Vec<String> = shown.iter().map(line).collect();
    if !lacking.is_empty() {
        let names: Vec<&str> = lacking.iter().map(|test| test.test).collect();
        lines.push(format!("not tested for lack of columns: {}", names.join(", ")));
    }
    lines
}

fn untested(test: &Untested) -> Value {
    let columns: Vec<&str> = test.columns.iter().map(|column| column.name()).collect();
    json!({"test": test.test, "columns": columns, "inconclusive": test.is_inconclusive, "why": test.why})
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
