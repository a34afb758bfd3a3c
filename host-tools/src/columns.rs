//! `--columns`: mapping of the columns of another maker's table.

use backseat_data::DataError;
use backseat_data::importers::{self, ColumnMap, Imported};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub struct Columns {
    /// Column mapping for a table of another maker: `[time]` with column, unit (s, ms, us, min, h, hms) and base (start or
    /// epoch), and for each column of the vehicle log, such as `[columns.depth_m]`, its column, unit, sign, scale, offset
    #[arg(long = "columns", value_name = "MAP.toml")]
    map: Option<PathBuf>,
}

impl Columns {
    /// Reads the log by the mapping, or by its own format.
    ///
    /// # Errors
    /// The log or the mapping cannot be read.
    pub fn import(&self, log: &Path) -> Result<Imported, DataError> {
        match &self.map {
            Some(map) => importers::read_mapped(log, &ColumnMap::read(map)?),
            None => importers::read(log),
        }
    }
}
