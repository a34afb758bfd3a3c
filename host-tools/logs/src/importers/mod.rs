//! Logs of other makers, read into a vehicle log.
//!
//! A format is a table of names and roles (`format`, `formats.toml`), read by one engine; the header line identifies it.
//! What is not known here is read by a column mapping that the user writes ([`ColumnMap`]).

mod alog;
mod calendar;
mod dataflash;
mod draft;
mod engine;
mod format;
mod formats;
#[cfg(test)]
mod formats_tests;
mod garpos_site;
mod iver_control;
mod line_time;
mod lsf;
mod mapping;
mod mavlink;
mod message_tables;
mod messages;
mod origin;
mod pd0_file;
mod ros_bag;
mod sentences;
mod signals;
mod ulog;

pub use draft::{Draft, draft};
pub use mapping::ColumnMap;
pub use ros_bag::is_bag;

use crate::log::{mat, table};
use crate::{DataError, Log, kinds};
use format::Format;
use formats::FORMATS;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// North and east of a place about an origin, both as latitude and longitude in degrees, m.
#[must_use]
pub fn local_m(origin_deg: [f64; 2], [latitude_deg, longitude_deg]: [f64; 2]) -> [f64; 2] {
    origin::Origin::new(origin_deg[0], origin_deg[1]).local_m(latitude_deg, longitude_deg)
}

/// North and east at a time between two fixes less than half a minute apart, m; the fixes in order of time, µs.
#[must_use]
pub fn place_between(fixes: &[(i64, [f64; 2])], time_us: i64) -> Option<[f64; 2]> {
    let after = fixes.partition_point(|(fix_us, _)| *fix_us < time_us);
    let [(from_us, from), (to_us, to)] = fixes.get(after.checked_sub(1)?..=after)? else { return None };
    let share = (time_us - from_us) as f64 / (to_us - from_us) as f64;
    (to_us - from_us < 30_000_000).then(|| [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis])))
}

/// A log and how it was understood.
#[derive(Clone, Debug)]
pub struct Imported {
    /// Name of the format.
    pub format: &'static str,
    /// The log; its notes say what was recognised and what was dropped, and why.
    pub log: Log,
}

/// Reads a vehicle log or any known format, identified by its header line.
///
/// # Errors
/// As the reader of the format; a file of no known format is read as a vehicle log. Of what is no log: what it is.
pub fn read(path: &Path) -> Result<Imported, DataError> {
    let instead = |error| kinds::instead(path, error);
    match other_than_table(path).map_err(instead)? {
        Some((_, read)) => read(path, None),
        None => read_table(path).map_err(instead),
    }
}

fn read_table(path: &Path) -> Result<Imported, DataError> {
    let header = header(path)?;
    check_text(path, &header)?;
    let has =
        |name: &String, separator: u8| header.trim().split(char::from(separator)).any(|cell| unquoted(cell) == *name);
    let separator_of = |(names, format): &'static (Vec<String>, Format)| {
        let fits = |separator: &u8| names.iter().all(|name| has(name, *separator));
        format.separators.iter().copied().find(fits).map(|separator| (format, separator))
    };
    match FORMATS.iter().find_map(separator_of) {
        Some((format, separator)) => {
            let cells = engine::Cells { separator, missing: &[] };
            noted(path, Imported { format: &format.name, log: engine::read(path, format, cells)? })
        }
        None => noted(path, Imported { format: "vehicle log", log: Log::read(path)? }),
    }
}

/// A table's log, with what is said of the file that the table was made from.
fn noted(path: &Path, mut imported: Imported) -> Result<Imported, DataError> {
    if mat::is_mat(&beginning(path)?) {
        imported.log.notes.extend(mat::read(path)?.notes);
    }
    Ok(imported)
}

type Reader = fn(&Path, Option<&ColumnMap>) -> Result<Imported, DataError>;

