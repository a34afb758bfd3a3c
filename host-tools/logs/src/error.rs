//! One error for everything that is read or written: where, and what was expected.

use std::fmt::{self, Write};
use std::path::{Path, PathBuf};

/// A message with the first of these hints whose words stand in it. Errors say what is wrong and what is needed; how that
/// is given (an option, an argument) says whoever shows them.
#[must_use]
pub fn with_hint(message: String, hints: &[(&str, &str)]) -> String {
    match hints.iter().find(|(words, _)| message.contains(words)) {
        Some((_, hint)) => format!("{message} ({hint})"),
        None => message,
    }
}

/// What was wrong with a file, in one line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct DataError {
    /// The file.
    pub path: PathBuf,
    /// Line, from 1; 0 where the file as a whole is meant.
    pub line: u64,
    /// Column of the text (TOML) or of the table (CSV), from 1; 0 where the whole line is meant.
    pub column: u64,
    /// What is wrong and what was expected.
    pub message: String,
}

impl DataError {
    /// An error about a file as a whole.
    pub fn file(path: &Path, message: impl Into<String>) -> Self {
        Self { path: path.to_owned(), line: 0, column: 0, message: message.into() }
    }

    /// An error at a line and column (0: unknown).
    pub fn at(path: &Path, line: u64, column: u64, message: impl Into<String>) -> Self {
        Self { path: path.to_owned(), line, column, message: message.into() }
    }

    /// An input or output error of the operating system.
    pub fn io(path: &Path, error: &std::io::Error) -> Self {
        Self::file(path, error.to_string())
    }
}

impl fmt::Display for DataError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", self.path.display())?;
        if self.line > 0 {
            write!(f, "{}:", self.line)?;
            if self.column > 0 {
                write!(f, "{}:", self.column)?;
            }
        }
        f.write_str(" ")?;
        // a message may quote the file, whatever stands in it
        self.message
            .chars()
            .try_for_each(|c| if c.is_control() { write!(f, "{}", c.escape_default()) } else { f.write_char(c) })
    }
}
