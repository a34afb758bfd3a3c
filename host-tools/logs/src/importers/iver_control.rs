//! Logs of a laboratory's own control computer in an Iver2 (repository playertr/iver2_control): no header, white space
//! between the columns, 2 Hz, the run's configuration in a file of the same time beside it.
//!
//! A file `IverControlData-TIME.log` is a run; a folder of them is read as a log of several runs. The columns are those
//! of `Iver Data Headings.txt`, of which the files have one fewer: the accelerations are the last three. Positions are
//! dead-reckoned by the vehicle itself from zero and are no fixes.

use super::Imported;
use crate::log::units::RAD_PER_DEG;
use crate::log::{BETWEEN_RUNS_US, Column, LogRow, run_note};
use crate::{DataError, Log};
use std::path::{Path, PathBuf};

/// Name of the format.
pub(super) const NAME: &str = "Iver control log";
const PREFIX: &str = "IverControlData-";
const CONFIGURATION_PREFIX: &str = "Config-";
/// Columns of a whole row.
const COLUMNS: usize = 35;
/// Stands for "no target".
const NO_TARGET: f64 = 999.0;
/// The motor turns: less is noise of its sensor, rpm.
const POWERED_RPM: f64 = 100.0;
/// Less deep, the vehicle is at the surface, m.
const SURFACE_M: f64 = 0.5;
/// A vehicle that the motor does not drive and that pitches or rolls so much at the surface is in somebody's hands, rad.
const CARRIED_RAD: f64 = 0.7;
/// Time between rows of the control computer, s.
const CLOCK_S: f64 = 0.5;
/// A written time further from the clock begins it anew, s.
const MOST_JITTER_S: f64 = 0.3;
/// Rows with a longer time between them are two stretches, s.
const PAUSE_S: f64 = 1.5;

/// The signs that this reader applies; `info` tests them against what follows the fins, and the propeller.
const SIGNS: [&str; 3] = [
    "rudders: positive turns to starboard in the file (top as it is, bottom turned round)",
    "elevators: positive raises the nose in the file (port as it is, starboard turned round)",
    "DVL: ahead and athwart are turned round, the log has ahead negative",
];

/// Places of columns in a row.
mod place {
    pub(super) const TIME: usize = 0;
    pub(super) const DEPTH: usize = 3;
    pub(super) const ROLL: usize = 4;
    pub(super) const PITCH: usize = 5;
    pub(super) const HEADING: usize = 6;
    pub(super) const TARGET_DEPTH: usize = 9;
    pub(super) const VELOCITY: usize = 10;
    pub(super) const UPPER: usize = 13;
    pub(super) const LOWER: usize = 14;
    pub(super) const PORT: usize = 15;
    pub(super) const STARBOARD: usize = 16;
    pub(super) const MOTOR_RPM: usize = 19;
}

/// The files of a path: a run, or all runs of a folder in the order of their names; `None`: another format.
fn files(path: &Path) -> Option<Vec<PathBuf>> {
    let is_run = |path: &Path| {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        name.starts_with(PREFIX) && name.ends_with(".log")
    };
    if !path.is_dir() {
        return is_run(path).then(|| vec![path.to_owned()]);
    }
    let entries = std::fs::read_dir(path).ok()?;
    let mut runs: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|p| is_run(p)).collect();
    runs.sort();
    (!runs.is_empty()).then_some(runs)
}

/// Whether a path is a run or a folder of runs.
pub(super) fn is_one(path: &Path) -> bool {
    files(path).is_some()
}

/// Reads a run or a folder of runs.
pub(super) fn read(path: &Path) -> Result<Imported, DataError> {
    let log = read_runs(path, &files(path).unwrap_or_default())?;
    Ok(Imported { format: NAME, log })
}

/// What of a run was not used, for one note each.
#[derive(Default)]
struct Omitted {
    cut_rows: usize,
    repeated: usize,
    idle_rows: usize,
    carried_rows: usize,
    abort_rows: usize,
    pauses: usize,
    empty_files: Vec<String>,
}

