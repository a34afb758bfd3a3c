//! `diagnose`.

use crate::columns::{Columns, bytes};
use crate::error;
use crate::interruptible;
use crate::log::Log;
use crate::navigate::{TrialLogs, join};
use crate::vehicle::Vehicle;
use anyhow::anyhow;
use backseat_analysis::diagnose::{DiagnosisResult, Files, TERMS_FILE, compute, gather, report, sentence, torpedo};
use backseat_analysis::effect::terms::Terms;
use backseat_diagnose::figures;
use backseat_diagnose::samples::ResidualChannel;
use backseat_logs::output::Existing;
use backseat_logs::{Truth, VehicleFile};
use pyo3::prelude::*;
use std::path::PathBuf;

/// JSON object, sentence, vehicle with the effects, page, figures by name.
type Found<'py> = (String, String, Vehicle, Option<String>, Vec<(String, Columns<'py>)>);

/// Finds which effect the declared vehicle lacks.
#[pyfunction]
#[pyo3(signature = (log, vehicle, truth, no_dvl, beside, run, trial, folder, force))]
#[allow(clippy::too_many_arguments)] // one for each of the command's flags
pub fn diagnose<'py>(
    py: Python<'py>,
    log: &Log,
    vehicle: Option<&Vehicle>,
    truth: Option<PathBuf>,
    no_dvl: bool,
    beside: Vec<PyRef<'py, Log>>,
    run: Option<u32>,
    trial: TrialLogs,
    folder: Option<PathBuf>,
    force: bool,
) -> PyResult<Found<'py>> {
    let mut read = log.read.clone();
    gather(&mut read.log, beside.iter().map(|other| other.read.log.clone()), run).map_err(error)?;
    let vehicle = vehicle.map(|vehicle| &vehicle.file);
    let declared = vehicle.cloned().unwrap_or_else(VehicleFile::reference);
    interruptible::run(py, || join(trial, &mut read, &declared))?;
    if torpedo::is_for(&read.log) {
        if truth.is_some() || no_dvl {
            return Err(error(anyhow!("truth= and dvl=False need a log with fixes: these are short runs without")));
        }
        let work = || {
            let result = torpedo::compute(&read, vehicle)?;
            let report = torpedo::report(&result, &read.log, None)?;
            Ok((result.diagnosis, report.to_json(), folder.is_some().then(|| report.html())))
        };
        let (found, json, page) = interruptible::run(py, work)?;
        return Ok((json, torpedo::answer(&found), Vehicle { file: found.vehicle }, page, Vec::new()));
    }
    let work = || -> anyhow::Result<_> {
        let truth = truth.map(|path| Truth::read(&path)).transpose()?;
        let result = compute(&read, vehicle, truth.as_ref(), no_dvl)?;
        let terms = Terms::of(&result.diagnosis.proposed, &result.diagnosis.effects);
        if let Some(folder) = folder.as_ref().filter(|_| !terms.is_empty()) {
            let existing = if force { Existing::Replace } else { Existing::Keep };
            terms.write(&folder.join(TERMS_FILE), &read.log.path.display().to_string(), existing)?;
        }
        let report = report(&result, &Files::default()).file("report", None);
        Ok((result, report.to_json(), folder.is_some().then(|| report.html())))
    };
    let (result, json, page) = interruptible::run(py, work)?;
    let (figures, sentence) = (figures_of(py, &result), sentence(&result));
    Ok((json, sentence, Vehicle { file: result.vehicle }, page, figures))
}

/// Innovations of every channel under the declared model and with the effects, and the errors of position.
fn figures_of<'py>(py: Python<'py>, result: &DiagnosisResult<'_>) -> Vec<(String, Columns<'py>)> {
    let mut found = Vec::new();
    for channel in ResidualChannel::ALL {
        let [before, after] =
            [&result.diagnosis.before, &result.diagnosis.after].map(|pass| figures::channel(pass, channel));
        if before.is_empty() || before.len() != after.len() {
            continue;
        }
        let columns = vec![
            ("t_s".to_owned(), bytes(py, before.iter().map(|residual| residual.t_s))),
            ("before".to_owned(), bytes(py, before.iter().map(|residual| residual.innovation))),
            ("after".to_owned(), bytes(py, after.iter().map(|residual| residual.innovation))),
            ("sigma".to_owned(), bytes(py, before.iter().map(|residual| residual.sigma))),
        ];
        found.push((format!("{} [{}]", channel.name(), channel.unit()), columns));
    }
    for (name, scores) in [("position error before [m]", &result.before), ("position error after [m]", &result.after)] {
        let columns = vec![
            ("t_s".to_owned(), bytes(py, scores.position_errors.iter().map(|(t_s, _)| *t_s))),
            ("error_m".to_owned(), bytes(py, scores.position_errors.iter().map(|(_, error_m)| *error_m))),
        ];
        found.push((name.to_owned(), columns));
    }
    found
}
