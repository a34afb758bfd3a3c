//! MATLAB's MAT-files (versions 5 to 7) as a table: every real numeric vector is a column, a matrix several
//! (`pose_1`, `pose_2`), a field of a structure one with its path (`nav.depth`). Columns of one length make the table.
//!
//! After "MAT-File Format" of The MathWorks. Version 7.3 is HDF5, which the feature `hdf5` reads, and with it any other
//! HDF5 file of arrays.

#[cfg(feature = "hdf5")]
mod hdf5;
#[cfg(not(feature = "hdf5"))]
mod hdf5 {
    /// Says what to do instead.
    pub(super) fn read(_: Vec<u8>, _: &mut super::Arrays) -> Result<(), String> {
        let by_us = "the archives and the wheel of a release read it; a build of one's own with `--features hdf5`";
        Err(format!("a MAT-file of version 7.3 (HDF5): save it in MATLAB by save(..., '-v7'); {by_us}"))
    }
}

use super::layout;
use crate::DataError;
use flate2::read::ZlibDecoder;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{self, Read};
use std::path::Path;

/// Longest content, unpacked, bytes.
const MAX_BYTES: u64 = 1 << 30;
/// Most columns that a matrix makes.
const MAX_WIDTH: usize = 64;
/// Deepest structure.
const MAX_DEPTH: usize = 8;
/// Most elements that are gone through, so that a broken file ends.
const MAX_ELEMENTS: usize = 100_000;

/// Types of data elements that hold others.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Types of data elements that hold numbers, and their letters.
const CODES: [(u32, u8); 10] =
    [(1, b'b'), (2, b'B'), (3, b'h'), (4, b'H'), (5, b'i'), (6, b'I'), (7, b'f'), (9, b'd'), (12, b'q'), (13, b'Q')];
/// Class of a structure; 6 to 15 are numeric.
const STRUCTURE: u32 = 2;

/// Whether the beginning of a file is that of a MAT-file, of version 7.3 as well.
pub(crate) fn is_mat(beginning: &[u8]) -> bool {
    beginning.starts_with(b"MATLAB 5.0 MAT-file") || is_hdf5(beginning)
}

fn is_hdf5(beginning: &[u8]) -> bool {
    beginning.starts_with(b"MATLAB 7.") || beginning.starts_with(b"\x89HDF\r\n\x1a\n")
}

/// A table as text, made line by line.
pub(crate) struct MatTable {
    columns: Vec<(String, Vec<f64>)>,
    rows: usize,
    row: usize,
    text: Vec<u8>,
    at: usize,
    /// What is no part of the table, and why.
    pub notes: Vec<String>,
}

/// Reads the arrays of a file.
pub(crate) fn read(path: &Path) -> Result<MatTable, DataError> {
    let mut bytes = Vec::new();
    let file = crate::kinds::open(path)?;
    file.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(|e| DataError::io(path, &e))?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(DataError::file(path, format!("more than {} GiB: split it", MAX_BYTES >> 30)));
    }
    let is_big_endian = bytes.get(126..128) == Some(b"MI");
    let mut arrays = Arrays { is_big_endian, left: MAX_BYTES, elements: 0, found: Vec::new(), other: Vec::new() };
    let mut notes = Vec::new();
    let mut at = 128;
    if is_hdf5(&bytes) {
        at = bytes.len();
        hdf5::read(bytes.clone(), &mut arrays).map_err(|message| DataError::file(path, message))?;
    }
    while at < bytes.len() {
        match arrays.element(&bytes, at) {
            Some((kind, content, next)) => {
                arrays.top(kind, content);
                // an element in one piece with the next, but for compressed ones, begins at a multiple of eight
                at = if kind == COMPRESSED { next } else { next.next_multiple_of(8) };
            }
            None => {
                notes.push(format!("byte {at}: no whole element; the rest is left out"));
                break;
            }
        }
    }
    table(arrays)
        .map_err(|message| DataError::file(path, message))
        .map(|table| MatTable { notes: [notes, table.notes].concat(), ..table })
}