fn read_runs(path: &Path, files: &[PathBuf]) -> Result<Log, DataError> {
    let mut log = Log { path: path.to_owned(), is_motor_rpm: true, ..Log::default() };
    let mut omitted = Omitted::default();
    for file in files {
        let text = std::fs::read(file).map_err(|error| DataError::io(file, &error))?;
        let text = String::from_utf8_lossy(&text);
        let label = label(file);
        let rows = rows(file, &text, &mut omitted)?;
        if rows.is_empty() {
            omitted.empty_files.push(label);
            continue;
        }
        let facts = configuration(&file.with_file_name(format!("{CONFIGURATION_PREFIX}{label}.log")));
        let abort_deg = facts.iter().find(|(key, _)| key == "control.abortelevatorangle");
        let abort_deg = abort_deg.and_then(|(_, value)| value.parse::<f64>().ok());
        let begins_us = log.rows.last().map_or(0, |row| row.time_us + BETWEEN_RUNS_US);
        log.runs.push((label.clone(), begins_us));
        log.notes.push(run_note(log.runs.len(), &label, begins_us));
        let run = log.runs.len() as f64;
        append(&mut log, &rows, begins_us, run, abort_deg, &mut omitted);
        log.run_facts.push(facts);
    }
    if log.rows.is_empty() {
        return Err(DataError::file(path, format!("no row of {COLUMNS} columns in any {PREFIX}*.log")));
    }
    log.notes.extend(omitted.notes());
    log.notes.extend(SIGNS.map(str::to_owned));
    Ok(log)
}

/// The time in the name of a run.
fn label(file: &Path) -> String {
    let name = file.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    name.strip_prefix(PREFIX).unwrap_or(&name).to_owned()
}

/// The whole rows of a run; the last one may be cut off.
fn rows(file: &Path, text: &str, omitted: &mut Omitted) -> Result<Vec<[f64; COLUMNS]>, DataError> {
    let lines: Vec<&str> = text.lines().collect();
    let mut rows: Vec<[f64; COLUMNS]> = Vec::new();
    for (index, line) in lines.iter().enumerate() {
        let cells: Vec<&str> = line.split_ascii_whitespace().collect();
        if cells.is_empty() {
            continue;
        }
        if cells.len() < COLUMNS && index + 1 == lines.len() {
            omitted.cut_rows += 1;
            continue;
        }
        let at = |cell: usize, message: String| DataError::at(file, index as u64 + 1, cell as u64 + 1, message);
        if cells.len() != COLUMNS {
            let message = format!("{} numbers where a row of an {NAME} has {COLUMNS}", cells.len());
            return Err(at(0, message));
        }
        let mut row = [0.0; COLUMNS];
        for (cell, (number, text)) in row.iter_mut().zip(&cells).enumerate() {
            *number = text.parse().map_err(|_| at(cell, format!("expected a number or nan, found {text:?}")))?;
        }
        let time_s = row[place::TIME];
        if !(0.0..1e7).contains(&time_s) {
            return Err(at(place::TIME, format!("elapsed time {time_s} s; expected 0 to 1e7")));
        }
        if rows.last().is_some_and(|last| last[place::TIME] > time_s) {
            return Err(at(place::TIME, "the time is before that of the row above".to_owned()));
        }
        rows.push(row);
    }
    Ok(rows)
}

/// `key = value` of a configuration; empty if there is no such file. A last line that is cut off is left out.
fn configuration(path: &Path) -> Vec<(String, String)> {
    let text = std::fs::read(path).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default();
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    let pairs = whole.lines().filter_map(|line| line.split_once(" = "));
    pairs.map(|(key, value)| (key.trim().to_owned(), value.trim().trim_end_matches(';').to_owned())).collect()
}

/// Times since the first row: the rows are on a clock of half a second, and the time written jitters about it by 0.1 s
/// (attitudes of five rows lie on a cubic to 0.07 degrees by the clock, to 0.2 degrees by the written times).
fn on_the_clock(rows: &[[f64; COLUMNS]]) -> Vec<f64> {
    let mut times_s = Vec::with_capacity(rows.len());
    let mut offset_s = rows[0][place::TIME];
    let start_s = offset_s;
    let mut tick = 0.0;
    for row in rows {
        let written_s = row[place::TIME];
        if (written_s - offset_s - tick * CLOCK_S).abs() > MOST_JITTER_S {
            (offset_s, tick) = (written_s, 0.0);
        }
        times_s.push(offset_s - start_s + tick * CLOCK_S);
        tick += 1.0;
    }
    times_s
}

