//! The vehicle log: what a lab exports from any vehicle, one row a time, and the truth beside it.

mod column;
mod decimal;
pub(crate) mod layout;
pub(crate) mod mat;
pub mod plausibility;
mod read;
mod sink;
mod source;
pub(crate) mod table;
mod truth;
pub mod units;
mod usbl;
mod write;

pub use column::Column;
pub(crate) use decimal::MAX_SECONDS;
pub use source::Source;
pub use truth::{STATE_COLUMNS, Truth, TruthRow, TruthWriter};
pub use units::RADPS_PER_RPM;
pub use usbl::{USBL_ANGLE_SIGMA_RAD, Usbl};
pub use write::LogWriter;

use backseat_core::dynamics::ActuatorInput;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// One row of a vehicle log: a time and the samples taken then.
///
/// Most rows have a few of the columns: only these take memory, so that a log of ten million rows fits in 2 GB.
#[derive(Clone, PartialEq)]
pub struct LogRow {
    /// Time, µs.
    pub time_us: u64,
    /// A bit for each column with a sample.
    present: u128,
    /// Its samples, in the order of the columns; none is NaN.
    values: Vec<f64>,
}

const _: () = assert!(Column::COUNT <= u128::BITS as usize);

impl LogRow {
    /// A row without samples.
    pub const fn new(time_us: u64) -> Self {
        Self { time_us, present: 0, values: Vec::new() }
    }

    /// A row with a value for each column, NaN where there is no sample.
    fn of(time_us: u64, values: &[f64; Column::COUNT]) -> Self {
        let mut row = Self::new(time_us);
        row.values.reserve_exact(values.iter().filter(|value| !value.is_nan()).count());
        for (column, value) in values.iter().enumerate() {
            row.put(column, *value);
        }
        row
    }

    /// Whether a column has a sample, and where it stands, or would stand.
    fn place(&self, column: usize) -> (bool, usize) {
        let bit = 1_u128 << column;
        (self.present & bit != 0, (self.present & (bit - 1)).count_ones() as usize)
    }

    fn at(&self, column: usize) -> Option<f64> {
        let (present, place) = self.place(column);
        if present { self.values.get(place).copied() } else { None }
    }

    fn put(&mut self, column: usize, value: f64) {
        let (present, place) = self.place(column);
        match (present, value.is_nan()) {
            (true, false) => self.values[place] = value,
            (true, true) => {
                self.values.remove(place);
                self.present &= !(1 << column);
            }
            (false, false) => {
                self.values.reserve_exact(1);
                self.values.insert(place, value);
                self.present |= 1 << column;
            }
            (false, true) => {}
        }
    }

    /// The sample of a column, in the unit of its name.
    pub fn get(&self, column: Column) -> Option<f64> {
        self.at(column as usize)
    }

    /// Sets the sample of a column (NaN: no sample).
    pub fn set(&mut self, column: Column, value: f64) -> &mut Self {
        self.put(column as usize, value);
        self
    }

    /// Sets the samples of consecutive columns, `first` and those after it.
    pub fn set_all(&mut self, first: Column, values: &[f64]) -> &mut Self {
        for (column, value) in (first as usize..Column::COUNT).zip(values) {
            self.put(column, *value);
        }
        self
    }

    /// Whether no column has a sample.
    pub fn is_empty(&self) -> bool {
        self.present == 0
    }

    fn group<const N: usize>(&self, first: Column) -> Option<[f64; N]> {
        let mut group = [0.0; N];
        for (column, value) in (first as usize..).zip(&mut group) {
            *value = self.at(column)?;
        }
        Some(group)
    }

    /// Commanded propeller and fins; `None` unless all five are there.
    pub fn actuators(&self) -> Option<ActuatorInput> {
        let [rpm, top, bottom, port, starboard] = self.group(Column::PropRpm)?;
        Some(ActuatorInput { propeller_radps: rpm * RADPS_PER_RPM, fins_rad: [top, bottom, port, starboard] })
    }

