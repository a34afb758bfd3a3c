//! A draft for a log of messages, which is read as it is: what mends it, and what else it has.

use super::seen::Seen;
use super::{Draft, examined};
use crate::importers::Imported;
use crate::log::Column;
use crate::log::plausibility::Examination;
use std::fmt::Write as _;
use std::path::Path;

/// What a vehicle is navigated by.
const NEEDED: [Column; 5] = [Column::Roll, Column::Pitch, Column::Heading, Column::Depth, Column::GpsX];

/// The draft; `None` where nothing contradicts what was read, and nothing needed is missing.
pub(super) fn draft(path: &Path, imported: &Imported) -> Option<Draft> {
    let log = &imported.log;
    let sources = log.sources.as_ref().filter(|sources| !sources.is_empty())?;
    let found = Examination::of(log);
    let lacks: Vec<&str> = NEEDED.iter().filter(|column| !log.has(**column)).map(|column| column.name()).collect();
    if !found.is_suspicious() && lacks.is_empty() {
        return None;
    }
    let mut text = format!(
        "# Column mapping of {}, a {}, which is read as it is: an entry takes the place of what is read by itself.\n",
        path.file_name().map_or_else(|| "a log".into(), |name| name.to_string_lossy()),
        imported.format
    );
    let (mut changes, mut targets) = (Vec::new(), Vec::new());
    for finding in found.suspicions() {
        let Some(lines) = &finding.mend else { continue };
        let own: Vec<&str> = lines.lines().filter_map(|line| line.split(" =").next()).collect();
        // a column has one entry
        if own.iter().any(|target| targets.contains(target)) {
            continue;
        }
        targets.extend(own);
        let _ = writeln!(text, "# changed: {}\n{lines}", finding.what);
        changes.push(finding.what.clone());
    }
    let doubts = if changes.is_empty() { Ok(found) } else { examined(path, &text) };
    let doubts = match doubts {
        Ok(found) => found.suspicions().map(|finding| finding.message.clone()).collect(),
        Err(error) => vec![error.to_string()],
    };
    if !lacks.is_empty() {
        let _ = writeln!(text, "# The log has no {}.", lacks.join(", "));
    }
    for name in &log.unread_numbers {
        let mut seen = Seen::new(name);
        // that it is a number is known, its size is not kept
        seen.add(b',', b"1");
        if let Some(target) = seen.target().filter(|target| lacks.contains(target)) {
            let _ = writeln!(text, "# check: by its name alone; remove the mark in front to use it, with its unit");
            let _ = writeln!(text, "# columns.{target} = {{ column = {name:?} }}");
        }
    }
    let level: Vec<Column> = [Column::Roll, Column::Pitch].into_iter().filter(|column| !log.has(*column)).collect();
    if !level.is_empty() {
        text += "# Of a vehicle that keeps level:\n# [constants]\n";
    }
    level.iter().for_each(|column| text += &format!("# {} = 0\n", column.name()));
    if !log.unread_numbers.is_empty() {
        text += "# Numbers that nothing was read from; an entry names one as its column:\n";
    }
    log.unread_numbers.iter().for_each(|name| text += &format!("#   {name}\n"));
    let guesses = sources.iter().map(|(column, source)| (source.name.clone(), column.name().to_owned())).collect();
    Some(Draft { text, guesses, unused: log.unread_numbers.clone(), checks: Vec::new(), changes, doubts })
}