/// Whether two readings of the DVL are one, repeated.
fn same(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| a == b)
}

fn append(
    log: &mut Log,
    rows: &[[f64; COLUMNS]],
    begins_us: u64,
    run: f64,
    abort_deg: Option<f64>,
    omitted: &mut Omitted,
) {
    let velocity = |row: &[f64; COLUMNS]| [0, 1, 2].map(|axis| row[place::VELOCITY + axis]);
    let times_s = on_the_clock(rows);
    for (index, (row, time_s)) in rows.iter().zip(times_s).enumerate() {
        let mut sample = LogRow::new(begins_us + (time_s * 1e6).round() as u64);
        sample.set(Column::Run, run);
        let set = |sample: &mut LogRow, column, value: f64, least: f64, most: f64| {
            if (least..=most).contains(&value) && value != NO_TARGET {
                sample.set(column, value);
            }
        };
        set(&mut sample, Column::Depth, row[place::DEPTH], -20.0, 6000.0);
        let degrees = [(Column::Roll, place::ROLL, 180.0), (Column::Pitch, place::PITCH, 90.0)];
        for (column, at, most) in degrees {
            set(&mut sample, column, row[at] * RAD_PER_DEG, -most * RAD_PER_DEG, most * RAD_PER_DEG);
        }
        if (0.0..=360.0).contains(&row[place::HEADING]) {
            sample.set(Column::Heading, backseat_core::state::wrap_angle(row[place::HEADING] * RAD_PER_DEG));
        }
        // upper +, port + as here; lower and starboard turn the other way ([`SIGNS`])
        let fins = [(place::UPPER, 1.0), (place::LOWER, -1.0), (place::PORT, 1.0), (place::STARBOARD, -1.0)];
        let first = Column::FinTop as usize;
        for (column, (at, sign)) in Column::ALL[first..first + 4].iter().zip(fins) {
            set(&mut sample, *column, sign * row[at] * RAD_PER_DEG, -1.6, 1.6);
        }
        let rpm = if row[place::MOTOR_RPM].abs() < POWERED_RPM { 0.0 } else { row[place::MOTOR_RPM] };
        set(&mut sample, Column::PropRpm, rpm, -1e5, 1e5);
        // a reading of the DVL stands in two rows or more: once only, in its first
        let [ahead, athwart, vertical] = velocity(row);
        let is_repeated = index > 0 && same(&velocity(&rows[index - 1]), &velocity(row));
        let is_velocity = ahead.abs() < 20.0 && athwart.abs() < 20.0 && vertical.abs() < 20.0;
        if is_velocity && !is_repeated {
            sample.set_all(Column::DvlU, &[-ahead, -athwart, -vertical]);
        }
        omitted.repeated += usize::from(is_velocity && is_repeated);
        omitted.pauses += usize::from(index > 0 && row[place::TIME] - rows[index - 1][place::TIME] > PAUSE_S);
        let is_powered = rpm != 0.0;
        let is_shallow = row[place::DEPTH] < SURFACE_M;
        let has_tilt = row[place::ROLL].abs().max(row[place::PITCH].abs()) * RAD_PER_DEG > CARRIED_RAD;
        let aborts = row[place::TARGET_DEPTH] == NO_TARGET
            && abort_deg.is_some_and(|angle| row[place::PORT] == angle && row[place::STARBOARD] == angle);
        omitted.carried_rows += usize::from(is_shallow && has_tilt && !is_powered);
        omitted.abort_rows += usize::from(aborts);
        omitted.idle_rows += usize::from(is_shallow && !is_powered && !aborts);
        log.rows.push(sample);
    }
}