    /// Sets the commanded propeller and fins.
    pub fn set_actuators(&mut self, input: &ActuatorInput) -> &mut Self {
        self.set(Column::PropRpm, input.propeller_radps / RADPS_PER_RPM).set_all(Column::FinTop, &input.fins_rad)
    }

    /// φ, θ, ψ, rad; `None` unless all three are there.
    pub fn attitude_rad(&self) -> Option<[f64; 3]> {
        self.group(Column::Roll)
    }

    /// p, q, r, rad/s; `None` unless all three are there.
    pub fn rates_radps(&self) -> Option<[f64; 3]> {
        self.group(Column::P)
    }

    /// DVL velocity over ground in body axes, m/s; `None` unless all three are there.
    pub fn dvl_mps(&self) -> Option<[f64; 3]> {
        self.group(Column::DvlU)
    }

    /// North, east of the ship at time of launch, m.
    pub fn ship_at_launch_m(&self) -> Option<[f64; 2]> {
        self.group(Column::ShipX)
    }

    /// GNSS of the ship: north, east, m.
    pub fn ship_gnss_m(&self) -> Option<[f64; 2]> {
        self.group(Column::ShipGpsX)
    }

    /// GNSS of the surfaced vehicle: north, east, m.
    pub fn gnss_m(&self) -> Option<[f64; 2]> {
        self.group(Column::GpsX)
    }

    /// Number of the fixed transponder that the row belongs to.
    pub fn station(&self) -> Option<u32> {
        self.get(Column::Station).filter(|number| (0.0..1e9).contains(number)).map(|number| number as u32)
    }

    /// Time of launch of the packet whose range is in this row, µs.
    pub fn launch_us(&self) -> Option<u64> {
        self.get(Column::Tol).map(decimal::seconds_to_us)
    }

    /// Time of arrival of the packet whose range is in this row, µs.
    pub fn arrival_us(&self) -> Option<u64> {
        self.get(Column::Toa).map(decimal::seconds_to_us)
    }
}

impl std::fmt::Debug for LogRow {
    /// The time and the samples that are there.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut debug = f.debug_struct("LogRow");
        debug.field("time_us", &self.time_us);
        for column in Column::ALL {
            if let Some(value) = self.get(column) {
                debug.field(column.name(), &value);
            }
        }
        debug.finish()
    }
}

/// A vehicle log in memory, rows in order of time.
#[derive(Clone, Debug, Default)]
pub struct Log {
    /// Where it came from.
    pub path: PathBuf,
    /// Rows, times never decreasing.
    pub rows: Vec<LogRow>,
    /// What the reader ignored or assumed, one line each.
    pub notes: Vec<String>,
    /// Samples are those of the centre of gravity (`inputs::at_centre` of the estimation), not of the sensors.
    pub at_centre: bool,
    /// µs since 1970 of time 0, where the log has a date; of the clock that the log was written by.
    pub start_unix_us: Option<i64>,
    /// Latitude and longitude of the origin of its positions, degrees, where it has them.
    pub origin_deg: Option<[f64; 2]>,
    /// Label and start, µs, of each run of a table that holds several; their numbers count from 1.
    pub runs: Vec<(String, u64)>,
    /// Settings of each run, name and value, where the recorder keeps them beside the log; in the order of `runs`.
    pub run_facts: Vec<Vec<(String, String)>>,
    /// `prop_rpm` is that of the motor, before a gear that the log does not state.
    pub is_motor_rpm: bool,
    /// Names of columns of its file that nothing was read from.
    pub unused_columns: Vec<String>,
    /// What its fixes are, where they are an estimate and not a measurement: `NAV_X, NAV_Y`.
    pub estimated_fixes: Option<String>,
    /// Of a log of messages, and of a table read by a mapping, the number that each column was read from.
    pub sources: Option<BTreeMap<Column, Source>>,
    /// The column of a table that has the time, where a mapping names it.
    pub time_column: Option<String>,
    /// Of a log of messages, the numbers that nothing was read from, as a mapping names them.
    pub unread_numbers: Vec<String>,
}

