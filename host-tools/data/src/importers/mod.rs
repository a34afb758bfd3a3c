//! Logs of other makers, read into a vehicle log.

mod calendar;
mod iver_uvc;

use crate::{DataError, Log};
use std::io::{BufRead, BufReader};
use std::path::Path;

/// A log and how it was understood.
#[derive(Clone, Debug)]
pub struct Imported {
    /// Name of the format.
    pub format: &'static str,
    /// The log; its notes say what was recognised and what was dropped, and why.
    pub log: Log,
}

/// Reads a vehicle log or any format that is known, told apart by the header line.
///
/// # Errors
/// As the reader of the format; a file of no known format is read as a vehicle log.
pub fn read(path: &Path) -> Result<Imported, DataError> {
    let mut header = String::new();
    // A header that is no text leads to the vehicle log's own complaint.
    let _ = BufReader::new(crate::log::table::open(path)?).read_line(&mut header);
    match iver_uvc::Dialect::of(&header) {
        Some(dialect) => Ok(Imported { format: dialect.name(), log: iver_uvc::read(path, dialect)? }),
        None => Ok(Imported { format: "vehicle log", log: Log::read(path)? }),
    }
}
