//! `navigate`.

use crate::columns::{Columns, bytes};
use crate::error;
use crate::interruptible;
use crate::log::Log;
use crate::vehicle::Vehicle;
use backseat_analysis::navigate::{Estimate, Model, NavigationResult, Settings, Trial, take_out_file, water};
use backseat_analysis::read_log::ReadLog;
use backseat_estimation::filter::TrackSample;
use backseat_logs::{STATE_COLUMNS, Truth, VehicleFile};
use backseat_report::Report;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::path::PathBuf;

/// JSON object, track, smoothed track, page (if it is wanted), what was learnt and what the head of its file says.
type Found<'py> = (String, Columns<'py>, Option<Columns<'py>>, Option<String>, Option<(Vehicle, String)>);
/// Logs of the ship's receiver and of modems, and the origin, degrees.
pub type TrialLogs = (Option<PathBuf>, Vec<PathBuf>, Option<[f64; 2]>);

/// Runs the navigation filter over a log.
#[pyfunction]
#[pyo3(signature = (log, vehicle, truth, model, switches, level, trial, terms, wants_page))]
#[allow(clippy::too_many_arguments)] // groups of the command's flags
pub fn navigate<'py>(
    py: Python<'py>,
    log: &Log,
    vehicle: Option<&Vehicle>,
    truth: Option<PathBuf>,
    model: Option<&str>,
    switches: [bool; 5],
    level: (String, f64),
    trial: TrialLogs,
    terms: Option<PathBuf>,
    wants_page: bool,
) -> PyResult<Found<'py>> {
    let [no_dvl, no_range_rate, current, packet, smooth] = switches;
    let model: Option<Model> =
        model.map(str::parse).transpose().map_err(|message: String| PyValueError::new_err(message))?;
    let (area, receiver_bias_m) = level;
    let water = water(&area).map_err(PyValueError::new_err)?;
    if !(0.0..=1e3).contains(&receiver_bias_m) {
        return Err(PyValueError::new_err(format!("receiver_bias_m {receiver_bias_m}: expected metres, 0 to 1000")));
    }
    let settings = Settings { model, no_dvl, no_range_rate, current, packet, smooth, water, receiver_bias_m };
    let truth = truth.map(|path| Truth::read(&path)).transpose().map_err(error)?;
    let declared = vehicle.map_or_else(VehicleFile::reference, |vehicle| vehicle.file.clone());
    let mut read = log.read.clone();
    interruptible::run(py, || {
        join(trial, &mut read, &declared)?;
        terms.map_or(Ok(()), |path| take_out_file(&mut read, &declared, &path))
    })?;
    let compute = || -> anyhow::Result<(NavigationResult<'_>, Report)> {
        let vehicle = vehicle.map(|vehicle| &vehicle.file);
        let result = backseat_analysis::navigate::compute(&read, vehicle, truth.as_ref(), &settings)?;
        let report = backseat_analysis::navigate::report(&result);
        Ok((result, report))
    };
    let (result, report) = interruptible::run(py, compute)?;
    let track = match &result.estimate {
        Estimate::Filter(run) => track(py, &run.track),
        Estimate::DeadReckoning(positions) => vec![
            ("t_s".to_owned(), bytes(py, positions.iter().map(|p| p.time_us as f64 / 1e6))),
            ("x_m".to_owned(), bytes(py, positions.iter().map(|p| p.position_m[0]))),
            ("y_m".to_owned(), bytes(py, positions.iter().map(|p| p.position_m[1]))),
        ],
    };
    let smoothed = result.estimate.smoothed().map(|samples| self::track(py, samples));
    let learnt = result.learnt(&declared).map(|file| (Vehicle { file }, result.learnt_source(&declared)));
    Ok((report.to_json(), track, smoothed, wants_page.then(|| report.html()), learnt))
}

/// Joins the logs of a trial to the vehicle's.
///
/// # Errors
/// As [`Trial::join`].
pub fn join((ship, modem, origin_deg): TrialLogs, read: &mut ReadLog, vehicle: &VehicleFile) -> anyhow::Result<()> {
    Trial { ship, modem, origin_deg }.join(read, vehicle)
}

fn track<'py>(py: Python<'py>, samples: &[TrackSample]) -> Columns<'py> {
    let column =
        |name: &str, value: &dyn Fn(&TrackSample) -> f64| (name.to_owned(), bytes(py, samples.iter().map(value)));
    let mut columns = vec![column("t_s", &|s| s.time_us as f64 / 1e6)];
    for (place, name) in STATE_COLUMNS.iter().enumerate() {
        columns.push(column(name, &|s| s.state[place]));
    }
    columns.push(column("current_n_mps", &|s| s.current_mps[0]));
    columns.push(column("current_e_mps", &|s| s.current_mps[1]));
    columns.push(column("sigma_x_m", &|s| s.sigma[0]));
    columns.push(column("sigma_y_m", &|s| s.sigma[1]));
    columns.push(column("cov_xy_m2", &|s| s.cov_xy_m2));
    columns
}