/// The largest group of columns of one length.
fn table(arrays: Arrays) -> Result<MatTable, String> {
    let mut groups: BTreeMap<usize, Vec<(String, Vec<f64>)>> = BTreeMap::new();
    let mut names = Vec::new();
    for (name, values) in arrays.found {
        names.push(format!("{name} ({})", values.len()));
        groups.entry(values.len()).or_default().push((name, values));
    }
    let is_more = |(length, columns): &(&usize, &Vec<_>)| (columns.len(), **length);
    let length = groups.iter().filter(|(length, columns)| **length > 1 && columns.len() > 1).max_by_key(is_more);
    let Some(rows) = length.map(|(length, _)| *length) else {
        let found = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        return Err(format!("no vectors of one length, a time and what was measured; numeric arrays: {found}"));
    };
    let mut columns = groups.remove(&rows).unwrap_or_default();
    // what all share says nothing
    let shared = columns.first().and_then(|(name, _)| Some(name.rsplit_once('.')?.0.to_owned() + "."));
    if let Some(shared) = shared.filter(|shared| columns.iter().all(|(name, _)| name.starts_with(shared.as_str()))) {
        columns.iter_mut().for_each(|(name, _)| *name = name[shared.len()..].to_owned());
    }
    let mut notes = vec![format!("a MAT-file; its {} vectors of {rows} are the table", columns.len())];
    let others: Vec<String> = groups
        .iter()
        .flat_map(|(rows, columns)| columns.iter().map(move |(name, _)| format!("{name} ({rows})")))
        .collect();
    for (what, names) in [("arrays of other lengths", others), ("what is no array of real numbers", arrays.other)] {
        if !names.is_empty() {
            notes.push(format!("left out {}: {what}", names.join(", ")));
        }
    }
    let header = columns.iter().map(|(name, _)| format!("\"{name}\"")).collect::<Vec<_>>().join(",") + "\n";
    Ok(MatTable { columns, rows, row: 0, text: header.into_bytes(), at: 0, notes })
}

impl Read for MatTable {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.at == self.text.len() && self.row < self.rows {
            let mut line = String::new();
            for (place, (_, values)) in self.columns.iter().enumerate() {
                line.push_str(if place > 0 { "," } else { "" });
                if let Some(value) = values.get(self.row).filter(|value| value.is_finite()) {
                    let _ = write!(line, "{value}");
                }
            }
            line.push('\n');
            (self.text, self.at, self.row) = (line.into_bytes(), 0, self.row + 1);
        }
        let rest = self.text.get(self.at..).unwrap_or_default();
        let count = rest.len().min(buffer.len());
        buffer[..count].copy_from_slice(&rest[..count]);
        self.at += count;
        Ok(count)
    }
}

/// Arrays as they are found.
struct Arrays {
    is_big_endian: bool,
    /// Bytes that may still be unpacked.
    left: u64,
    elements: usize,
    found: Vec<(String, Vec<f64>)>,
    /// Names of what is no numeric array.
    other: Vec<String>,
}

impl Arrays {
    fn word(&self, bytes: &[u8], at: usize) -> Option<u32> {
        let word = *bytes.get(at..)?.first_chunk()?;
        Some(if self.is_big_endian { u32::from_be_bytes(word) } else { u32::from_le_bytes(word) })
    }

