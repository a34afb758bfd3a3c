//! A CSV of a time and numbers, columns bound by name.

use super::decimal::{MAX_SECONDS, seconds_to_us};
use super::mat;
use crate::DataError;
use csv::{ByteRecord, ErrorKind, ReaderBuilder, Terminator};
use flate2::read::MultiGzDecoder;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// What a table may and must hold beside `t_s`.
pub(crate) struct Table<'a> {
    /// Names that are known.
    pub names: &'a [&'a str],
    /// Names that must be there; empty: any one of the known.
    pub required: &'a [&'a str],
    /// Added to the error when they are missing.
    pub hint: &'a str,
}

/// Opens a file, decompressing it if it is gzip (by its first bytes, not its name) and without a
/// byte-order mark; the arrays of a MAT-file as a table. Lines of comment at a text's beginning are blank, or the header.
pub(crate) fn open(path: &Path) -> Result<Box<dyn Read>, DataError> {
    open_with(path, Quote::Begin)
}

/// The same of a text that is no CSV: quotation marks mean nothing in it, and every line end ends a line.
pub(crate) fn open_lines(path: &Path) -> Result<Box<dyn Read>, DataError> {
    open_with(path, Quote::Meaningless)
}

fn open_with(path: &Path, quote: Quote) -> Result<Box<dyn Read>, DataError> {
    let mut text = open_bytes(path)?;
    let beginning = first(&mut text, 32).map_err(|e| csv_error(path, 1, &e.into()))?;
    if mat::is_mat(&beginning) {
        return Ok(Box::new(Bounded::new(mat::read(path)?, quote)));
    }
    let mut text = io::Cursor::new(beginning).chain(text);
    let mark = first(&mut text, 3).map_err(|e| csv_error(path, 1, &e.into()))?;
    let start = if mark == [0xef, 0xbb, 0xbf] { Vec::new() } else { mark };
    let whole = BufReader::new(io::Cursor::new(start).chain(text));
    let (beginning, rest) = without_comments(whole).map_err(|e| csv_error(path, 1, &e.into()))?;
    Ok(Box::new(Bounded::new(io::Cursor::new(beginning).chain(rest), quote)))
}

/// Longest line of comment, bytes.
const MAX_COMMENT: u64 = 1 << 16;

/// The beginning with blank lines in place of lines of comment (`#`, or `%` as MATLAB has it), so that the numbers of
/// lines hold. Where numbers follow, the last comment with as many cells has their names.
fn without_comments<R: BufRead>(mut text: R) -> io::Result<(Vec<u8>, R)> {
    let mut lines: Vec<Vec<u8>> = Vec::new();
    loop {
        let mut line = Vec::new();
        (&mut text).take(MAX_COMMENT).read_until(b'\n', &mut line)?;
        // two of them begin a log of MOOS
        let is_comment = line.starts_with(b"#") || (line.starts_with(b"%") && !line.starts_with(b"%%"));
        let is_whole = line.ends_with(b"\n");
        lines.push(line);
        if !is_comment || !is_whole {
            break;
        }
    }
    let Some((first, comments)) = lines.split_last().filter(|(_, comments)| !comments.is_empty()) else {
        return Ok((lines.concat(), text));
    };
    let cells = |line: &[u8]| line.iter().filter(|byte| b",;\t".contains(byte)).count();
    let is_number = |cell: &[u8]| number(cell.trim_ascii()).is_ok_and(|value| !value.is_nan());
    let has_numbers = first.split(|byte| b",;\t".contains(byte)).any(is_number);
    let header = comments.iter().rposition(|line| has_numbers && cells(line) > 0 && cells(line) == cells(first));
    let mut beginning = Vec::new();
    for (place, comment) in comments.iter().enumerate() {
        if Some(place) == header {
            let names = comment.iter().position(|byte| !b"#% ".contains(byte)).unwrap_or(0);
            beginning.extend_from_slice(&comment[names..]);
        } else {
            beginning.push(b'\n');
        }
    }
    beginning.extend_from_slice(first);
    Ok((beginning, text))
}

