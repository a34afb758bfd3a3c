//! Files that are no logs: what they are by their first bytes, and what to do with them.

use crate::DataError;
use std::fs::File;
use std::io::Read as _;
use std::path::Path;

const PICTURE: (&str, &str) = ("a picture", "give the log that it was made from");
const FILM: (&str, &str) = ("a film or a sound", "give the vehicle's own log");
const DOCUMENT: (&str, &str) = ("a document", "save its table as CSV, with the names of the columns in the first line");
const SHEET: (&str, &str) =
    ("an archive or the workbook of a spreadsheet", "unpack it, or save the table as CSV, and give the file in it");
const ARCHIVE: (&str, &str) = ("an archive", "unpack it and give the log in it");
const PROGRAM: (&str, &str) = ("a program", "give the log that it wrote");
const DATA: (&str, &str) = (
    "a container of arrays (HDF5 or NetCDF)",
    "export its channels as CSV, one row a time; the table needs a mapping of its columns",
);

/// What a file begins with: at which byte, with what.
const BEGINNINGS: [(usize, &[u8], (&str, &str)); 28] = [
    (0, b"\x89PNG", PICTURE),
    (0, b"\xff\xd8\xff", PICTURE),
    (0, b"GIF8", PICTURE),
    (0, b"BM", PICTURE),
    (0, b"II*\0", PICTURE),
    (0, b"MM\0*", PICTURE),
    (8, b"WEBP", PICTURE),
    (8, b"WAVE", FILM),
    (8, b"AVI ", FILM),
    (4, b"ftyp", FILM),
    (0, b"\x1aE\xdf\xa3", FILM),
    (0, b"OggS", FILM),
    (0, b"%PDF", DOCUMENT),
    (0, b"%!PS", DOCUMENT),
    (0, b"{\\rtf", DOCUMENT),
    (0, b"\xd0\xcf\x11\xe0", DOCUMENT),
    (0, b"PK\x03", SHEET),
    (0, b"PK\x05\x06", SHEET),
    (257, b"ustar", ARCHIVE),
    (0, b"7z\xbc\xaf", ARCHIVE),
    (0, b"Rar!", ARCHIVE),
    (0, b"\xfd7zXZ", ARCHIVE),
    (0, b"BZh", ARCHIVE),
    (0, b"\x28\xb5\x2f\xfd", ARCHIVE),
    (0, b"\x7fELF", PROGRAM),
    (0, b"MZ", PROGRAM),
    (0, b"\x89HDF", DATA),
    (0, b"CDF", DATA),
];

/// What a text begins with, blanks aside.
const TEXTS: [(&str, (&str, &str)); 7] = [
    ("<!doctype html", DOCUMENT),
    ("<html", DOCUMENT),
    ("<svg", PICTURE),
    ("<?xml", ("an XML file", "a track or a chart is no log: give the vehicle's own log, or a table as CSV")),
    ("<kml", ("a KML file", "a track is no log: give the vehicle's own log, or a table as CSV")),
    ("{", ("a JSON file", "write one row a time as CSV, with the names of the columns in the first line")),
    ("[{", ("a JSON file", "write one row a time as CSV, with the names of the columns in the first line")),
];

/// Opens a file that is read more than once, as nearly all are: to see what it is, and then to read it.
///
/// # Errors
/// What the operating system reports; a pipe or a device, which can be read once only, or never ends.
pub fn open(path: &Path) -> Result<File, DataError> {
    if is_stream(path) {
        let message =
            "a pipe or a device, which cannot be read twice: write what comes from it into a file, and give that";
        return Err(DataError::file(path, message));
    }
    File::open(path).map_err(|e| DataError::io(path, &e))
}