    /// Type and content of the element at a place, and where it ends.
    fn element<'a>(&mut self, bytes: &'a [u8], at: usize) -> Option<(u32, &'a [u8], usize)> {
        self.elements += 1;
        if self.elements > MAX_ELEMENTS {
            return None;
        }
        let first = self.word(bytes, at)?;
        // short ones have their size beside their type, and four bytes of content
        if first >> 16 != 0 {
            let size = (first >> 16) as usize;
            return Some((first & 0xffff, bytes.get(at + 4..at + 4 + size.min(4))?, at + 8));
        }
        let size = self.word(bytes, at + 4)? as usize;
        Some((first, bytes.get(at + 8..)?.get(..size)?, at + 8 + size))
    }

    /// An element of the file itself.
    fn top(&mut self, kind: u32, content: &[u8]) {
        if kind == MATRIX {
            self.matrix("", content, 0);
        } else if kind == COMPRESSED {
            let mut unpacked = Vec::new();
            // what was unpacked before a fault is read, if it is a whole element
            let _ = ZlibDecoder::new(content).take(self.left).read_to_end(&mut unpacked);
            self.left -= unpacked.len() as u64;
            if let Some((MATRIX, content, _)) = self.element(&unpacked, 0) {
                self.matrix("", content, 0);
            }
        }
    }

    /// An array, of a name that its structure gives it or that it has itself.
    fn matrix(&mut self, given: &str, content: &[u8], depth: usize) -> Option<()> {
        let mut at = 0;
        let mut next = |arrays: &mut Self| {
            let (kind, part, end) = arrays.element(content, at)?;
            at = end.next_multiple_of(8);
            Some((kind, part))
        };
        let (_, flags) = next(self)?;
        let flags = self.word(flags, 0)?;
        let (_, sizes) = next(self)?;
        let (_, own) = next(self)?;
        let name = if given.is_empty() { text(own) } else { given.to_owned() };
        let sizes: Vec<usize> = (0..sizes.len() / 4).filter_map(|k| Some(self.word(sizes, 4 * k)? as usize)).collect();
        let &[rows, columns] = &sizes[..] else {
            self.other.push(name);
            return None;
        };
        let (class, is_complex) = (flags & 0xff, flags & 0x0800 != 0);
        if class == STRUCTURE && rows == 1 && columns == 1 && depth < MAX_DEPTH {
            let (_, length) = next(self)?;
            let length = self.word(length, 0)? as usize;
            let (_, names) = next(self)?;
            for field in names.chunks(length.max(1)) {
                let (kind, part) = next(self)?;
                if kind == MATRIX {
                    self.matrix(&format!("{name}.{}", text(field)), part, depth + 1);
                }
            }
            return Some(());
        }
        if !(6..=15).contains(&class) || is_complex {
            self.other.push(name);
            return None;
        }
        let (kind, data) = next(self)?;
        let values = self.numbers(kind, data)?;
        self.add(name, [rows, columns], &values);
        Some(())
    }

    /// A matrix, column by column as MATLAB keeps it.
    fn add(&mut self, name: String, [rows, columns]: [usize; 2], values: &[f64]) {
        let (length, width) = (rows.max(columns), rows.min(columns));
        if rows.checked_mul(columns) != Some(values.len()) || width > MAX_WIDTH {
            self.other.push(name);
            return;
        }
        for column in 0..width {
            let place = |k: usize| if rows >= columns { column * rows + k } else { k * rows + column };
            let one = (0..length).filter_map(|k| values.get(place(k)).copied()).collect();
            self.found.push((if width == 1 { name.clone() } else { format!("{name}_{}", column + 1) }, one));
        }
    }

    /// The numbers of an element, stored in whatever type holds them.
    fn numbers(&self, kind: u32, data: &[u8]) -> Option<Vec<f64>> {
        let (_, code) = CODES.iter().find(|(of, _)| *of == kind)?;
        let numbers = data.chunks_exact(layout::size(*code));
        numbers.map(|bytes| layout::number(*code, bytes, self.is_big_endian)).collect()
    }
}

/// A name, of the letters that names of MATLAB have.
fn text(bytes: &[u8]) -> String {
    bytes
        .iter()
        .take_while(|byte| **byte != 0)
        .filter(|b| b.is_ascii_alphanumeric() || **b == b'_')
        .map(|b| char::from(*b))
        .collect()
}
