//! A vehicle file.

use crate::error;
use anyhow::anyhow;
use backseat_logs::VehicleFile;
use backseat_logs::output::Existing;
use pyo3::prelude::*;
use std::path::{Path, PathBuf};

/// A vehicle: parameters, noise, installation, safety limits, effects.
#[pyclass(frozen)]
pub struct Vehicle {
    pub file: VehicleFile,
}

#[pymethods]
impl Vehicle {
    /// The built-in reference vehicle.
    #[staticmethod]
    fn reference() -> Self {
        Self { file: VehicleFile::reference() }
    }

    /// Reads a vehicle file.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        VehicleFile::read(&path).map(|file| Self { file }).map_err(error)
    }

    /// A vehicle from the text of its file.
    #[staticmethod]
    fn parse(text: &str) -> PyResult<Self> {
        VehicleFile::parse(text, Path::new("vehicle.toml")).map(|file| Self { file }).map_err(error)
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.file.name
    }

    /// Every number by its key.
    fn parameters(&self) -> Vec<(String, f64)> {
        self.file.flatten()
    }

    /// A copy with other numbers.
    fn with_parameters(&self, given: Vec<(String, f64)>) -> PyResult<Self> {
        let mut file = self.file.clone();
        file.apply(given).map_err(|message| error(anyhow!(message)))?;
        Ok(Self { file })
    }

    /// The text of the vehicle file; `source` is its first comment.
    fn to_toml(&self, source: &str) -> String {
        self.file.to_toml(source)
    }

    /// Writes the vehicle file.
    fn write(&self, path: PathBuf, source: &str, force: bool) -> PyResult<()> {
        let existing = if force { Existing::Replace } else { Existing::Keep };
        self.file.write(&path, source, existing).map_err(error)
    }

    /// The JSON object of `backseat vehicle check`.
    fn check(&self, py: Python<'_>, speed_mps: f64) -> PyResult<String> {
        py.detach(|| host_tools::library::examination(&self.file, speed_mps)).map_err(error)
    }
}
