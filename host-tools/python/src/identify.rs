//! `identify`.

use crate::error;
use crate::log::Log;
use crate::vehicle::Vehicle;
use anyhow::anyhow;
use clap::ValueEnum;
use host_tools::library::{self, IdentificationSettings, Known, Method};
use pyo3::prelude::*;

/// A choice by its name on the command line.
fn choice<T: ValueEnum>(what: &str, name: &str) -> PyResult<T> {
    T::from_str(name, false).map_err(|_| {
        let known: Vec<String> = T::value_variants()
            .iter()
            .filter_map(|variant| Some(variant.to_possible_value()?.get_name().to_owned()))
            .collect();
        error(anyhow!("{what} {name:?}: expected one of {}", known.join(", ")))
    })
}

/// Identifies a vehicle: JSON object, the identified vehicle if any parameter moved, page if it is wanted.
#[pyfunction]
#[pyo3(signature = (log, vehicle, validate, method, scale, cross_drag, current, wants_page))]
#[allow(clippy::too_many_arguments)] // one for each of the command's flags
pub fn identify(
    py: Python<'_>,
    log: &Log,
    vehicle: Option<&Vehicle>,
    validate: Option<&Log>,
    method: &str,
    scale: &str,
    cross_drag: bool,
    current: Vec<f64>,
    wants_page: bool,
) -> PyResult<(String, Option<Vehicle>, Option<String>)> {
    let settings = IdentificationSettings {
        method: choice::<Method>("method", method)?,
        scale: choice::<Known>("scale", scale)?,
        cross_drag,
        current,
    };
    let compute = || -> anyhow::Result<_> {
        let declared = vehicle.map(|vehicle| &vehicle.file);
        let result = library::identify(&log.read, declared, validate.map(|log| &log.read), &settings)?;
        let page = wants_page.then(|| library::identification_page(&result));
        let json = result.json([None, None]);
        Ok((json, result.is_changed.then_some(Vehicle { file: result.identified }), page))
    };
    py.detach(compute).map_err(error)
}
