//! The extension module `backseat._backseat`: the functions behind the commands, with arrays as bytes of doubles.
//!
//! Everything that a user sees (names, defaults, numpy, documentation) stands in `backseat/__init__.py`; this module
//! passes values on and computes nothing.

mod columns;
mod diagnose;
mod identify;
mod log;
mod navigate;
mod simulate;
mod vehicle;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The error of a command as Python's.
fn error(error: impl Into<anyhow::Error>) -> PyErr {
    PyValueError::new_err(format!("{:#}", error.into()))
}

/// The module.
#[pymodule]
fn _backseat(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<log::Log>()?;
    module.add_class::<vehicle::Vehicle>()?;
    module.add_function(wrap_pyfunction!(navigate::navigate, module)?)?;
    module.add_function(wrap_pyfunction!(identify::identify, module)?)?;
    module.add_function(wrap_pyfunction!(diagnose::diagnose, module)?)?;
    module.add_function(wrap_pyfunction!(simulate::simulate, module)?)
}
