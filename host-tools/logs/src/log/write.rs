//! Writing a vehicle log, row by row.

use super::sink::LineSink;
use super::{Column, LogRow, decimal};
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
        let mut sink = LineSink::create(path)?;
        sink.line(|line| {
            line.extend_from_slice(b"t_s");
            for column in columns {
                line.push(b',');
                line.extend_from_slice(column.name().as_bytes());
            }
        })?;
        Ok(Self { sink, columns: columns.to_vec() })
    }

    /// Appends one row; samples of columns that this log does not have are left out.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&mut self, row: &LogRow) -> Result<(), DataError> {
        let Self { sink, columns } = self;
        sink.line(|line| {
            decimal::push_seconds(line, row.time_us);
            for &column in columns.iter() {
                line.push(b',');
                if let Some(value) = row.get(column) {
                    decimal::push_number(line, value, column.decimals());
                }
            }
        })
    }

    /// Writes what is left and closes the file.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(self) -> Result<(), DataError> {
        self.sink.finish()
    }
}
