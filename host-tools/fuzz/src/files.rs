//! Files that people hand to the host tools.

use crate::finite;
use backseat_logs::session::{Event, Reader};
use backseat_logs::{BoardFile, Column, Log, LogWriter, Truth, VehicleFile, importers};
use hil_sim::scenario::Settings;
use std::cell::OnceCell;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A path in a folder of this thread's own, which the next call may use again.
fn path(name: &str) -> PathBuf {
    thread_local!(static FOLDER: OnceCell<TempDir> = const { OnceCell::new() });
    FOLDER.with(|folder| folder.get_or_init(|| tempfile::tempdir().expect("a folder")).path().join(name))
}

/// A file with this content; the next call may replace it.
fn file(name: &str, content: &[u8]) -> PathBuf {
    let path = path(name);
    std::fs::write(&path, content).expect("a file");
    path
}

/// An error that says where, in one line.
fn in_one_line(error: &backseat_logs::DataError) {
    let shown = error.to_string();
    assert!(!shown.contains('\n'), "{shown:?}");
}

/// Session logs (MCAP).
pub fn session(data: &[u8]) {
    read_session(&file("session.mcap", data), data.len());
}

/// Logs of a board's memory card.
pub fn board_log(data: &[u8]) {
    read_session(&file("board.log", data), data.len());
}

/// To the end or to an error; events are not made out of nothing.
fn read_session(path: &Path, length: usize) {
    let mut reader = match Reader::open(path) {
        Ok(reader) => reader,
        Err(error) => return in_one_line(&error),
    };
    let mut bytes = 0;
    for entry in &mut reader {
        match entry {
            Ok(entry) => {
                if let Event::Received { bytes: received, .. } | Event::Sent { bytes: received, .. } = entry.event {
                    bytes += received.len();
                }
            }
            Err(error) => {
                in_one_line(&error);
                break;
            }
        }
    }
    // compressed chunks expand, at most to LZ4's limit of 255 times
    assert!(bytes <= 256 * length, "{bytes} bytes from {length}");
    let (read, whole) = reader.position();
    assert!(read <= whole && reader.damage().cut_bytes <= whole);
}

/// Rows in order of time, every sample a number; what is written of them reads again.
fn settled(log: &Log) {
    assert!(log.rows.windows(2).all(|pair| pair[0].time_us <= pair[1].time_us));
    finite(&log.rows);
    let written = path("again.csv");
    let _ = std::fs::remove_file(&written);
    let mut writer = LogWriter::with_columns(&written, &Column::ALL).expect("a new file");
    log.rows.iter().for_each(|row| writer.write(row).expect("room"));
    writer.finish().expect("room");
    let again = Log::read(&written).expect("what was written can be read");
    assert_eq!(again.rows.len(), log.rows.len());
    assert!(again.rows.iter().zip(&log.rows).all(|(again, row)| again.time_us == row.time_us));
}

/// Vehicle logs and truth.
pub fn csv_log(data: &[u8]) {
    let path = file("log.csv", data);
    match Log::read(&path) {
        Ok(log) => settled(&log),
        Err(error) => in_one_line(&error),
    }
    match Truth::read(&path) {
        Ok(truth) => assert!(truth.rows.windows(2).all(|pair| pair[0].time_us <= pair[1].time_us)),
        Err(error) => in_one_line(&error),
    }
}

/// Logs of other people's vehicles.
pub fn importers(data: &[u8]) {
    match importers::read(&file("mission.log", data)) {
        Ok(imported) => settled(&imported.log),
        Err(error) => in_one_line(&error),
    }
}

/// Vehicle files and exported parameter sets.
pub fn vehicle_file(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let path = Path::new("vehicle.toml");
    match VehicleFile::parse(text, path) {
        Ok(vehicle) => {
            finite(&vehicle.flatten());
            let again = VehicleFile::parse(&vehicle.to_toml(""), path).expect("what was written can be read");
            assert_eq!(again, vehicle);
        }
        Err(error) => in_one_line(&error),
    }
    match BoardFile::parse(text, path) {
        Ok(board) => drop(board.flatten()),
        Err(error) => in_one_line(&error),
    }
}

/// Scenario files; their `[mission]` is what a mission file holds.
pub fn scenario(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    match Settings::parse(text, Path::new("scenario.toml")) {
        Ok(settings) => finite(&(settings.waypoints(), settings.lines())),
        Err(error) => in_one_line(&error),
    }
}