/// Opens a file that need not be text, decompressing it if it is gzip.
pub(crate) fn open_bytes(path: &Path) -> Result<Box<dyn Read>, DataError> {
    let mut file = crate::kinds::open(path)?;
    let magic = first(&mut file, 2).map_err(|e| DataError::io(path, &e))?;
    let is_gzip = magic == [0x1f, 0x8b];
    let whole = io::Cursor::new(magic).chain(file);
    Ok(if is_gzip { Box::new(MultiGzDecoder::new(whole)) } else { Box::new(whole) })
}

/// Longest record, bytes: a line, or more where a quoted cell holds line ends.
pub(crate) const MAX_RECORD: u64 = 1 << 20;
/// Longest text after decompression, bytes: 10 million rows of the widest log are a quarter of it.
pub(crate) const MAX_TEXT: u64 = 16 << 30;
/// Most columns.
pub(crate) const MAX_COLUMNS: usize = 4096;
/// Most rows.
pub(crate) const MAX_ROWS: u64 = 100_000_000;

/// A text whose size and records are bounded, whatever a file decompresses to.
struct Bounded<R> {
    inner: R,
    total: u64,
    record: u64,
    quote: Quote,
}

/// Where in a cell the reader is, as far as line ends depend on it.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Quote {
    /// At its begin: a quotation mark opens a quoted cell.
    Begin,
    /// In a cell without quotes.
    Plain,
    /// In quotes: a line end belongs to the cell.
    Open,
    /// After the closing mark, or after the first of a doubled one.
    Closed,
    /// In a text that is no CSV.
    Meaningless,
}

impl<R> Bounded<R> {
    fn new(inner: R, quote: Quote) -> Self {
        Self { inner, total: 0, record: 0, quote }
    }

    fn check(&mut self, bytes: &[u8]) -> Result<(), String> {
        self.total += bytes.len() as u64;
        if self.total > MAX_TEXT {
            return Err(format!("the text is longer than {} GiB, decompressed; split the file", MAX_TEXT >> 30));
        }
        for byte in bytes {
            self.record += 1;
            self.quote = match (byte, self.quote) {
                (_, Quote::Meaningless) => {
                    self.record = if *byte == b'\n' { 0 } else { self.record };
                    Quote::Meaningless
                }
                (b'"', Quote::Begin | Quote::Closed) => Quote::Open,
                (b'"', Quote::Open) => Quote::Closed,
                (_, Quote::Open) => Quote::Open,
                (b'\n', _) => {
                    self.record = 0;
                    Quote::Begin
                }
                (b',', _) => Quote::Begin,
                _ => Quote::Plain,
            };
            if self.record > MAX_RECORD {
                let quoted = if self.quote == Quote::Open { "; a quotation mark is not closed" } else { "" };
                return Err(format!("a line is longer than {} KiB{quoted}: not a table of numbers", MAX_RECORD >> 10));
            }
        }
        Ok(())
    }
}

impl<R: Read> Read for Bounded<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        let bytes = buffer.get(..count).unwrap_or_default();
        self.check(bytes).map_err(|why| io::Error::new(io::ErrorKind::InvalidData, why))?;
        Ok(count)
    }
}

