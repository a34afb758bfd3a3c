//! Writing a vehicle log, row by row.

use super::sink::LineSink;
use super::{Column, LogRow};
use crate::DataError;
use std::path::Path;

/// Writes a vehicle log (`.csv`, or `.csv.gz` by its name) row by row.
///
/// The file must not exist yet. Rows reach it in whole lines and at least once a second, so what an
/// interrupted run leaves is readable up to the interruption.
pub struct LogWriter {
    sink: LineSink,
    columns: Vec<Column>,
}

impl LogWriter {
    /// A new log with the standard columns.
    ///
    /// # Errors
    /// If the file exists or cannot be created.
    pub fn create(path: &Path) -> Result<Self, DataError> {
        Self::with_columns(path, Column::STANDARD)
    }

    /// A new log with these columns (the time comes first in any case).
    ///
    /// # Errors
    /// If the file exists or cannot be created.
    pub fn with_columns(path: &Path, columns: &[Column]) -> Result<Self, DataError> {
        let sink = LineSink::table(path, columns.iter().map(|column| column.name()))?;
        Ok(Self { sink, columns: columns.to_vec() })
    }

    /// Appends one row; samples of columns that this log does not have are left out.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&mut self, row: &LogRow) -> Result<(), DataError> {
        let Self { sink, columns } = self;
        sink.row(row.time_us, columns.iter().map(|column| Some((row.get(*column)?, column.decimals()))))
    }

    /// Writes what is left and closes the file.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(self) -> Result<(), DataError> {
        self.sink.finish()
    }
}
