//! `identify`.

use crate::error;
use crate::interruptible;
use crate::log::Log;
use crate::vehicle::Vehicle;
use anyhow::anyhow;
use backseat_analysis::identify::{IdentificationResult, SCALES, Settings};
use backseat_identify::Method;
use pyo3::prelude::*;

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
    let known = SCALES.into_iter().find(|(name, _)| *name == scale).map(|(_, scale)| scale);
    let settings = Settings {
        method: method.parse::<Method>().map_err(|message| error(anyhow!(message)))?,
        scale: known
            .ok_or_else(|| error(anyhow!("scale {scale:?}: expected {}", SCALES.map(|(name, _)| name).join(" or "))))?,
        cross_drag,
        current,
    };
    let compute = || -> anyhow::Result<_> {
        let found = IdentificationResult::of(
            &log.read,
            vehicle.map(|vehicle| &vehicle.file),
            validate.map(|log| &log.read),
            &settings,
        )?;
        let report = found.report().file("vehicle_file", None).file("report", None);
        let vehicle = found.vehicle().map(|(file, _)| Vehicle { file: file.clone() });
        Ok((report.to_json(), vehicle, wants_page.then(|| report.html())))
    };
    interruptible::run(py, compute)
}
