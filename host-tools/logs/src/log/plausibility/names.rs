//! Columns that were left out because their names are almost those of known columns, and fins that are missing.

use super::{Finding, Severity};
use crate::log::{Column, Log};

/// Letters by which a name may differ from that of a column, or be turned round, and still be meant for it.
const LETTERS: usize = 2;
/// What the name of a fin may hold.
const FIN_WORDS: [&str; 7] = ["fin", "rudder", "elevator", "plane", "servo", "stern", "flap"];
const FINS: [Column; 4] = [Column::FinTop, Column::FinBottom, Column::FinPort, Column::FinStarboard];

pub(super) fn check(log: &Log) -> Vec<Finding> {
    let mut findings: Vec<Finding> = log.unused_columns.iter().filter_map(|name| misspelt(log, name)).collect();
    findings.extend(missing_fins(log));
    findings
}

/// A name that is nearly that of a column which the log does not have.
fn misspelt(log: &Log, name: &str) -> Option<Finding> {
    let given = name.trim().to_lowercase();
    let near = Column::ALL
        .into_iter()
        .filter(|column| !log.has(*column))
        .map(|column| (strsim::damerau_levenshtein(column.name(), &given), column))
        // a letter in four, and never the first of a short name: p_radps and q_radps are two columns
        .filter(|(letters, column)| {
            let is_short = column.name().len() <= 4 * LETTERS;
            *letters <= if is_short { 1 } else { LETTERS } && (!is_short || given.starts_with(&column.name()[..1]))
        })
        .min_by_key(|(letters, _)| *letters)?
        .1;
    let message = format!("column {name} is not read; is it {}?", near.name());
    let line = format!("columns.{} = {{ column = {:?} }}", near.name(), name);
    Some(Finding::suspicious(near, message).mended_by(line))
}

/// A vehicle with some of its fins is read as one without.
fn missing_fins(log: &Log) -> Option<Finding> {
    let (present, missing): (Vec<Column>, Vec<Column>) = FINS.into_iter().partition(|fin| log.has(*fin));
    if present.is_empty() || missing.is_empty() {
        return None;
    }
    let names = |columns: &[Column]| columns.iter().map(|column| column.name()).collect::<Vec<_>>().join(", ");
    let unused = match log.unused_columns.as_slice() {
        [] => String::new(),
        unused => format!("; columns that are not read: {}", unused.join(", ")),
    };
    let message = format!(
        "the log has {} but not {}: its fins are of no use without{unused}. Fins that do not exist need a column of zeros \
         ([constants] of a mapping)",
        names(&present),
        names(&missing)
    );
    let finding = Finding::new(Severity::Suspicious, Some(missing[0]), message);
    let near = |fin: &Column| {
        let likeness = |name: &&String| strsim::jaro_winkler(fin.name(), &name.to_lowercase());
        let words = |name: &&String| FIN_WORDS.iter().any(|word| name.to_lowercase().contains(word));
        let nearest = log.unused_columns.iter().filter(words).max_by(|a, b| likeness(a).total_cmp(&likeness(b)))?;
        Some(format!("columns.{} = {{ column = {nearest:?} }}", fin.name()))
    };
    // one name for each, or none
    let lines: Vec<String> = missing.iter().filter_map(near).collect();
    Some(if missing.len() == 1 && lines.len() == 1 { finding.mended_by(lines[0].clone()) } else { finding })
}
