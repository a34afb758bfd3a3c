//! Tables that are known by their headers: `formats.toml`, with columns as those of a mapping.

use super::format::{Format, Known, Role};
use crate::log::Column;
use crate::log::units;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::sync::LazyLock;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: Vec<Written>,
}

/// A format and the names of its header that no other has.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    name: String,
    header: Vec<String>,
    #[serde(default = "comma")]
    separators: String,
    #[serde(default)]
    needed: Vec<String>,
    #[serde(default)]
    every_column_needed: bool,
    file_is_run: Option<Vec<String>>,
    #[serde(default)]
    constants: BTreeMap<String, f64>,
    #[serde(default)]
    dropped: Vec<(String, String)>,
    #[serde(default)]
    remarks: Vec<String>,
    columns: Vec<WrittenColumn>,
}

/// A column, or a number of a message: (value + offset) * scale * unit is what it becomes.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenColumn {
    pub column: String,
    /// Of a message: the number that it is a difference over.
    pub per: Option<String>,
    to: String,
    unit: Option<String>,
    #[serde(default = "one")]
    scale: f64,
    #[serde(default)]
    pub offset: f64,
}

fn comma() -> String {
    ",".to_owned()
}

pub(super) fn one() -> f64 {
    1.0
}

/// Names of their headers that no other has, and the formats.
pub(super) static FORMATS: LazyLock<Vec<(Vec<String>, Format)>> = LazyLock::new(|| {
    let file: File = toml::from_str(include_str!("formats.toml")).expect("formats.toml is TOML");
    file.format.into_iter().map(|written| (written.header.clone(), format(written))).collect()
});

fn column_of(name: &str) -> Column {
    Column::from_name(name).expect("our own files name columns of the vehicle log")
}

fn format(written: Written) -> Format {
    Format {
        columns: written.columns.iter().map(|w| Known { name: w.column.clone(), role: w.role() }).collect(),
        constants: written.constants.iter().map(|(name, value)| (column_of(name), *value)).collect(),
        name: written.name,
        separators: written.separators.into_bytes(),
        needed: written.needed,
        every_column_needed: written.every_column_needed,
        file_is_run: written.file_is_run,
        dropped: written.dropped,
        remarks: written.remarks,
    }
}

impl WrittenColumn {
    /// The column of the vehicle log, and the factor to its unit.
    pub(super) fn sample(&self) -> (Column, f64) {
        let unit = self.unit.as_ref().map_or(1.0, |unit| units::factor(&self.to, unit).expect("a unit of mappings"));
        (column_of(&self.to), self.scale * unit)
    }

    fn role(&self) -> Role {
        match self.to.as_str() {
            "seconds" => Role::Seconds(self.scale),
            "epoch" => Role::Epoch(self.scale),
            "time_of_day" => Role::TimeOfDay,
            "date" => Role::Date,
            "arrival" => Role::Arrival,
            "latitude_deg" => Role::Place { axis: 0, is_in_radians: false },
            "longitude_deg" => Role::Place { axis: 1, is_in_radians: false },
            "satellites" => Role::Satellites,
            "fix_status" => Role::FixStatus,
            "run" => Role::Run,
            "left_out" => Role::LeftOut,
            "label_of_station" => Role::Label(Column::Station),
            _ => {
                let (column, scale) = self.sample();
                Role::Sample { column, scale, offset: self.offset }
            }
        }
    }
}