/// Longest binary log, unpacked, bytes: a day of an autopilot is a tenth of it.
const MAX_BYTES: u64 = 2 << 30;

/// Name and reader of a format that is no table of columns; `None`: a table, or nothing that is known.
fn other_than_table(path: &Path) -> Result<Option<(&'static str, Reader)>, DataError> {
    if iver_control::is_one(path) {
        return Ok(Some((iver_control::NAME, |path, map| unmapped(path, map, iver_control::read))));
    }
    if path.is_dir() && !ros_bag::is_any_bag(path, &[]) {
        let message = "a folder without a ROS 2 bag (.mcap or .db3) in it; name the file of a log";
        return Err(DataError::file(path, message));
    }
    let beginning = beginning(path)?;
    if is_bag(&beginning) == Some(false) {
        let message = "a session, not a table: export it as CSV, and give the vehicle_log.csv of that";
        return Err(DataError::file(path, message));
    }
    if ros_bag::is_any_bag(path, &beginning) {
        return Ok(Some((ros_bag::NAME, ros_bag::read)));
    }
    // logs of messages, which may be compressed
    let unpacked = first_bytes(table::open_bytes(path)?);
    let binary: [(bool, &'static str, Reader); 5] = [
        (dataflash::is_dataflash(&unpacked), dataflash::NAME, dataflash::read),
        (ulog::is_ulog(&unpacked), ulog::NAME, ulog::read),
        (mavlink::is_tlog(&unpacked), mavlink::NAME, mavlink::read),
        (lsf::is_lsf(&unpacked), lsf::NAME, lsf::read),
        (pd0_file::is_pd0(&beginning), pd0_file::NAME, |path, map| unmapped(path, map, pd0_file::read)),
    ];
    if let Some((_, name, reader)) = binary.into_iter().find(|(is_this, ..)| *is_this) {
        return Ok(Some((name, reader)));
    }
    if alog::is_alog(&first_lines(path)?) {
        return Ok(Some((alog::NAME, alog::read)));
    }
    if garpos_site::is_one(&header(path)?) {
        return Ok(Some((garpos_site::NAME, |path, map| unmapped(path, map, garpos_site::read))));
    }
    let sentences: Reader = |path, map| unmapped(path, map, sentences::read);
    Ok(sentences::is_sentences(path)?.then_some((sentences::NAME, sentences)))
}

/// Reads a format that has nothing to name.
fn unmapped(
    path: &Path,
    map: Option<&ColumnMap>,
    read: fn(&Path) -> Result<Imported, DataError>,
) -> Result<Imported, DataError> {
    match map {
        Some(_) => Err(DataError::file(path, "its numbers have fixed meanings: it takes no mapping of columns")),
        None => read(path),
    }
}

/// A binary log as a whole, unpacked.
fn whole(path: &Path) -> Result<Vec<u8>, DataError> {
    let mut bytes = Vec::new();
    // what comes before a fault of a compressed file is read
    let _ = table::open_bytes(path)?.take(MAX_BYTES + 1).read_to_end(&mut bytes);
    if bytes.len() as u64 > MAX_BYTES {
        return Err(DataError::file(path, format!("more than {} GiB, unpacked; split the file", MAX_BYTES >> 30)));
    }
    Ok(bytes)
}

/// What begins a file.
fn first_bytes(from: impl Read) -> Vec<u8> {
    let mut bytes = Vec::new();
    let _ = from.take(64).read_to_end(&mut bytes);
    bytes
}

/// The first bytes as they stand in the file.
fn beginning(path: &Path) -> Result<Vec<u8>, DataError> {
    Ok(first_bytes(kinds::open(path)?))
}

/// Far longer than any header.
const LONGEST_HEADER: u64 = 1 << 16;

/// What a text begins with.
fn first_lines(path: &Path) -> Result<String, DataError> {
    let mut bytes = Vec::new();
    // what cannot be read leads to the complaint of a reader
    let _ = table::open_lines(path)?.take(LONGEST_HEADER).read_to_end(&mut bytes);
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// The first line with anything in it; empty if it cannot be read, which leads to the vehicle log's own complaint.
fn header(path: &Path) -> Result<String, DataError> {
    let mut lines = BufReader::new(table::open(path)?.take(LONGEST_HEADER));
    let mut header = Vec::new();
    while header.trim_ascii().is_empty() {
        header.clear();
        if !lines.read_until(b'\n', &mut header).is_ok_and(|count| count > 0) {
            break;
        }
    }
    Ok(String::from_utf8_lossy(&header).into_owned())
}

/// A cell of a header without its quotation marks.
fn unquoted(cell: &str) -> &str {
    cell.trim().trim_matches('"').trim()
}

/// Whether a header is one of a text, whose beginning may be shown.
fn check_text(path: &Path, header: &str) -> Result<(), DataError> {
    if !header.contains(|c: char| c.is_control() && !"\t\r\n".contains(c)) {
        return Ok(());
    }
    let message = "binary data of no known format, not a log: docs/guide/log_format.md lists those that are read; export a \
                   table as CSV";
    Err(DataError::file(path, message))
}

/// Reads a table by a mapping, whatever its header; of a log of messages, such as a ROS 2 bag, what it has by itself
/// and the numbers that the mapping names.
///
/// # Errors
/// Where the file does not fit the mapping.
pub fn read_mapped(path: &Path, map: &ColumnMap) -> Result<Imported, DataError> {
    let instead = |error| kinds::instead(path, error);
    if let Some((_, read)) = other_than_table(path).map_err(instead)? {
        return read(path, Some(map));
    }
    let header = header(path)?;
    let names: Vec<&str> = header.trim().split(char::from(map.cells().separator)).map(unquoted).collect();
    let completed = (!map.has_time()).then(|| map.beside(&names));
    let map = completed.as_ref().unwrap_or(map);
    map.check_table()?;
    let mut log = engine::read(path, map.format(), map.cells()).map_err(instead)?;
    (log.sources, log.time_column) = (Some(map.sources()), map.time_column());
    noted(path, Imported { format: mapping::NAME, log })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of this content, in a folder that is there as long as it is held.
    pub(super) fn written(content: impl AsRef<[u8]>) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mission.log");
        std::fs::write(&path, content).unwrap();
        (folder, path)
    }

    /// What becomes of a file of this content.
    pub(super) fn import(content: impl AsRef<[u8]>) -> Result<Imported, DataError> {
        read(&written(content).1)
    }

    /// The same by a mapping.
    pub(super) fn import_mapped(content: impl AsRef<[u8]>, map: &str) -> Result<Imported, DataError> {
        let map = ColumnMap::parse(map, Path::new("map.toml")).unwrap_or_else(|e| panic!("{e}\n{map}"));
        read_mapped(&written(content).1, &map)
    }

    /// What is binary never reaches the terminal.
    #[test]
    fn what_is_no_text_is_told() {
        let complaint = import("PK\u{3}\u{4}\u{1b}[2J;sheet1.xml").unwrap_err().to_string();
        assert!(
            complaint.contains("the workbook of a spreadsheet, not a log: unpack it, or save the table as CSV"),
            "{complaint}"
        );
        let complaint = import("\u{89}PNG\r\u{1a}\n1,2\n").unwrap_err().to_string();
        assert!(complaint.contains("binary data of no known format, not a log"), "{complaint}");
    }

    #[test]
    fn formats_are_told_by_their_own_names() {
        for (names, format) in FORMATS.iter() {
            for name in names {
                let is_bound = format.columns.iter().any(|known| known.name == *name);
                let is_dropped = format.dropped.iter().any(|(part, _)| part == name);
                assert!(is_bound || is_dropped, "{}: {name}", format.name);
            }
        }
    }
}
