//! A draft of the column mapping of another maker's table: `backseat map`.

use backseat_logs::importers::Draft;
use backseat_report::Report;
use serde_json::{Map, json};
use std::path::Path;

/// The report on a draft that was written to `out`.
pub fn report(draft: &Draft, table: &Path, out: Option<&Path>) -> Report {
    let counts = format!(
        "{} columns guessed, {} entries to check, {} columns not used",
        draft.guesses.len(),
        draft.checks.len(),
        draft.unused.len()
    );
    let object = |pairs: &[(String, String)]| -> Map<_, _> {
        pairs.iter().map(|(name, what)| (name.clone(), json!(what))).collect()
    };
    let mut report = Report::new(
        format!("Mapping of {}", table.display()),
        out.map_or(counts.clone(), |out| format!("{counts}: {}", out.display())),
    )
    .warnings(&draft.doubts);
    for change in &draft.changes {
        report = report.note(&format!("the first guess contradicted physics and was changed: {change}"));
    }
    for (entry, why) in &draft.checks {
        report = report.note(&if why.is_empty() { format!("check {entry}") } else { format!("check {entry}: {why}") });
    }
    if let Some(out) = out {
        report = report.section("Next").text("Read it, then:").command(&format!(
            "backseat info {} --columns {}",
            backseat_report::word(table),
            backseat_report::word(out)
        ));
    }
    report
        .value("map", draft.text.clone())
        .value("guesses", object(&draft.guesses))
        .value("checks", object(&draft.checks))
        .value("changes", draft.changes.clone())
        .value("doubts", draft.doubts.clone())
        .value("unused", draft.unused.clone())
        .value("out", json!(out.map(|out| out.display().to_string())))
}
