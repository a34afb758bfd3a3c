//! A draft of a column mapping for a table that nobody described: names and ranges of its columns, guesses, and what the
//! tests of columns say of them.

mod entry;
mod messages;
mod names;
mod seen;
mod text;

use super::{ColumnMap, read_mapped};
use crate::DataError;
use crate::log::Log;
use crate::log::plausibility::Examination;
use crate::log::table::{self, Records};
use csv::{ReaderBuilder, Trim};
use entry::{Entry, Frames};
use seen::Seen;
use std::path::Path;
use text::Parts;

/// Rows that are looked at for names and units.
const ROWS: usize = 20_000;
/// Mistakes that are mended one after the other.
const ROUNDS: usize = 3;

/// A drafted mapping.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Draft {
    /// The mapping, TOML with comments.
    pub text: String,
    /// Columns of the table, and what they were taken for.
    pub guesses: Vec<(String, String)>,
    /// Columns that nothing was guessed for.
    pub unused: Vec<String>,
    /// Entries that are to be checked, and why.
    pub checks: Vec<(String, String)>,
    /// What the tests of columns changed in the first guess.
    pub changes: Vec<String>,
    /// What speaks against the draft as it stands.
    pub doubts: Vec<String>,
}

/// Drafts a mapping from the header and the rows of a table; of a log of messages, one of what mends it.
///
/// # Errors
/// A file that cannot be read, or that needs none.
pub fn draft(path: &Path) -> Result<Draft, DataError> {
    draft_of(path).map_err(|error| crate::kinds::instead(path, error))
}

fn draft_of(path: &Path) -> Result<Draft, DataError> {
    if let Some((name, read)) = super::other_than_table(path)? {
        if let Some(draft) = messages::draft(path, &read(path, None)?) {
            return Ok(draft);
        }
        let message = format!("{name}: needs no mapping of its columns, it is read as it is");
        return Err(DataError::file(path, message));
    }
    super::check_text(path, &super::header(path)?)?;
    let separator = separator(path)?;
    let columns = look(path, separator)?;
    let time = columns.iter().enumerate().find_map(|(place, column)| Some((place, column.time_unit()?)));
    let frames = Frames::of(&columns);
    let quaternion = quaternion(&columns);
    let mut used: Vec<usize> = time.iter().map(|(place, _)| *place).collect();
    used.extend(quaternion.into_iter().flatten());
    let (mut entries, counts) = entry::entries(&columns, &used, &frames);
    if quaternion.is_some() {
        entries.retain(|entry| !["roll_rad", "pitch_rad", "heading_rad"].contains(&entry.target));
    }
    let (mut changes, mut doubts) = (Vec::new(), Vec::new());
    let parts = |entries: &[Entry]| {
        let (columns, frames, counts, entries) = (&columns[..], &frames, &counts[..], entries.to_vec());
        Parts { path, separator, columns, time, frames, quaternion, entries, counts }
    };
    if time.is_none() {
        doubts.push("the draft does not read the table yet: no column looks like a time; name it in [time]".to_owned());
        return Ok(parts(&entries).draft(changes, doubts));
    }
    let mut rounds = 0..ROUNDS - 1;
    loop {
        match examined(path, &parts(&entries).text()) {
            Ok(found) => {
                let changed = rounds.next().map_or_else(Vec::new, |_| entry::mend(&mut entries, &found));
                if changed.is_empty() {
                    doubts.extend(found.suspicions().map(|finding| finding.message.clone()));
                    entry::confirm(&mut entries, &found);
                    break;
                }
                changes.extend(changed);
            }
            // one column that does not read is no reason to read none
            Err(error) => match leave_out(&columns, &mut entries, &error) {
                Some(name) => doubts.push(format!("{name:?} is left out, it does not read: {error}")),
                None => {
                    doubts.push(format!("the draft does not read the table yet: {error}"));
                    break;
                }
            },
        }
    }
    Ok(parts(&entries).draft(changes, doubts))
}

/// Takes out the entries of the column that an error is about; its name, if there were any.
fn leave_out(columns: &[Seen], entries: &mut Vec<Entry>, error: &DataError) -> Option<String> {
    let place = usize::try_from(error.column).ok()?.checked_sub(1)?;
    let name = columns.get(place)?.name.clone();
    let before = entries.len();
    entries.retain(|entry| columns[entry.place].name != name);
    // half of a position is none
    let has = |entries: &[Entry], target: &str| entries.iter().any(|entry| entry.target == target);
    if has(entries, "latitude_deg") != has(entries, "longitude_deg") {
        entries.retain(|entry| !["latitude_deg", "longitude_deg"].contains(&entry.target));
    }
    (entries.len() < before).then_some(name)
}

/// The tests of columns on the table as a draft reads it.
fn examined(path: &Path, text: &str) -> Result<Examination, DataError> {
    let map = ColumnMap::parse(text, Path::new("the draft"))?;
    // the draft mends columns of the log, whatever they are called in the table
    let log = Log { sources: None, ..read_mapped(path, &map)?.log };
    Ok(Examination::of(&log))
}

/// The columns by the header and the first rows.
fn look(path: &Path, separator: u8) -> Result<Vec<Seen>, DataError> {
    let mut records = Records::open(path, ReaderBuilder::new().delimiter(separator).trim(Trim::All))?;
    let Some(line) = records.advance()? else {
        return Err(DataError::file(path, "the file is empty; expected a header line with the names of the columns"));
    };
    let record = &records.record;
    let mut columns: Vec<Seen> = record.iter().map(|cell| Seen::new(&String::from_utf8_lossy(cell))).collect();
    if columns.len() < 2 {
        let message = "no table: expected columns separated by a comma, a semicolon or a tab, not by blanks";
        return Err(DataError::at(path, line, 0, message));
    }
    let is_number = |cell: &[u8]| table::number_between(separator, cell).is_ok_and(|value| !value.is_nan());
    if record.iter().filter(|cell| is_number(cell)).count() * 2 > record.len() {
        let message = "numbers, where the names of the columns are expected: write a line of names in front, as in \
                       t_s,depth_m,heading_rad";
        return Err(DataError::at(path, line, 0, message));
    }
    for _ in 0..ROWS {
        if records.advance()?.is_none() {
            break;
        }
        for (column, cell) in columns.iter_mut().zip(&records.record) {
            column.add(separator, cell);
        }
    }
    Ok(columns)
}

/// The separator that the header has most often.
fn separator(path: &Path) -> Result<u8, DataError> {
    let header = super::header(path)?;
    let count = |separator: &u8| header.bytes().filter(|byte| byte == separator).count();
    Ok(*b",;\t".iter().max_by_key(|separator| count(separator)).unwrap_or(&b','))
}

/// The four columns of a quaternion, w first, of a table without a heading.
fn quaternion(columns: &[Seen]) -> Option<[usize; 4]> {
    let has_heading = columns.iter().any(|column| column.target() == Some("heading_rad"));
    let place = |part| columns.iter().position(|column| column.quaternion_part() == Some(part) && column.is_number());
    if has_heading { None } else { Some([place(0)?, place(1)?, place(2)?, place(3)?]) }
}

#[cfg(test)]
mod tests;
