//! Whole lines into a new file, so that an interrupted run leaves a readable one.

use super::decimal;
use crate::DataError;
use flate2::Compression;
use flate2::write::GzEncoder;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Bytes collected before they go to the file.
const BLOCK: usize = 1 << 16;
/// Longest time a line waits for the file.
const MAX_DELAY: Duration = Duration::from_secs(1);

enum Output {
    Plain(File),
    Gzip(GzEncoder<File>),
}

/// A text file that grows by whole lines. It refuses a file that exists, and hands its lines over
/// in blocks or after a second, never in the middle of a line.
pub(super) struct LineSink {
    path: PathBuf,
    output: Output,
    block: Vec<u8>,
    last: Instant,
}

impl LineSink {
    /// A new table of a time and these columns, compressed if its name ends in `.gz`.
    pub(super) fn table<'a>(path: &Path, names: impl IntoIterator<Item = &'a str>) -> Result<Self, DataError> {
        let mut sink = Self::create(path)?;
        let names: Vec<&str> = std::iter::once("t_s").chain(names).collect();
        sink.line(|line| line.extend_from_slice(names.join(",").as_bytes()))?;
        Ok(sink)
    }

    /// Appends the cells of one time, each a number and its decimals.
    pub(super) fn row(
        &mut self,
        time_us: u64,
        cells: impl Iterator<Item = Option<(f64, usize)>>,
    ) -> Result<(), DataError> {
        self.line(|line| {
            decimal::push_seconds(line, time_us);
            for cell in cells {
                line.push(b',');
                if let Some((value, decimals)) = cell {
                    decimal::push_number(line, value, decimals);
                }
            }
        })
    }

    fn create(path: &Path) -> Result<Self, DataError> {
        let file = OpenOptions::new().write(true).create_new(true).open(path).map_err(|e| DataError::io(path, &e))?;
        let output = if path.extension().is_some_and(|extension| extension == "gz") {
            Output::Gzip(GzEncoder::new(file, Compression::fast()))
        } else {
            Output::Plain(file)
        };
        Ok(Self { path: path.to_owned(), output, block: Vec::with_capacity(BLOCK + 1024), last: Instant::now() })
    }

    /// Appends one line (without its end) by `fill`.
    fn line(&mut self, fill: impl FnOnce(&mut Vec<u8>)) -> Result<(), DataError> {
        fill(&mut self.block);
        self.block.push(b'\n');
        if self.block.len() >= BLOCK || self.last.elapsed() >= MAX_DELAY {
            self.flush()?;
        }
        Ok(())
    }

    /// Hands everything over to the operating system.
    pub(super) fn flush(&mut self) -> Result<(), DataError> {
        let Self { path, output, block, last } = self;
        if block.is_empty() {
            return Ok(());
        }
        let result = match output {
            Output::Plain(file) => file.write_all(block),
            Output::Gzip(encoder) => encoder.write_all(block).and_then(|()| encoder.flush()),
        };
        // After a failure the block is dropped as well: writing it again could double its first part.
        block.clear();
        *last = Instant::now();
        result.map_err(|e| DataError::io(path, &e))
    }

    /// Writes what is left and closes the file.
    pub(super) fn finish(mut self) -> Result<(), DataError> {
        self.flush()?;
        match &mut self.output {
            Output::Plain(_) => Ok(()),
            Output::Gzip(encoder) => encoder.try_finish().map_err(|e| DataError::io(&self.path, &e)),
        }
    }
}

impl Drop for LineSink {
    fn drop(&mut self) {
        // An error cannot be reported here; after `finish` there is nothing to write.
        let _ = self.flush();
    }
}
