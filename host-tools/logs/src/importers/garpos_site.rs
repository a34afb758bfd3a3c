//! The site file of GARPOS (repository s-watanabe-jhod/garpos): places of the transponders on the seabed, beside the
//! observation file, which is a table.
//!
//! A place is `M11_dPos = east north up ...`, metres about the site's origin; `dCentPos` moves all of them together.

use super::Imported;
use crate::DataError;
use crate::log::{Column, Log, LogRow, table};
use std::io::Read;
use std::path::Path;

/// Name of the format.
pub(super) const NAME: &str = "GARPOS site file";
/// Ends the name of a transponder's place.
const PLACE: &str = "_dPos";
/// Longest file, bytes; the published ones have 1.3 kB.
const MAX_BYTES: u64 = 1 << 20;

/// Whether this is a site file's first line.
pub(super) fn is_one(first_line: &str) -> bool {
    first_line.trim() == "[Obs-parameter]"
}

/// Reads the places.
pub(super) fn read(path: &Path) -> Result<Imported, DataError> {
    let mut text = String::new();
    table::open_lines(path)?.take(MAX_BYTES).read_to_string(&mut text).map_err(|e| DataError::io(path, &e))?;
    let entries = || {
        text.lines().enumerate().filter_map(|(index, line)| {
            let (name, values) = line.split_once('=')?;
            Some((index as u64 + 1, name.trim(), values.trim()))
        })
    };
    let moved = entries().find(|(_, name, _)| *name == "dCentPos");
    let moved_m = moved.map_or(Ok([0.0; 3]), |(line, name, values)| place_m(path, line, name, values))?;
    let mut log = Log { path: path.to_owned(), ..Log::default() };
    let mut used = Vec::new();
    for (line, name, values) in entries() {
        let Some(station) = name.strip_suffix(PLACE) else { continue };
        let digits: String = station.chars().filter(char::is_ascii_digit).collect();
        let complaint = || DataError::at(path, line, 1, format!("{station:?} holds no number, such as M11"));
        let number: f64 = digits.parse().map_err(|_| complaint())?;
        let place_m = place_m(path, line, name, values)?;
        let [east, north, up] = [0, 1, 2].map(|axis| place_m[axis] + moved_m[axis]);
        let mut row = LogRow::new(0);
        row.set(Column::Station, number).set_all(Column::StationX, &[north, east, -up]);
        log.rows.push(row);
        used.push(name);
    }
    if log.rows.is_empty() {
        return Err(DataError::file(path, format!("{NAME} without a place, such as M11_dPos = east north up")));
    }
    log.notes.push(format!("{NAME}; recognised: {}", used.join(", ")));
    log.notes.push("dropped the uncertainties (the places are fitted without a prior)".to_owned());
    if let Some((_, _, arm)) = entries().find(|(_, name, _)| *name == "ATDoffset") {
        let arm: Vec<&str> = arm.split_whitespace().take(3).collect();
        log.notes.push(format!(
            "dropped ATDoffset, the transducer seen from the antenna, {} m forward, right, down: it belongs into a vehicle \
             file, [installation] transducer_arm_m",
            arm.join(", ")
        ));
    }
    Ok(Imported { format: NAME, log })
}

/// East, north, up, m.
fn place_m(path: &Path, line: u64, name: &str, values: &str) -> Result<[f64; 3], DataError> {
    let mut numbers = values.split_whitespace().map(str::parse::<f64>);
    let mut place_m = [0.0; 3];
    for (axis, place_m) in ["east", "north", "up"].into_iter().zip(&mut place_m) {
        match numbers.next() {
            Some(Ok(value)) if value.is_finite() => *place_m = value,
            _ => return Err(DataError::at(path, line, 1, format!("{name}: expected east, north, up in m, no {axis}"))),
        }
    }
    Ok(place_m)
}