/// Takes the first `count` bytes, fewer at the end.
fn first(reader: &mut impl Read, count: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    reader.take(count).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The records of a table, one after the other, without blank lines.
pub(crate) struct Records {
    path: PathBuf,
    reader: csv::Reader<Box<dyn Read>>,
    pub record: ByteRecord,
}

impl Records {
    /// Opens a table. Line numbers hold: with the default terminator the reader counts a line that ends in CR LF before it
    /// has seen the LF. Lines that begin with `#` are comments.
    pub(crate) fn open(path: &Path, builder: &mut ReaderBuilder) -> Result<Self, DataError> {
        let builder = builder.has_headers(false).flexible(true).comment(Some(b'#')).terminator(Terminator::Any(b'\n'));
        Ok(Self { path: path.to_owned(), reader: builder.from_reader(open(path)?), record: ByteRecord::new() })
    }

    /// Takes in the next record: its line; `None` at the end.
    pub(crate) fn advance(&mut self) -> Result<Option<u64>, DataError> {
        loop {
            // the reader's position is one of the line it would read next
            let line = self.reader.position().line();
            if !self.reader.read_byte_record(&mut self.record).map_err(|e| csv_error(&self.path, line, &e))? {
                return Ok(None);
            }
            if self.record.len() > 1 || !self.record[0].trim_ascii().is_empty() {
                return Ok(Some(self.record.position().map_or(line, csv::Position::line)));
            }
        }
    }
}

/// One line for an error of the CSV reader: broken compression, not a file, no text.
pub(crate) fn csv_error(path: &Path, line: u64, error: &csv::Error) -> DataError {
    match error.kind() {
        ErrorKind::Io(e) if e.kind() == io::ErrorKind::UnexpectedEof => {
            DataError::at(path, line, 0, "the compressed file ends here before its end: it was cut off")
        }
        ErrorKind::Io(e) => DataError::at(path, line, 0, e.to_string()),
        _ => DataError::at(path, line, 0, error.to_string()),
    }
}

/// Reads a number from a cell; `Ok(NaN)` where the cell is empty, or NaN as MATLAB and Python write no sample.
pub(crate) fn number(cell: &[u8]) -> Result<f64, String> {
    if cell.is_empty() {
        return Ok(f64::NAN);
    }
    let text = std::str::from_utf8(cell).map_err(|_| "not text (UTF-8)".to_owned())?;
    match text.parse::<f64>() {
        Ok(value) if !value.is_infinite() => return Ok(value),
        Ok(_) => return Err(format!("{} is not a finite number; leave the cell empty for no sample", shown(text))),
        Err(_) => {}
    }
    let trimmed = text.trim();
    if trimmed.is_empty() {
        return Ok(f64::NAN);
    }
    if trimmed.len() < text.len() {
        return number(trimmed.as_bytes());
    }
    Err(format!("{} is not a number", shown(text)))
}

/// The same in a table with this separator: where it is no comma, a number may have a decimal comma.
pub(crate) fn number_between(separator: u8, cell: &[u8]) -> Result<f64, String> {
    let commas = cell.iter().filter(|byte| **byte == b',').count();
    if separator == b',' || commas != 1 {
        return number(cell);
    }
    let with_point: Vec<u8> = cell.iter().map(|byte| if *byte == b',' { b'.' } else { *byte }).collect();
    number(&with_point)
}

/// The beginning of a cell, quoted with escapes: it may hold line ends.
fn shown(text: &str) -> String {
    format!("{:?}", text.chars().take(24).collect::<String>())
}

/// Fails for a header of more columns than are read.
pub(crate) fn check_columns(path: &Path, header: &ByteRecord) -> Result<(), DataError> {
    if header.len() <= MAX_COLUMNS {
        return Ok(());
    }
    let message = format!("{} columns; at most {MAX_COLUMNS} are read", header.len());
    Err(DataError::at(path, 1, MAX_COLUMNS as u64 + 1, message))
}

/// Fails at the line of the first row that is one too many.
pub(crate) fn check_rows(path: &Path, line: u64, rows: u64) -> Result<(), DataError> {
    if rows <= MAX_ROWS {
        return Ok(());
    }
    Err(DataError::at(path, line, 0, format!("more than {MAX_ROWS} rows; split the file")))
}

/// Where the cells of a line go.
struct Bindings {
    time: usize,
    /// Slot of each cell.
    slots: Vec<Option<usize>>,
    ignored: Vec<String>,
}

fn bind(path: &Path, header: &ByteRecord, table: &Table<'_>) -> Result<Bindings, DataError> {
    let fail = |cell: usize, message: String| DataError::at(path, 1, cell as u64 + 1, message);
    check_columns(path, header)?;
    let names: Vec<String> = header.iter().map(|cell| String::from_utf8_lossy(cell).trim().to_owned()).collect();
    let mut bindings = Bindings { time: usize::MAX, slots: vec![None; names.len()], ignored: Vec::new() };
    for (cell, name) in names.iter().enumerate() {
        if !name.is_empty() && names[..cell].contains(name) {
            return Err(fail(cell, format!("column {name} appears twice")));
        }
        if name == "t_s" {
            bindings.time = cell;
        } else if let Some(slot) = table.names.iter().position(|known| known == name) {
            bindings.slots[cell] = Some(slot);
        } else if !name.is_empty() {
            bindings.ignored.push(name.clone());
        }
    }
    if bindings.time == usize::MAX {
        let found: String = names.join(", ").chars().take(120).collect();
        let separated =
            if names.len() == 1 && found.contains(';') { " (separated by ; instead of a comma?)" } else { "" };
        return Err(fail(
            0,
            format!(
                "no column t_s (time in seconds); found: {found}{separated}; another maker's table needs a mapping of its columns"
            ),
        ));
    }
    // The same quantity in another unit would be left out silently.
    let stem = |name: &str| name.rsplit_once('_').map(|(stem, _)| stem.to_owned());
    let ignored = |cell: usize| cell != bindings.time && bindings.slots[cell].is_none();
    for (cell, name) in names.iter().enumerate().filter(|(cell, name)| ignored(*cell) && !name.is_empty()) {
        let is_known = |wanted: &str| names.iter().any(|found| found == wanted);
        let close = table.names.iter().find(|known| stem(known).is_some() && stem(known) == stem(name));
        if let Some(known) = close.filter(|known| !is_known(known)) {
            return Err(fail(
                cell,
                format!("column {name}: expected {known}; convert it, or give its unit in a column map"),
            ));
        }
    }
    let missing = table.required.iter().find(|name| !names.iter().any(|found| found == *name));
    if let Some(name) = missing {
        return Err(fail(0, format!("no column {name}; {}", table.hint)));
    }
    if bindings.slots.iter().all(Option::is_none) {
        return Err(fail(0, format!("no known column beside t_s; {}", table.hint)));
    }
    Ok(bindings)
}

/// Reads a table row by row into `row(time_us, values)`, NaN for an empty cell; returns notes and the columns not used.
pub(crate) fn read<const N: usize>(
    path: &Path,
    table: &Table<'_>,
    mut row: impl FnMut(u64, &[f64; N]),
) -> Result<(Vec<String>, Vec<String>), DataError> {
    let mut records = Records::open(path, ReaderBuilder::new().buffer_capacity(1 << 16))?;
    if records.advance()?.is_none() {
        return Err(DataError::file(path, "the file is empty; expected a header line with t_s"));
    }
    let bindings = bind(path, &records.record, table)?;
    let cells = records.record.len();
    let mut notes = Vec::new();
    if !bindings.ignored.is_empty() {
        notes.push(format!("columns not used: {}", bindings.ignored.join(", ")));
    }
    let mut previous_us = None;
    let mut values = [f64::NAN; N];
    let mut rows = 0;
    while let Some(line) = records.advance()? {
        let count = records.record.len();
        if count != cells {
            let is_last = records.advance()?.is_none();
            if is_last && count < cells && previous_us.is_some() {
                notes.push(format!("line {line}, the last, was cut off ({count} of {cells} cells) and is left out"));
                break;
            }
            return Err(DataError::at(path, line, 0, format!("{count} cells where the header has {cells}")));
        }
        let record = &records.record;
        let at = |cell: usize, name: &str, message: String| {
            DataError::at(path, line, cell as u64 + 1, format!("{name}: {message}"))
        };
        let time_s = number(&record[bindings.time]).map_err(|message| at(bindings.time, "t_s", message))?;
        if time_s.is_nan() {
            return Err(at(bindings.time, "t_s", "is empty; every row needs its time".to_owned()));
        }
        if !(0.0..MAX_SECONDS).contains(&time_s) {
            let unit = if time_s > MAX_SECONDS { "; in ms, us or ns? A column map states the unit" } else { "" };
            return Err(at(bindings.time, "t_s", format!("{time_s} is outside 0 to {MAX_SECONDS} s{unit}")));
        }
        let time_us = seconds_to_us(time_s);
        if let Some(previous_us) = previous_us.filter(|&previous_us| time_us < previous_us) {
            let before_s = previous_us as f64 * 1e-6;
            let message = format!("{time_s} is before the {before_s} of the row above; times must not go back");
            return Err(at(bindings.time, "t_s", message));
        }
        previous_us = Some(time_us);
        for (cell, (text, slot)) in record.iter().zip(&bindings.slots).enumerate() {
            let Some(slot) = *slot else { continue };
            // Most cells are empty: one row holds one sensor.
            values[slot] = match text {
                [] => f64::NAN,
                text => number(text).map_err(|message| at(cell, table.names[slot], message))?,
            };
        }
        rows += 1;
        check_rows(path, line, rows)?;
        row(time_us, &values);
    }
    if previous_us.is_none() {
        return Err(DataError::file(path, "no rows after the header"));
    }
    Ok((notes, bindings.ignored))
}
