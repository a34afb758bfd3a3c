//! Before a launch: go or no go, on one page to print and sign.

use super::line::{CheckLine, Verdict};
use backseat_logs::output::{self, Existing};
use backseat_report::{Provenance, Report, Table};
use std::path::Path;

/// "GO", or "NO GO" with what failed.
pub fn verdict(lines: &[CheckLine]) -> String {
    let of = |wanted: Verdict| -> Vec<&str> {
        lines.iter().filter(|line| line.verdict == wanted).map(|line| line.what).collect()
    };
    let (failed, notes) = (of(Verdict::Fail), of(Verdict::Note));
    if !failed.is_empty() {
        return format!("NO GO: {} of {} checks failed: {}", failed.len(), lines.len(), failed.join(", "));
    }
    let judged = if notes.is_empty() { String::new() } else { format!("; for you to judge: {}", notes.join(", ")) };
    format!("GO: nothing failed{judged}")
}

/// Writes the page; never over another one.
pub fn page(path: &Path, port: &str, when: &str, signed: Option<&str>, lines: &[CheckLine]) -> anyhow::Result<()> {
    let said = verdict(lines);
    let mut report = Report::new("Before the launch", format!("{said}. Board at {port}, {when} UTC."));
    if said.starts_with("NO") {
        report = report.alarm("NO GO");
    }
    // what failed first, then what is to be judged
    let mut table = Table::new("Checks", &["check", "verdict", "found"]);
    for wanted in [Verdict::Fail, Verdict::Note, Verdict::Pass] {
        for line in lines.iter().filter(|line| line.verdict == wanted) {
            table = table.row(line.cells());
        }
    }
    let name = signed.unwrap_or("______________________");
    let command = backseat_analysis::provenance::command();
    let html = report
        .table(table)
        .text(&format!("Signed off by: {name}"))
        .provenance(Provenance { command: &command, seed: None, version: env!("CARGO_PKG_VERSION") })
        .html();
    output::write(path, Existing::Keep, |file| file.write_all(html.as_bytes()))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_failure_is_no_go_and_stands_first() {
        let mut lines = vec![
            CheckLine::new(Verdict::Pass, "telemetry", "10 a second"),
            CheckLine::new(Verdict::Note, "mission", "none"),
        ];
        assert_eq!(verdict(&lines), "GO: nothing failed; for you to judge: mission");
        lines.push(CheckLine::new(Verdict::Fail, "PPS", "never came"));
        assert_eq!(verdict(&lines), "NO GO: 1 of 3 checks failed: PPS");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("launch.html");
        page(&path, "/dev/ttyACM0", "2026-11-20 12:00", Some("A. Engineer"), &lines).unwrap();
        let html = std::fs::read_to_string(&path).unwrap();
        assert!(html.contains(">NO GO</p>") && html.contains("Signed off by: A. Engineer"), "{html}");
        assert!(html.find("never came").unwrap() < html.find("10 a second").unwrap());
        assert!(page(&path, "x", "y", None, &lines).is_err(), "never overwritten");
    }
}
