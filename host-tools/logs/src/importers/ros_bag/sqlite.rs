//! Rows of a table of an SQLite file, read only, page by page: what a bag in `.db3` needs of the file format
//! (sqlite.org/fileformat2). SQLite itself would add its C sources to every build.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;

/// The beginning of every such file.
const MAGIC: &[u8] = b"SQLite format 3\0";
/// Longest row, bytes: a picture of a camera is a few megabytes.
const MAX_ROW: usize = 1 << 28;

/// Whether the beginning of a file is that of an SQLite file.
pub(super) fn is_sqlite(beginning: &[u8]) -> bool {
    beginning.starts_with(MAGIC)
}

/// An open file.
pub(super) struct Database {
    file: File,
    page_size: usize,
    /// Bytes of a page that are used.
    usable: usize,
    pages: u32,
}

/// A row, with as much of it as stands in its page.
pub(super) struct Row {
    /// The number of the row, which a column that is `INTEGER PRIMARY KEY` has for its value.
    pub id: i64,
    length: usize,
    local: Vec<u8>,
    overflow: u32,
}

/// A value of a row.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Null,
    Integer(i64),
    Real(f64),
    Bytes(Vec<u8>),
}

/// A table: its first page and the names of its columns.
pub(super) struct Table {
    root: u32,
    columns: Vec<String>,
}

impl Table {
    /// Where a column stands in a row.
    pub(super) fn place(&self, column: &str) -> Result<usize, String> {
        let place = self.columns.iter().position(|name| name == column);
        place.ok_or_else(|| format!("no column {column}; found: {}", self.columns.join(", ")))
    }
}

impl Value {
    pub(super) fn integer(&self) -> Option<i64> {
        if let Self::Integer(value) = self { Some(*value) } else { None }
    }

    pub(super) fn text(&self) -> Option<String> {
        if let Self::Bytes(text) = self { Some(String::from_utf8_lossy(text).into_owned()) } else { None }
    }
}

impl Database {
    pub(super) fn open(path: &Path) -> Result<Self, String> {
        let mut file = File::open(path).map_err(|e| e.to_string())?;
        let mut header = [0; 100];
        file.read_exact(&mut header).map_err(|_| "shorter than the header of an SQLite file".to_owned())?;
        if !is_sqlite(&header) {
            return Err("not an SQLite file".to_owned());
        }
        let page_size = match u16::from_be_bytes([header[16], header[17]]) {
            1 => 1 << 16,
            size => usize::from(size),
        };
        if !page_size.is_power_of_two() || page_size < 512 {
            return Err(format!("byte 16: pages of {page_size} bytes; expected a power of two from 512 to 65536"));
        }
        if u32::from_be_bytes([header[56], header[57], header[58], header[59]]) > 1 {
            return Err("byte 56: texts in UTF-16; expected UTF-8".to_owned());
        }
        let length = file.metadata().map_err(|e| e.to_string())?.len();
        let pages = u32::try_from(length / page_size as u64).unwrap_or(u32::MAX);
        Ok(Self { file, page_size, usable: page_size - usize::from(header[20]), pages })
    }

    /// A table by its name.
    pub(super) fn table(&mut self, wanted: &str) -> Result<Option<Table>, String> {
        let mut found = None;
        self.rows(1, &mut |database, row| {
            // type, name, name of the table, first page, statement that made it
            if let [kind, name, _, root, statement] = &database.values(row, 5)?[..]
                && kind.text().as_deref() == Some("table")
                && name.text().as_deref() == Some(wanted)
            {
                let root = root.integer().and_then(|root| u32::try_from(root).ok()).unwrap_or(0);
                found = Some(Table { root, columns: columns(&statement.text().unwrap_or_default()) });
            }
            Ok(())
        })?;
        Ok(found)
    }

    /// Hands over every row of a table.
    pub(super) fn table_rows(
        &mut self,
        table: &Table,
        each: &mut dyn FnMut(&mut Self, &Row) -> Result<(), String>,
    ) -> Result<(), String> {
        self.rows(table.root, each)
    }

    fn page(&mut self, number: u32) -> Result<Vec<u8>, String> {
        let at = u64::from(number.saturating_sub(1)) * self.page_size as u64;
        let mut page = vec![0; self.page_size];
        let broken = |_| format!("page {number} (byte {at}): not in the file, which was cut off or is broken");
        self.file.seek(SeekFrom::Start(at)).map_err(|e| e.to_string())?;
        self.file.read_exact(&mut page).map_err(broken)?;
        Ok(page)
    }

