//! The vehicle file: everything declared about a vehicle, in TOML with units and ranges.

use crate::DataError;
use backseat_core::dynamics::VehicleParameters;
use backseat_core::navigation::{ProcessNoise, SensorNoise};
use std::path::Path;

/// What a vehicle file declares.
#[derive(Clone, Debug, PartialEq)]
pub struct VehicleFile {
    /// Name of the vehicle.
    pub name: String,
    /// Plant and actuators.
    pub parameters: VehicleParameters,
    /// Process noise of the dynamic model.
    pub noise: ProcessNoise,
    /// One-sigma noise of the sensors.
    pub sensors: SensorNoise,
}

impl VehicleFile {
    /// The built-in reference vehicle, `vehicles/iver3.toml`.
    #[must_use]
    pub fn reference() -> Self {
        todo!()
    }

    /// Reads a vehicle file.
    ///
    /// # Errors
    /// The first key that is unknown, missing, of the wrong type or out of its range: line, column.
    pub fn read(_path: &Path) -> Result<Self, DataError> {
        todo!()
    }

    /// Parses the text of a vehicle file; `path` is for the messages.
    ///
    /// # Errors
    /// As [`VehicleFile::read`].
    pub fn parse(_text: &str, _path: &Path) -> Result<Self, DataError> {
        todo!()
    }

    /// The text of a vehicle file, with unit and range beside every number.
    #[must_use]
    pub fn to_toml(&self) -> String {
        todo!()
    }

    /// Every number under its dotted key: `vehicle.mass_kg`, `inertia.m_diag[0]`, `fins.cp_m[1][2]` …
    /// (also the names of the board's parameters).
    #[must_use]
    pub fn flatten(&self) -> Vec<(String, f64)> {
        todo!()
    }

    /// Sets one number by its dotted key; the set as a whole is checked by
    /// [`VehicleParameters::validate`].
    ///
    /// # Errors
    /// If the key is unknown or the value is outside its range, in one line.
    pub fn set(&mut self, _key: &str, _value: f64) -> Result<(), String> {
        todo!()
    }
}
