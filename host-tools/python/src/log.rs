//! A vehicle log.

use crate::columns::{self, Columns};
use crate::error;
use backseat_logs::importers::Imported;
use backseat_logs::log::{Column, LogRow};
use host_tools::library::ReadLog;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::path::PathBuf;

/// A log that was read or made of arrays, and what is doubtful about it.
#[pyclass(frozen)]
pub struct Log {
    pub read: ReadLog,
}

#[pymethods]
impl Log {
    /// Reads a file of any format that the commands read, or by a column mapping.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf, mapping: Option<PathBuf>) -> PyResult<Self> {
        py.detach(|| {
            let mut read = ReadLog::of(&path, mapping.as_deref())?;
            read.note_findings();
            Ok(Self { read })
        })
        .map_err(|failure: backseat_logs::DataError| error(failure))
    }

    /// Makes a log of columns with the names of the vehicle log, in order of time.
    #[staticmethod]
    fn from_columns(name: PathBuf, t_s: &[u8], given: Vec<(String, Vec<u8>)>) -> PyResult<Self> {
        let refuse = |message: String| Err(PyValueError::new_err(message));
        let times_s = columns::numbers("t_s", t_s)?;
        let mut rows = Vec::with_capacity(times_s.len());
        for (place, time_s) in times_s.iter().enumerate() {
            // as in a file
            if !(0.0..4e9).contains(time_s) {
                return refuse(format!("t_s[{place}] is {time_s}: expected seconds from 0 to 4e9"));
            }
            rows.push(LogRow::new((time_s * 1e6).round() as u64));
        }
        if let Some(place) = rows.windows(2).position(|pair| pair[1].time_us < pair[0].time_us) {
            return refuse(format!("t_s[{}] is before t_s[{place}]: sort the rows by time", place + 1));
        }
        for (name, bytes) in &given {
            let Some(column) = Column::from_name(name) else {
                let known: Vec<&str> = Column::ALL.iter().map(|column| column.name()).collect();
                return refuse(format!("{name}: a vehicle log has no such column; it has {}", known.join(", ")));
            };
            let values = columns::numbers(name, bytes)?;
            if values.len() != rows.len() {
                return refuse(format!("{name} has {} values, t_s has {}", values.len(), rows.len()));
            }
            for (row, value) in rows.iter_mut().zip(values) {
                if value.is_infinite() {
                    return refuse(format!("{name} is infinite at t_s {}", row.time_us as f64 / 1e6));
                }
                row.set(column, value);
            }
        }
        let log = backseat_logs::Log { path: name, rows, ..backseat_logs::Log::default() };
        let mut read = ReadLog::new(Imported { format: "vehicle log", log });
        read.note_findings();
        Ok(Self { read })
    }

    /// Where it came from.
    #[getter]
    fn path(&self) -> String {
        self.read.log.path.display().to_string()
    }

    /// Name of its format.
    #[getter]
    fn format(&self) -> &'static str {
        self.read.format
    }

    /// What the reader recognised, assumed and left out, and the findings.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.read.log.notes.clone()
    }

    /// What contradicts units, signs and times, and should not be trusted.
    #[getter]
    fn suspicions(&self) -> Vec<String> {
        self.read.examination.suspicions().map(|finding| finding.message.clone()).collect()
    }

    /// `t_s` and every column with samples.
    fn columns<'py>(&self, py: Python<'py>) -> Columns<'py> {
        let rows = &self.read.log.rows;
        let mut columns = vec![("t_s".to_owned(), columns::bytes(py, rows.iter().map(|row| row.time_us as f64 / 1e6)))];
        for column in Column::ALL.into_iter().filter(|column| self.read.log.has(*column)) {
            let values = rows.iter().map(|row| row.get(column).unwrap_or(f64::NAN));
            columns.push((column.name().to_owned(), columns::bytes(py, values)));
        }
        columns
    }
}