    fn rows(&mut self, root: u32, each: &mut dyn FnMut(&mut Self, &Row) -> Result<(), String>) -> Result<(), String> {
        let mut waiting = vec![root];
        let mut visited = 0;
        while let Some(number) = waiting.pop() {
            visited += 1;
            if visited > self.pages {
                return Err(format!("page {number}: reached twice; the file is broken"));
            }
            let page = self.page(number)?;
            let broken = || format!("page {number}: broken");
            // the first page begins with the file's header
            let head = if number == 1 { 100 } else { 0 };
            let kind = *page.get(head).ok_or_else(broken)?;
            let count = usize::from(short(&page, head + 3).ok_or_else(broken)?);
            let cells = head + if kind == 5 { 12 } else { 8 };
            match kind {
                5 => {
                    let mut below = vec![long(&page, head + 8).ok_or_else(broken)?];
                    for cell in (0..count).rev() {
                        let at = usize::from(short(&page, cells + 2 * cell).ok_or_else(broken)?);
                        below.push(long(&page, at).ok_or_else(broken)?);
                    }
                    waiting.extend(below);
                }
                13 => {
                    for cell in 0..count {
                        let at = usize::from(short(&page, cells + 2 * cell).ok_or_else(broken)?);
                        let row = self.row(&page, at).ok_or_else(broken)?;
                        each(self, &row)?;
                    }
                }
                _ => return Err(format!("page {number}: of kind {kind}; expected a table's, 5 or 13")),
            }
        }
        Ok(())
    }

    /// The row at a place of a page.
    fn row(&self, page: &[u8], at: usize) -> Option<Row> {
        let (length, at) = varint(page, at)?;
        let (id, at) = varint(page, at)?;
        let length = usize::try_from(length).ok().filter(|length| *length <= MAX_ROW)?;
        let (usable, most) = (self.usable, self.usable.checked_sub(35)?);
        if length <= most {
            return Some(Row { id, length, local: page.get(at..at + length)?.to_vec(), overflow: 0 });
        }
        let least = (usable - 12) * 32 / 255 - 23;
        let kept = least + (length - least) % (usable - 4);
        let kept = if kept <= most { kept } else { least };
        Some(Row { id, length, local: page.get(at..at + kept)?.to_vec(), overflow: long(page, at + kept)? })
    }

    /// The first values of a row; those that stand in its page are had without reading others.
    pub(super) fn values(&mut self, row: &Row, count: usize) -> Result<Vec<Value>, String> {
        let broken = || format!("row {}: broken", row.id);
        let (head, mut at) = varint(&row.local, 0).ok_or_else(broken)?;
        let (mut kinds, mut end) = (Vec::new(), usize::try_from(head).map_err(|_| broken())?);
        while at < head as usize && kinds.len() < count {
            let (kind, next) = varint(&row.local, at).ok_or_else(broken)?;
            let size = match kind {
                0 | 8 | 9 => 0,
                1..=4 => kind as usize,
                5 => 6,
                6 | 7 => 8,
                12.. => (kind as usize - 12) / 2,
                _ => return Err(broken()),
            };
            kinds.push((kind, end, size));
            (at, end) = (next, end.checked_add(size).filter(|end| *end <= row.length).ok_or_else(broken)?);
        }
        let whole = if end <= row.local.len() { None } else { Some(self.payload(row)?) };
        let bytes = whole.as_ref().unwrap_or(&row.local);
        let value = |(kind, at, size): (i64, usize, usize)| {
            let bytes = bytes.get(at..at + size)?;
            let negative = bytes.first().is_some_and(|first| *first >= 0x80);
            let integer =
                || bytes.iter().fold(if negative { -1_i64 } else { 0 }, |value, byte| value << 8 | i64::from(*byte));
            Some(match kind {
                0 => Value::Null,
                1..=6 => Value::Integer(integer()),
                7 => Value::Real(f64::from_be_bytes(bytes.try_into().ok()?)),
                8 | 9 => Value::Integer(kind - 8),
                _ => Value::Bytes(bytes.to_vec()),
            })
        };
        kinds.into_iter().map(|kind| value(kind).ok_or_else(broken)).collect()
    }

    /// A row with what of it stands in other pages.
    fn payload(&mut self, row: &Row) -> Result<Vec<u8>, String> {
        let mut bytes = row.local.clone();
        let mut next = row.overflow;
        while bytes.len() < row.length {
            if next == 0 {
                return Err(format!("row {}: ends after {} of {} bytes", row.id, bytes.len(), row.length));
            }
            let page = self.page(next)?;
            next = long(&page, 0).unwrap_or(0);
            let part = (row.length - bytes.len()).min(self.usable - 4);
            bytes.extend(page.get(4..4 + part).unwrap_or_default());
        }
        Ok(bytes)
    }
}

/// Names of the columns in a statement that makes a table.
fn columns(statement: &str) -> Vec<String> {
    let inside =
        statement.split_once('(').map_or("", |(_, rest)| rest.rsplit_once(')').map_or(rest, |(inside, _)| inside));
    let name = |column: &str| {
        column.split_whitespace().next().unwrap_or_default().trim_matches(['"', '`', '[', ']']).to_owned()
    };
    inside.split(',').map(name).collect()
}

fn short(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_be_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn long(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_be_bytes(*bytes.get(at..)?.first_chunk()?))
}

/// A number of one to nine bytes, and where it ends.
fn varint(bytes: &[u8], at: usize) -> Option<(i64, usize)> {
    let mut value: i64 = 0;
    for count in 0..9 {
        let byte = *bytes.get(at + count)?;
        if count == 8 {
            return Some((value << 8 | i64::from(byte), at + 9));
        }
        value = value << 7 | i64::from(byte & 0x7f);
        if byte < 0x80 {
            return Some((value, at + count + 1));
        }
    }
    None
}
