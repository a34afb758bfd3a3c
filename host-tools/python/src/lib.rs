//! The extension module `backseat._backseat`: the functions behind the commands, with arrays as bytes of doubles.
//!
//! Everything that a user sees (names, defaults, numpy, documentation) stands in `backseat/__init__.py`; this module
//! passes values on and computes nothing.

mod columns;
mod diagnose;
mod identify;
mod interruptible;
mod log;
mod navigate;
mod simulate;
mod vehicle;

use backseat_logs::with_hint;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::path::PathBuf;

/// Words of an error, and what to do about it here.
const HINTS: [(&str, &str); 5] = [
    ("exists already", "force=True replaces it"),
    (" does not fly: ", "Vehicle.check says more, force=True flies it"),
    ("a scenario, not a log", "simulate flies it and writes one"),
    ("needs a mapping of its columns", "backseat.map drafts one, read(table, mapping) reads by it"),
    ("without the latitude and longitude of their origin", "origin_deg states that of the vehicle's log"),
];

/// The error of a command as Python's.
fn error(error: impl Into<anyhow::Error>) -> PyErr {
    PyValueError::new_err(with_hint(format!("{:#}", error.into()), &HINTS))
}

/// A draft of the column mapping of another maker's table: its report as a JSON object.
#[pyfunction]
#[pyo3(name = "map")]
fn draft_map(py: Python<'_>, table: PathBuf) -> PyResult<String> {
    let draft = py.detach(|| backseat_logs::importers::draft(&table)).map_err(error)?;
    Ok(backseat_analysis::map::report(&draft, &table, None).to_json())
}

/// The module.
#[pymodule]
fn _backseat(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<log::Log>()?;
    module.add_class::<vehicle::Vehicle>()?;
    module.add_function(wrap_pyfunction!(draft_map, module)?)?;
    module.add_function(wrap_pyfunction!(navigate::navigate, module)?)?;
    module.add_function(wrap_pyfunction!(identify::identify, module)?)?;
    module.add_function(wrap_pyfunction!(diagnose::diagnose, module)?)?;
    module.add_function(wrap_pyfunction!(simulate::simulate, module)?)
}