/// Time put between two runs, µs: longer than any gap that a model bridges.
pub(crate) const BETWEEN_RUNS_US: u64 = 100_000_000;

/// Says where a run is in a log of several.
pub(crate) fn run_note(number: usize, label: &str, start_us: u64) -> String {
    format!("run {number}: {label}, from {:.0} s of the joined log", start_us as f64 * 1e-6)
}

impl Log {
    /// From the first to the last row, s.
    pub fn duration_s(&self) -> f64 {
        match (self.rows.first(), self.rows.last()) {
            (Some(first), Some(last)) => (last.time_us - first.time_us) as f64 * 1e-6,
            _ => 0.0,
        }
    }

    /// Leaves out what comes after so many rows, and notes that.
    pub fn keep_first(&mut self, most: usize) {
        let (all, whole_s) = (self.rows.len(), self.duration_s());
        if all <= most {
            return;
        }
        self.rows.truncate(most);
        self.rows.shrink_to_fit();
        let kept_s = self.duration_s();
        self.notes.push(format!(
            "only the first {most} of {all} rows are used, {kept_s:.0} of {whole_s:.0} s: cut the file for another part"
        ));
    }

    /// Times (µs) and samples of a column.
    pub fn column(&self, column: Column) -> impl Iterator<Item = (u64, f64)> + '_ {
        self.rows.iter().filter_map(move |row| row.get(column).map(|value| (row.time_us, value)))
    }

    /// Adds the rows of another log of the same time base, in order of time. Runs of one label are the same run; other
    /// runs come after the end.
    pub fn join(&mut self, mut other: Self) {
        if !self.runs.is_empty() && !other.runs.is_empty() {
            self.align(&mut other);
        }
        self.rows.extend(other.rows);
        // Stable: of two rows at one time the own one stays first.
        self.rows.sort_by_key(|row| row.time_us);
        // files of one format say the same
        let new = other.notes.into_iter().filter(|note| !self.notes.contains(note)).collect::<Vec<_>>();
        self.notes.extend(new);
        self.is_motor_rpm |= other.is_motor_rpm;
    }

    /// Moves the runs of another log to those of this one.
    fn align(&mut self, other: &mut Self) {
        let mut end_us = self.rows.last().map_or(0, |row| row.time_us);
        for (place, (label, start_us)) in other.runs.iter().enumerate() {
            let number = (place + 1) as f64;
            let known = self.runs.iter().position(|(own, _)| own == label);
            let (at, begins_us) = match known {
                Some(at) => (at, self.runs[at].1),
                None => {
                    self.runs.push((label.clone(), end_us + BETWEEN_RUNS_US));
                    (self.runs.len() - 1, end_us + BETWEEN_RUNS_US)
                }
            };
            for row in other.rows.iter_mut().filter(|row| row.get(Column::Run) == Some(number)) {
                row.time_us = row.time_us - start_us + begins_us;
                // Marked by a negative number, so that no run is moved twice.
                row.set(Column::Run, -((at + 1) as f64));
                end_us = end_us.max(row.time_us);
            }
        }
        for row in &mut other.rows {
            if let Some(number) = row.get(Column::Run) {
                row.set(Column::Run, number.abs());
            }
        }
        // The notes of the importer number the runs of its own table.
        other.notes.retain(|note| !note.starts_with("run "));
        for (place, (label, start_us)) in self.runs.iter().enumerate() {
            let note = run_note(place + 1, label, *start_us);
            if !self.notes.contains(&note) {
                self.notes.push(note);
            }
        }
    }

    /// Declared places of the fixed transponders by their numbers: north, east, down, m; the last where one is given twice.
    pub fn stations_m(&self) -> BTreeMap<u32, [f64; 3]> {
        self.rows.iter().filter_map(|row| Some((row.station()?, row.group(Column::StationX)?))).collect()
    }

    /// Whether any row has a sample of this column.
    pub fn has(&self, column: Column) -> bool {
        self.column(column).next().is_some()
    }
}
