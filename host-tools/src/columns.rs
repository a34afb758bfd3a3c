//! `--columns`: how the columns of a table of any other maker are named and scaled.

use backseat_data::DataError;
use backseat_data::importers::{self, ColumnMap, Imported};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub struct Columns {
    /// How the columns of the log's table are named and scaled: `[time]` column, unit (s, ms, us, min, h, hms), base
    /// (start or epoch); for each column of the vehicle log, as `[columns.depth_m]`, column, unit, sign, scale, offset
    #[arg(long = "columns", value_name = "MAP.toml")]
    map: Option<PathBuf>,
}

impl Columns {
    /// A log by the mapping, or in whichever format it is.
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
