//! Logs of other makers, read into a vehicle log.
//!
//! A format is a table of names and roles (`format`), read by one engine; the header line identifies the format. What
//! is not known here is read by a column mapping that the user writes ([`ColumnMap`]).

mod alog;
mod calendar;
mod draft;
mod engine;
mod format;
mod glider;
mod iver_control;
mod iver_uvc;
mod lake;
mod line_time;
mod mapping;
mod messages;
mod origin;
mod pd0_file;
mod pinger;
mod ros_bag;
mod runs;
mod sentences;
mod transponders;

pub use draft::{Draft, draft};
pub use mapping::ColumnMap;
pub use ros_bag::is_bag;

use crate::{DataError, Log};
use format::Format;
use std::f64::consts::PI;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

const RAD_PER_DEG: f64 = PI / 180.0;

/// Formats by names of their headers that no other has.
static FORMATS: [(&[&str], &Format); 12] = [
    (&["Latitude", "Longitude"], &iver_uvc::NATIVE),
    (&["heading_true_deg", "speed_log_mps"], &iver_uvc::RENAMED),
    (&["t_rx_s"], &pinger::FORMAT),
    (&["yaw_enu_rad"], &lake::FORMAT),
    (&["ballast_cc", "battpos_in"], &glider::FLIGHT),
    (&["density_kgm3"], &glider::SCIENCE),
    (&["twtt_s", "transponder"], &transponders::RANGES),
    (&["name", "up_m"], &transponders::PLACES),
    (&["gt_yaw_rad", "dvl_x_mps"], &runs::DVL_INS),
    (&["v_mid_mps", "rudder_rad"], &runs::SHIP),
    (&["wind_true_from_rad"], &runs::SHIP_WIND),
    (&["cmd_left", "cmd_right"], &runs::THRUSTERS),
];

/// North and east of a place about an origin, both as latitude and longitude in degrees, m.
#[must_use]
pub fn local_m(origin_deg: [f64; 2], [latitude_deg, longitude_deg]: [f64; 2]) -> [f64; 2] {
    origin::Origin::new(origin_deg[0], origin_deg[1]).local_m(latitude_deg, longitude_deg)
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
/// As the reader of the format; a file of no known format is read as a vehicle log.
pub fn read(path: &Path) -> Result<Imported, DataError> {
    if let Some((_, read)) = other_than_table(path)? {
        return read(path);
    }
    let header = header(path)?;
    check_text(path, &header)?;
    let has =
        |name: &&str, separator: u8| header.trim().split(char::from(separator)).any(|cell| unquoted(cell) == *name);
    let separator_of = |(names, format): &(&[&str], &'static Format)| {
        let fits = |separator: &u8| names.iter().all(|name| has(name, *separator));
        format.separators.iter().copied().find(fits).map(|separator| (*format, separator))
    };
    match FORMATS.iter().find_map(separator_of) {
        Some((format, separator)) => {
            let cells = engine::Cells { separator, missing: &[] };
            Ok(Imported { format: format.name, log: engine::read(path, format, cells)? })
        }
        None => Ok(Imported { format: "vehicle log", log: Log::read(path)? }),
    }
}

type Reader = fn(&Path) -> Result<Imported, DataError>;

/// Name and reader of a format that is no table of columns; `None`: a table, or nothing that is known.
fn other_than_table(path: &Path) -> Result<Option<(&'static str, Reader)>, DataError> {
    if iver_control::is_one(path) {
        return Ok(Some((iver_control::NAME, iver_control::read)));
    }
    let beginning = beginning(path)?;
    Ok(match is_bag(&beginning) {
        Some(true) => Some((ros_bag::NAME, ros_bag::read)),
        Some(false) => {
            let message = "a session, not a table: first `backseat export FILE --csv DIR`, then DIR/vehicle_log.csv";
            return Err(DataError::file(path, message));
        }
        None if alog::is_alog(&header(path)?) => Some((alog::NAME, alog::read)),
        None if pd0_file::is_pd0(&beginning) => Some((pd0_file::NAME, pd0_file::read)),
        None if sentences::is_sentences(path)? => Some((sentences::NAME, sentences::read)),
        None => None,
    })
}

/// The first bytes as they stand in the file.
fn beginning(path: &Path) -> Result<Vec<u8>, DataError> {
    let mut beginning = Vec::new();
    let file = File::open(path).map_err(|e| DataError::io(path, &e))?;
    let _ = file.take(64).read_to_end(&mut beginning);
    Ok(beginning)
}

/// The first line; empty if it cannot be read, which leads to the vehicle log's own complaint.
fn header(path: &Path) -> Result<String, DataError> {
    /// Far longer than any header.
    const LONGEST_HEADER: u64 = 1 << 16;
    let mut header = Vec::new();
    let _ = BufReader::new(crate::log::table::open(path)?.take(LONGEST_HEADER)).read_until(b'\n', &mut header);
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
    let what = if header.starts_with("PK") {
        "an archive or the workbook of a spreadsheet: save the table as CSV"
    } else {
        "binary data, not a table"
    };
    Err(DataError::file(path, what))
}

/// Reads a table by a mapping, whatever its header; of a ROS 2 bag what it has by itself, and the numbers that the
/// mapping names.
///
/// # Errors
/// Where the file does not fit the mapping.
pub fn read_mapped(path: &Path, map: &ColumnMap) -> Result<Imported, DataError> {
    if is_bag(&beginning(path)?) == Some(true) {
        return ros_bag::read_mapped(path, map);
    }
    map.check_time()?;
    Ok(Imported { format: mapping::NAME, log: engine::read(path, map.format(), map.cells())? })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What becomes of a file of this content.
    pub(super) fn import(text: &str) -> Result<Imported, DataError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mission.log");
        std::fs::write(&path, text).unwrap();
        read(&path)
    }

    /// What is binary never reaches the terminal.
    #[test]
    fn what_is_no_text_is_told() {
        let complaint = import("PK\u{3}\u{4}\u{1b}[2J;sheet1.xml").unwrap_err().to_string();
        assert!(complaint.contains("the workbook of a spreadsheet: save the table as CSV"), "{complaint}");
        let complaint = import("\u{89}PNG\r\u{1a}\n1,2\n").unwrap_err().to_string();
        assert!(complaint.contains("binary data, not a table"), "{complaint}");
    }

    #[test]
    fn formats_are_told_by_their_own_names() {
        for (names, format) in &FORMATS {
            for name in *names {
                let is_bound = format.columns.iter().any(|known| known.name == *name);
                assert!(is_bound, "{}: {name}", format.name);
            }
        }
    }
}
