//! `simulate`.

use crate::error;
use crate::interruptible;
use crate::vehicle::Vehicle;
use anyhow::anyhow;
use backseat_analysis::sim::{self, Options};
use hil_sim::scenario::Request;
use pyo3::prelude::*;
use std::path::PathBuf;

/// A mission of the simulator, the backseat in this process: its JSON object and its folder.
#[pyfunction]
#[pyo3(signature = (scenario, vehicle, seed, minutes, effects, out, force))]
#[allow(clippy::too_many_arguments)] // one for each of Python's
pub fn simulate(
    py: Python<'_>,
    scenario: Option<PathBuf>,
    vehicle: Option<&Vehicle>,
    seed: Option<u64>,
    minutes: Option<f64>,
    effects: Vec<String>,
    out: Option<PathBuf>,
    force: bool,
) -> PyResult<(String, String)> {
    let effects: Result<Vec<Request>, String> = effects.iter().map(|text| Request::parse(text)).collect();
    let options = Options {
        scenario,
        vehicle: vehicle.map(|vehicle| vehicle.file.clone()),
        force,
        seed,
        effects: effects.map_err(|message| error(anyhow!(message)))?,
        minutes,
        out,
        backseat: "host".to_owned(),
        ..Options::default()
    };
    let (flown, report) = interruptible::run(py, || sim::simulate(&options))?;
    Ok((report.to_json(), flown.folder.display().to_string()))
}