impl Omitted {
    fn notes(&self) -> Vec<String> {
        let mut notes = vec![
            "positions are dead-reckoned by the vehicle from zero: not fixes, left out; `navigate` of a run counts from where it \
             starts"
                .to_owned(),
            format!(
                "times are those of a clock of {CLOCK_S} s; the times written jitter about it"
            ),
            format!(
                "prop_rpm is that of the motor, not of the propeller; below {POWERED_RPM} it is noise and counts as stopped"
            ),
        ];
        let mut say = |count: usize, what: &str| {
            if count > 0 {
                notes.push(format!("{count} {what}"));
            }
        };
        say(self.cut_rows, "last rows are cut off: left out");
        say(self.repeated, "readings of the DVL repeat the row above: each reading counts once, in its first row");
        say(self.pauses, "pauses of the clock: no model bridges them");
        say(self.idle_rows, "rows at the surface without the motor: not flight, no model is compared there");
        say(self.carried_rows, "of them rolled or pitched beyond 40 degrees: carried by hand");
        say(self.abort_rows, "rows in an abort (elevators at control.abortelevatorangle, motor off)");
        if !self.empty_files.is_empty() {
            notes.push(format!("without a row: {}", self.empty_files.join(", ")));
        }
        notes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(time_s: f64, rpm: f64, velocity: &str) -> String {
        format!(
            "{time_s:.3} 0.00000 360.00000 1.0 5.0 -10.0 350.0 999.0 999.000 3.0 {velocity} 5.0 4.0 -3.0 -2.0 12 0.0 {rpm} \
             1 1 0 0.0 22.9 15.1 0.065 66.0 0.004 0.0 0.0 0.0 -31.1 110.1 991.9\n"
        )
    }

    fn folder(runs: &[(&str, String)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (label, text) in runs {
            std::fs::write(folder.path().join(format!("{PREFIX}{label}.log")), text).unwrap();
            let configuration =
                "\n === Config ===\ncontrol.abortelevatorangle = 30\ncontrol.rollpidp = 0.5\nfins.trim = 1\nfins.cu";
            std::fs::write(folder.path().join(format!("{CONFIGURATION_PREFIX}{label}.log")), configuration).unwrap();
        }
        folder
    }

    #[test]
    fn val_signs_units_repeats_and_what_is_cut_off() {
        let text = format!(
            "{}{}{}{}7.5 0.0 0.0 1.0",
            row(5.0, 0.0, "nan nan nan"),
            row(5.4, 5.0, "-1.5 0.1 0.2"),
            row(6.0, 8000.0, "-1.5 0.1 0.2"),
            row(6.4, 8000.0, "-1.6 0.1 0.2")
        );
        let folder = folder(&[("20220101000000", text), ("20220102000000", String::new())]);
        let imported = crate::importers::read(folder.path()).unwrap();
        let log = imported.log;
        assert_eq!((imported.format, log.rows.len(), log.runs.len()), (NAME, 4, 1));
        let fins: Vec<f64> = log.rows[0].actuators().unwrap().fins_rad.iter().map(|fin| fin.to_degrees()).collect();
        for (fin, expected) in fins.iter().zip([5.0, -4.0, -3.0, 2.0]) {
            assert!((fin - expected).abs() < 1e-9, "{fins:?}");
        }
        assert_eq!(log.rows[1].get(Column::PropRpm), Some(0.0));
        assert_eq!(log.rows[1].dvl_mps(), Some([1.5, -0.1, -0.2]));
        assert_eq!((log.rows[2].dvl_mps(), log.rows[3].dvl_mps()), (None, Some([1.6, -0.1, -0.2])));
        assert!((log.rows[0].get(Column::Heading).unwrap().to_degrees() + 10.0).abs() < 1e-9);
        assert_eq!(log.run_facts[0].len(), 3);
        assert_eq!(log.run_facts[0][1], ("control.rollpidp".to_owned(), "0.5".to_owned()));
        let notes = log.notes.join("\n");
        for words in ["1 last rows are cut off", "without a row: 20220102000000", "1 readings of the DVL repeat"] {
            assert!(notes.contains(words), "{notes}");
        }
    }

    #[test]
    fn bad_rows_are_told_with_line_and_column() {
        let wrong = row(5.0, 0.0, "nan nan nan").replace("350.0", "north");
        let folder = folder(&[("20220101000000", wrong + &row(6.0, 0.0, "nan nan nan"))]);
        let error = crate::importers::read(folder.path()).unwrap_err().to_string();
        assert!(error.contains(".log:1:7: expected a number or nan, found \"north\""), "{error}");
    }
}
