//! A draft of the column mapping of another maker's table: `backseat map`.

use backseat_logs::importers::Draft;
use backseat_report::Report;
use serde_json::{Map, json};
use std::path::Path;

/// The report on a draft that was written to `out`.
pub fn report(draft: &Draft, table: &Path, out: Option<&Path>) -> Report {
    let counts = format!("{} columns guessed, {} not used", draft.guesses.len(), draft.unused.len());
    let guesses = draft.guesses.iter().map(|(column, guess)| (column.clone(), json!(guess)));
    let report = Report::new(
        format!("Mapping of {}", table.display()),
        out.map_or(counts.clone(), |out| format!("{counts}: {}", out.display())),
    );
    let report = match out {
        Some(out) => report.section("Next").text("Read it, then:").command(&format!(
            "backseat info {} --columns {}",
            table.display(),
            out.display()
        )),
        None => report,
    };
    report
        .value("map", draft.text.clone())
        .value("guesses", guesses.collect::<Map<_, _>>())
        .value("unused", draft.unused.clone())
        .value("out", json!(out))
}
