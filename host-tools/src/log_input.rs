//! How every command reads a log: by its own format or by a column mapping, examined for units, signs and times.

use anyhow::bail;
use backseat_logs::importers::{self, ColumnMap, Imported};
use backseat_logs::log::plausibility::Examination;
use backseat_logs::{DataError, Log};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// How a log is to be read.
#[derive(clap::Args)]
pub struct LogInput {
    /// Column mapping for a table of another maker: `[time]` with column, unit (s, ms, us, min, h, hms) and base (start
    /// or epoch), and for each column of the vehicle log, such as `[columns.depth_m]`, its column, unit, sign, scale,
    /// offset. For the commands in a ROS 2 bag the same with topics as columns
    #[arg(long = "columns", value_name = "MAP.toml")]
    map: Option<PathBuf>,
    /// Refuse a log whose units, signs or times look wrong, instead of warning
    #[arg(long)]
    strict: bool,
}

/// A log, how it was understood, and what is doubtful about it.
pub struct ReadLog {
    /// Name of its format.
    pub format: &'static str,
    /// The log; its notes are those of the reader and, after them, the findings.
    pub log: Log,
    /// What the reader recognised, assumed and left out.
    pub reader_notes: Vec<String>,
    /// Ranges, rates and what contradicts units and signs.
    pub examination: Examination,
    /// Time taken to read and examine it, s.
    pub read_s: f64,
}

impl LogInput {
    /// A log by its own format, or by a mapping.
    pub const fn new(map: Option<PathBuf>) -> Self {
        Self { map, strict: false }
    }

    /// Reads and examines a log; says on stderr what is doubtful.
    ///
    /// # Errors
    /// The log or the mapping cannot be read; with `--strict`, the log is suspicious.
    pub fn read(&self, path: &Path) -> anyhow::Result<ReadLog> {
        let mut read = self.examine(path)?;
        for finding in &read.examination.findings {
            eprintln!("warning: {}: {}", path.display(), finding.message);
        }
        read.note_findings();
        if let Some(first) = read.examination.suspicions().next().filter(|_| self.strict) {
            bail!("{}: {} (refused by --strict)", path.display(), first.message);
        }
        Ok(read)
    }

    /// Reads and examines a log, and says nothing.
    ///
    /// # Errors
    /// The log or the mapping cannot be read.
    pub fn examine(&self, path: &Path) -> Result<ReadLog, DataError> {
        let began = Instant::now();
        let imported = match &self.map {
            Some(map) => importers::read_mapped(path, &ColumnMap::read(map)?)?,
            None => importers::read(path)?,
        };
        let mut read = ReadLog::new(imported);
        read.read_s = began.elapsed().as_secs_f64();
        Ok(read)
    }

    /// Whether the log is one of a mapping.
    pub const fn is_mapped(&self) -> bool {
        self.map.is_some()
    }

    /// Whether a suspicious log is an error.
    pub const fn is_strict(&self) -> bool {
        self.strict
    }
}

impl ReadLog {
    /// Examines a log.
    pub fn new(imported: Imported) -> Self {
        let examination = Examination::of(&imported.log);
        let reader_notes = imported.log.notes.clone();
        Self { format: imported.format, log: imported.log, reader_notes, examination, read_s: 0.0 }
    }

    /// Adds the findings to the notes of the log, as every command does before its work.
    pub fn note_findings(&mut self) {
        self.log.notes.extend(self.examination.findings.iter().map(|finding| finding.message.clone()));
    }

    /// Does the work; if that fails, says what the reader recognised and left out, which is often why.
    ///
    /// # Errors
    /// Those of the work.
    pub fn explain_failure<T>(&self, work: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<T> {
        work().inspect_err(|_| self.reader_notes.iter().for_each(|note| eprintln!("note: {note}")))
    }
}
