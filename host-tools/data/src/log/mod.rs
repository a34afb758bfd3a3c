//! The vehicle log: what a lab exports from any vehicle, one row a time, and the truth beside it.

mod column;
mod decimal;
pub mod plausibility;
mod read;
mod sink;
pub(crate) mod table;
mod truth;
mod write;

pub use column::Column;
pub(crate) use decimal::MAX_SECONDS;
pub use truth::{Truth, TruthRow, TruthWriter};
pub use write::LogWriter;

use backseat_core::dynamics::ActuatorInput;
use std::f64::consts::PI;
use std::path::PathBuf;

/// rad/s in one rpm.
pub const RADPS_PER_RPM: f64 = PI / 30.0;

/// One row of a vehicle log: a time and the samples taken then.
#[derive(Clone, Copy)]
pub struct LogRow {
    /// Time, µs.
    pub time_us: u64,
    /// NaN where there is no sample; never NaN otherwise.
    values: [f64; Column::COUNT],
}

impl LogRow {
    /// A row without samples.
    #[must_use]
    pub const fn new(time_us: u64) -> Self {
        Self { time_us, values: [f64::NAN; Column::COUNT] }
    }

    /// The sample of a column, in the unit of its name.
    #[must_use]
    pub fn get(&self, column: Column) -> Option<f64> {
        let value = self.values[column as usize];
        (!value.is_nan()).then_some(value)
    }

    /// Sets the sample of a column (NaN: no sample).
    pub fn set(&mut self, column: Column, value: f64) -> &mut Self {
        self.values[column as usize] = value;
        self
    }

    /// Sets the samples of consecutive columns, `first` and those after it.
    pub fn set_all(&mut self, first: Column, values: &[f64]) -> &mut Self {
        for (slot, value) in self.values[first as usize..].iter_mut().zip(values) {
            *slot = *value;
        }
        self
    }

    /// Whether no column has a sample.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.values.iter().all(|value| value.is_nan())
    }

    fn group<const N: usize>(&self, first: Column) -> Option<[f64; N]> {
        let values: [f64; N] = self.values[first as usize..][..N].try_into().ok()?;
        (!values.iter().any(|value| value.is_nan())).then_some(values)
    }

    /// Commanded propeller and fins; `None` unless all five are there.
    #[must_use]
    pub fn actuators(&self) -> Option<ActuatorInput> {
        let [rpm, top, bottom, port, starboard] = self.group(Column::PropRpm)?;
        Some(ActuatorInput { propeller_radps: rpm * RADPS_PER_RPM, fins_rad: [top, bottom, port, starboard] })
    }

    /// Sets the commanded propeller and fins.
    pub fn set_actuators(&mut self, input: &ActuatorInput) -> &mut Self {
        self.set(Column::PropRpm, input.propeller_radps / RADPS_PER_RPM).set_all(Column::FinTop, &input.fins_rad)
    }

    /// φ, θ, ψ, rad; `None` unless all three are there.
    #[must_use]
    pub fn attitude_rad(&self) -> Option<[f64; 3]> {
        self.group(Column::Roll)
    }

    /// p, q, r, rad/s; `None` unless all three are there.
    #[must_use]
    pub fn rates_radps(&self) -> Option<[f64; 3]> {
        self.group(Column::P)
    }

    /// DVL velocity over ground in body axes, m/s; `None` unless all three are there.
    #[must_use]
    pub fn dvl_mps(&self) -> Option<[f64; 3]> {
        self.group(Column::DvlU)
    }

    /// North, east of the ship at time of launch, m.
    #[must_use]
    pub fn ship_at_launch_m(&self) -> Option<[f64; 2]> {
        self.group(Column::ShipX)
    }

    /// GNSS of the ship: north, east, m.
    #[must_use]
    pub fn ship_gnss_m(&self) -> Option<[f64; 2]> {
        self.group(Column::ShipGpsX)
    }

    /// GNSS of the surfaced vehicle: north, east, m.
    #[must_use]
    pub fn gnss_m(&self) -> Option<[f64; 2]> {
        self.group(Column::GpsX)
    }

    /// Time of launch of the packet whose range is in this row, µs.
    #[must_use]
    pub fn launch_us(&self) -> Option<u64> {
        self.get(Column::Tol).map(decimal::seconds_to_us)
    }

    /// Time of arrival of the packet whose range is in this row, µs.
    #[must_use]
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

impl PartialEq for LogRow {
    /// Rows are equal when their samples are; two missing samples are equal.
    fn eq(&self, other: &Self) -> bool {
        self.time_us == other.time_us
            && self.values.iter().zip(&other.values).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()))
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
    /// Samples are those of the centre of gravity ([`inputs::at_centre`](crate::inputs::at_centre)), not of the sensors.
    pub at_centre: bool,
    /// µs since 1970 of time 0, where the log has a date; of the clock that the log was written by.
    pub start_unix_us: Option<i64>,
    /// Latitude and longitude of the origin of its positions, degrees, where it has them.
    pub origin_deg: Option<[f64; 2]>,
}

impl Log {
    /// From the first to the last row, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        match (self.rows.first(), self.rows.last()) {
            (Some(first), Some(last)) => (last.time_us - first.time_us) as f64 * 1e-6,
            _ => 0.0,
        }
    }

    /// Times (µs) and samples of a column.
    pub fn column(&self, column: Column) -> impl Iterator<Item = (u64, f64)> + '_ {
        self.rows.iter().filter_map(move |row| row.get(column).map(|value| (row.time_us, value)))
    }

    /// Adds the rows of another log of the same time base, in order of time.
    pub fn join(&mut self, other: Self) {
        self.rows.extend(other.rows);
        // Stable: of two rows at one time the own one stays first.
        self.rows.sort_by_key(|row| row.time_us);
        self.notes.extend(other.notes);
    }

    /// Whether any row has a sample of this column.
    #[must_use]
    pub fn has(&self, column: Column) -> bool {
        self.column(column).next().is_some()
    }
}
