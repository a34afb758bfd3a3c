//! What a command says, in place of a result, of a log that contradicts physics.

use crate::read_log::{ReadLog, finding};
use backseat_logs::log::plausibility::Finding;
use backseat_report::Report;
use serde_json::{Value, json};

/// The refusal of a command; `None` of a log that nothing speaks against.
#[must_use]
pub fn of(read: &ReadLog, command: &str) -> Option<Report> {
    let found: Vec<&Finding> = read.examination.suspicions().collect();
    if found.is_empty() {
        return None;
    }
    let file = read.log.path.display();
    let word = backseat_report::word(&read.log.path);
    let reasons: Vec<String> = found.iter().map(|finding| finding.message.clone()).collect();
    let answer = format!("{file}: refused, for it contradicts physics. Nothing was computed or written");
    let next = format!(
        "`backseat info {word}{}` shows the whole examination. The lines that mend, written to MAP.toml, are a mapping: \
         --columns MAP.toml reads the log by them. --force goes on with it as it is.",
        read.options
    );
    let report = Report::new(format!("{command} of {file}"), answer).warnings(&reasons).section("Next").text(&next);
    Some(
        report
            .value("refused", true)
            .value("verdict", "implausible")
            .value("trust", "suspicious")
            .value("effects", json!([]))
            .value("findings", found.into_iter().map(finding).collect::<Vec<Value>>()),
    )
}
