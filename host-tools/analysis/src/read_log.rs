//! How every command reads a log: by its own format or by a column mapping, examined for units, signs and times.

use crate::settings_file;
use backseat_logs::importers::{self, ColumnMap, Imported};
use backseat_logs::log::plausibility::{Examination, Finding, Severity};
use backseat_logs::{DataError, Log};
use serde_json::{Value, json};
use std::path::Path;
use std::time::Instant;

/// A log, how it was understood, and what is doubtful about it.
#[derive(Clone)]
pub struct ReadLog {
    /// Name of its format.
    pub format: &'static str,
    /// The log; its notes are those of the reader and, after them, the findings.
    pub log: Log,
    /// What the reader recognised, assumed and left out.
    pub reader_notes: Vec<String>,
    /// Ranges, rates and what contradicts units and signs.
    pub examination: Examination,
    /// The options by which it was read, each with a space before it, for the next command.
    pub options: String,
    /// Time taken to read and examine it, s.
    pub read_s: f64,
}

impl ReadLog {
    /// Reads and examines a log by its own format, or by a column mapping.
    ///
    /// # Errors
    /// The log or the mapping cannot be read.
    pub fn of(path: &Path, map: Option<&Path>) -> Result<Self, DataError> {
        let began = Instant::now();
        let imported = match map {
            Some(map) => importers::read_mapped(path, &ColumnMap::read(map)?)?,
            None => importers::read(path).map_err(|error| match settings_file::instead_of_log(path) {
                Some(what) => DataError::file(path, what),
                None => error,
            })?,
        };
        let mut read = Self::new(imported);
        read.options = map.map_or_else(String::new, |map| format!(" --columns {}", backseat_report::word(map)));
        read.read_s = began.elapsed().as_secs_f64();
        Ok(read)
    }

    /// Examines a log.
    pub fn new(imported: Imported) -> Self {
        let examination = Examination::of(&imported.log);
        let reader_notes = imported.log.notes.clone();
        Self {
            format: imported.format,
            log: imported.log,
            reader_notes,
            examination,
            options: String::new(),
            read_s: 0.0,
        }
    }

    /// Adds the findings to the notes of the log, as every command does before its work.
    pub fn note_findings(&mut self) {
        self.log.notes.extend(self.examination.findings.iter().map(|finding| finding.message.clone()));
    }
}

/// The name of a log, for a title.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| "log".to_owned(), |name| name.to_string_lossy().into_owned())
}

/// A finding for a script.
pub(crate) fn finding(finding: &Finding) -> Value {
    json!({
        "column": finding.column.map(|column| column.name()),
        "suspicious": finding.severity == Severity::Suspicious,
        "message": finding.message,
        "what": finding.what,
        "evidence": finding.evidence,
        "mend": finding.mend,
        "alternatives": finding.alternatives,
    })
}
