//! The options by which every command reads a log.

use anyhow::bail;
use backseat_analysis::read_log::ReadLog;
use std::path::{Path, PathBuf};

/// How a log is to be read.
#[derive(clap::Args)]
pub struct LogInput {
    /// Column mapping for a table of another maker: `[time]` with column, unit (s, ms, us, min, h, hms) and base (start
    /// or epoch), and for each column of the vehicle log, such as `[columns.depth_m]`, its column, unit, sign, scale,
    /// offset. In a log of messages (ROS 2 bag, MOOS, LSTS, ArduPilot, MAVLink, PX4) the same with their numbers as
    /// columns, such as RCOU.C1
    #[arg(long = "columns", value_name = "MAP.toml")]
    map: Option<PathBuf>,
    /// Refuse a log whose units, signs or times look wrong, instead of warning
    #[arg(long)]
    strict: bool,
}

impl LogInput {
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
    pub fn examine(&self, path: &Path) -> anyhow::Result<ReadLog> {
        Ok(ReadLog::of(path, self.map.as_deref())?)
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

/// Does the work; if that fails, says what the reader recognised and left out, which is often why.
///
/// # Errors
/// Those of the work.
pub fn explain_failure<T>(read: &ReadLog, work: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<T> {
    work().inspect_err(|_| read.reader_notes.iter().for_each(|note| eprintln!("note: {note}")))
}
