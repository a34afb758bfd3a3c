//! The truth beside a vehicle log: the whole state and the current.

use super::sink::LineSink;
use super::table::{self, Table};
use crate::DataError;
use backseat_core::state::{PHI, PSI, THETA, VEHICLE_STATES, VehicleState, X, Y, wrap_angle};
use std::path::Path;

/// Column names of the twelve states, in the order of the vector.
pub const STATE_COLUMNS: [&str; VEHICLE_STATES] = [
    "x_m",
    "y_m",
    "z_m",
    "roll_rad",
    "pitch_rad",
    "heading_rad",
    "u_mps",
    "v_mps",
    "w_mps",
    "p_radps",
    "q_radps",
    "r_radps",
];

/// Column names of the twelve states and the current.
const NAMES: [&str; VEHICLE_STATES + 2] = {
    let [x, y, z, roll, pitch, heading, u, v, w, p, q, r] = STATE_COLUMNS;
    [x, y, z, roll, pitch, heading, u, v, w, p, q, r, "current_n_mps", "current_e_mps"]
};

/// Decimals written: µm, µrad, µm/s.
const DECIMALS: usize = 6;

/// The truth at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthRow {
    /// Time, µs.
    pub time_us: u64,
    /// State; velocity is through the water. NaN where a file read does not have it.
    pub state: VehicleState,
    /// Current north, east, m/s; zero where a file read does not have it.
    pub current_mps: [f64; 2],
}

/// A truth file in memory, rows in order of time.
#[derive(Clone, Debug, Default)]
pub struct Truth {
    /// Rows, times never decreasing.
    pub rows: Vec<TruthRow>,
    /// What the reader ignored, one line each.
    pub notes: Vec<String>,
}

impl Truth {
    /// Reads a truth CSV (`.csv` or `.csv.gz`): `t_s`, `x_m`, `y_m` and any of the other columns.
    ///
    /// # Errors
    /// Where the file is not a truth CSV: line, column, what was expected.
    pub fn read(path: &Path) -> Result<Self, DataError> {
        let mut rows = Vec::new();
        let table = Table { names: &NAMES, required: &NAMES[..2], hint: "a truth CSV has x_m and y_m" };
        let (notes, _) = table::read(path, &table, |time_us, values: &[f64; VEHICLE_STATES + 2]| {
            let current = [values[VEHICLE_STATES], values[VEHICLE_STATES + 1]];
            rows.push(TruthRow {
                time_us,
                state: VehicleState::from_column_slice(&values[..VEHICLE_STATES]),
                current_mps: current.map(|value| if value.is_nan() { 0.0 } else { value }),
            });
        })?;
        Ok(Self { rows, notes })
    }

    /// The truth at a time, interpolated linearly (angles by the shorter way); `None` outside the
    /// time it covers.
    pub fn at(&self, time_us: u64) -> Option<TruthRow> {
        let after = self.rows.partition_point(|row| row.time_us < time_us);
        let b = self.rows.get(after)?;
        if b.time_us == time_us {
            return Some(*b);
        }
        let a = self.rows.get(after.checked_sub(1)?)?;
        let share = (time_us - a.time_us) as f64 / (b.time_us - a.time_us) as f64;
        let mut step = b.state - a.state;
        for angle in [PHI, THETA, PSI] {
            step[angle] = wrap_angle(step[angle]);
        }
        let mut state = a.state + step * share;
        state[PSI] = wrap_angle(state[PSI]);
        let current_mps =
            std::array::from_fn(|axis| a.current_mps[axis] + share * (b.current_mps[axis] - a.current_mps[axis]));
        Some(TruthRow { time_us, state, current_mps })
    }

    /// Horizontal distance between a position and the truth of that time, m.
    pub fn horizontal_error_m(&self, time_us: u64, x_m: f64, y_m: f64) -> Option<f64> {
        let truth = self.at(time_us)?;
        let error = (x_m - truth.state[X]).hypot(y_m - truth.state[Y]);
        error.is_finite().then_some(error)
    }
}

/// Writes a truth CSV (`.csv`, or `.csv.gz` by its name) row by row, like
/// [`LogWriter`](super::LogWriter).
pub struct TruthWriter {
    sink: LineSink,
}

impl TruthWriter {
    /// A new truth file.
    ///
    /// # Errors
    /// If the file exists or cannot be created.
    pub fn create(path: &Path) -> Result<Self, DataError> {
        Ok(Self { sink: LineSink::table(path, NAMES)? })
    }

    /// Appends one row.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&mut self, row: &TruthRow) -> Result<(), DataError> {
        let cells =
            row.state.iter().chain(&row.current_mps).map(|value| value.is_finite().then_some((*value, DECIMALS)));
        self.sink.row(row.time_us, cells)
    }

    /// Writes what is left and closes the file.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(self) -> Result<(), DataError> {
        self.sink.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(time_us: u64, x_m: f64, heading_rad: f64) -> TruthRow {
        let mut state = VehicleState::zeros();
        state[X] = x_m;
        state[PSI] = heading_rad;
        TruthRow { time_us, state, current_mps: [0.1, 0.0] }
    }

    #[test]
    fn interpolates_across_the_wrap_of_heading() {
        let truth = Truth { rows: vec![row(0, 0.0, 3.1), row(1_000_000, 2.0, -3.1)], notes: Vec::new() };
        let middle = truth.at(500_000).unwrap();
        assert!((middle.state[X] - 1.0).abs() < 1e-12); // rounding
        assert!((middle.state[PSI].abs() - std::f64::consts::PI).abs() < 1e-12);
        assert!(truth.at(1_000_001).is_none());
        assert!((truth.horizontal_error_m(500_000, 4.0, 4.0).unwrap() - 5.0).abs() < 1e-12);
    }

    #[test]
    fn round_trip() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["truth.csv", "truth.csv.gz"] {
            let path = folder.path().join(name);
            let mut writer = TruthWriter::create(&path).unwrap();
            let rows = [row(0, 1.25, 0.5), row(10_000, 1.262_5, 0.5)];
            for row in &rows {
                writer.write(row).unwrap();
            }
            writer.finish().unwrap();
            assert_eq!(Truth::read(&path).unwrap().rows, rows);
        }
    }
}
