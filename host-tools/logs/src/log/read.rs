//! Reading a vehicle log.

use super::table::{self, Table};
use super::{Column, Log, LogRow, decimal::MAX_SECONDS};
use crate::DataError;
use std::path::Path;

impl Log {
    /// Reads a vehicle log (`.csv` or `.csv.gz`): `t_s` and any of the columns of [`Column`], in any
    /// order; other columns are ignored and noted, an empty cell is no sample.
    ///
    /// # Errors
    /// Where the file is not a vehicle log: line, column, what was expected.
    pub fn read(path: &Path) -> Result<Self, DataError> {
        let names = Column::ALL.map(Column::name);
        let hint =
            "a vehicle log has some of prop_rpm, fin_top_rad, depth_m, heading_rad, dvl_u_mps, range_m, gps_x_m …";
        let mut rows = Vec::new();
        let (notes, unused_columns) =
            table::read(path, &Table { names: &names, required: &[], hint }, |time_us, values| {
                rows.push(LogRow::of(time_us, values));
            })?;
        // seconds since 1970, not since some start: from 1973 on
        let is_unix = rows.first().is_some_and(|row| row.time_us > 100_000_000_000_000);
        let start_unix_us = is_unix.then_some(0);
        let log = Self { path: path.to_owned(), rows, notes, start_unix_us, unused_columns, ..Self::default() };
        log.check_acoustics()?;
        Ok(log)
    }

    /// A time of launch or arrival that is no time is an error of the file, not of the filter.
    fn check_acoustics(&self) -> Result<(), DataError> {
        for row in &self.rows {
            for column in [Column::Tol, Column::Toa] {
                if let Some(time_s) = row.get(column).filter(|time_s| !(0.0..MAX_SECONDS).contains(time_s)) {
                    let t_s = row.time_us as f64 * 1e-6;
                    let message = format!("{} at t_s {t_s}: {time_s} is outside 0 to {MAX_SECONDS} s", column.name());
                    return Err(DataError::file(&self.path, message));
                }
            }
        }
        Ok(())
    }
}