/// A pipe, a socket or a device: to open one may wait for ever.
fn is_stream(path: &Path) -> bool {
    path.metadata().is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// What a path is, and what to do with it; `None` of a text that may be a table, and of what is not known.
#[must_use]
pub fn of(path: &Path) -> Option<(&'static str, &'static str)> {
    if path.is_dir() {
        let files: Vec<_> = std::fs::read_dir(path).ok()?.flatten().map(|entry| entry.file_name()).collect();
        let has = |ending: &str| files.iter().any(|name| name.to_string_lossy().ends_with(ending));
        if has(".mcap") || has(".db3") {
            return None; // a ROS 2 bag: its reader says what is missing
        }
        let next =
            if [".csv", ".csv.gz", ".log"].into_iter().any(has) { "give one of the logs in it" } else { "give a log" };
        return Some(("a folder", next));
    }
    let mut beginning = Vec::new();
    let _ = open(path).ok()?.take(512).read_to_end(&mut beginning);
    if beginning.starts_with(&[0x1f, 0x8b]) {
        let mut inside = Vec::new();
        let _ = flate2::read::GzDecoder::new(open(path).ok()?).take(512).read_to_end(&mut inside);
        beginning = inside;
    }
    if beginning.is_empty() {
        return Some(("an empty file", "was the logger stopped before it wrote anything?"));
    }
    // two or three letters may begin the header of a table
    let is_text = !beginning.contains(&0);
    let is = |(at, bytes, _): &&(usize, &[u8], _)| {
        let is_short = bytes.len() < 4 && bytes.iter().all(u8::is_ascii_graphic);
        beginning.get(*at..).is_some_and(|rest| rest.starts_with(bytes)) && !(is_short && is_text)
    };
    if let Some((.., what)) = BEGINNINGS.iter().find(is) {
        return Some(*what);
    }
    let text = String::from_utf8_lossy(&beginning).trim_start_matches('\u{feff}').trim_start().to_lowercase();
    TEXTS.iter().find(|(start, _)| text.starts_with(start)).map(|(_, what)| *what)
}

/// What is to be said in place of an error, where the file is of another kind.
pub(crate) fn instead(path: &Path, error: DataError) -> DataError {
    match of(path) {
        Some((what, next)) => DataError::file(path, format!("{what}, not a log: {next}{}", names(path))),
        None => error,
    }
}

/// The files in a folder, by name; the first of many.
fn names(path: &Path) -> String {
    const MOST: usize = 8;
    let Ok(entries) = std::fs::read_dir(path) else { return String::new() };
    let files = entries.flatten().filter(|entry| entry.path().is_file());
    let mut names: Vec<String> = files.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort_unstable();
    let more = if names.len() > MOST { format!(" and {} more", names.len() - MOST) } else { String::new() };
    names.truncate(MOST);
    if names.is_empty() { String::new() } else { format!(": {}{more}", names.join(", ")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_log_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let tar = [&[b'a'; 257][..], b"ustar\x0000"].concat();
        let cases: [(&str, &[u8], &str); 9] = [
            ("a.png", b"\x89PNG\r\n\x1a\n", "a picture"),
            ("a.pdf", b"%PDF-1.7\n", "a document"),
            ("a.xlsx", b"PK\x03\x04\x14\x00", "workbook"),
            ("a.tar", &tar, "an archive"),
            ("a.json", b"\n{\"depth\": 1}", "a JSON file"),
            ("a.kml", b"<?xml version=\"1.0\"?>", "an XML file"),
            ("a", b"\x7fELF\x02\x01", "a program"),
            ("a.bin", b"\x00\x01\x02\x03,\n", "binary data of no known format"),
            ("a.csv", b"", "an empty file"),
        ];
        for (name, bytes, what) in cases {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            let complaint = crate::importers::read(&path).unwrap_err().to_string();
            assert!(complaint.contains(what) && complaint.contains(", not a log: "), "{complaint}");
        }
        let complaint = crate::importers::read(folder.path()).unwrap_err().to_string();
        assert!(
            complaint.contains("a folder, not a log: give one of the logs in it: a, a.bin, a.csv, "),
            "{complaint}"
        );
        assert!(complaint.ends_with(" and 1 more"), "{complaint}");
        std::fs::write(folder.path().join("bag.db3"), "").unwrap();
        let complaint = crate::importers::read(folder.path()).unwrap_err().to_string();
        assert!(!complaint.contains("give one of the logs"), "{complaint}");
        std::fs::write(folder.path().join("table.csv"), "time,depth\n1,2\n").unwrap();
        assert_eq!(of(&folder.path().join("table.csv")), None);
    }
}
