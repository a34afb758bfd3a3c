//! A torpedo in six degrees of freedom from runs of a minute without rates and fixes: what its textbook model lacks.
//!
//! ```text
//! entries          what such runs can show             selection   which of it they show, run by run
//! configurations   which runs were flown alike         carry       navigation without the DVL, judged by it
//! textbook         the model before anything is fitted      torque     the propeller's, by stops of the motor
//! fitted           a model, and what of it is needed         numbers    of an effect, and which are a finding
//! timing           when commands act, by the next rows           separable  how well effects could be told at all
//! ```

pub mod carry;
pub mod configurations;
pub mod entries;
mod fitted;
mod numbers;
mod selection;
pub mod separable;
mod textbook;
mod timing;
mod torque;

pub use numbers::{Parameter, t_quantile};
pub use selection::{Found, HORIZONS_S, Predictions, Step, TorpedoDiagnosis, diagnose};
pub use torque::Torque;

use backseat_identify::short_runs::{self, Draft, Run, predict::Squares};
use backseat_logs::log::Column;
use backseat_logs::{Log, VehicleFile};

/// Whether a log is one of short runs of a torpedo: what it does and what drives it, no fix.
#[must_use]
pub fn is_for(log: &Log) -> bool {
    let needed = [Column::PropRpm, Column::FinTop, Column::FinBottom, Column::FinPort, Column::FinStarboard];
    let motion = [Column::Roll, Column::Pitch, Column::Heading, Column::Depth, Column::DvlU];
    needed.iter().chain(&motion).all(|column| log.has(*column)) && !log.has(Column::GpsX)
}

/// Predictions of a log by a vehicle file, without fitting.
#[derive(Clone, Debug)]
pub struct Predicted {
    /// Label of each run, its configuration, its squares.
    pub runs: Vec<(String, Option<String>, Squares)>,
    /// Of no known configuration, and the like.
    pub notes: Vec<String>,
}

/// Open-loop predictions over a time of every run of a log.
///
/// # Errors
/// In one line: the log lacks a column, or a parameter is outside its range.
pub fn predict(log: &Log, vehicle: &VehicleFile, horizon_s: f64) -> Result<Predicted, String> {
    let mut runs = short_runs::runs(log);
    if runs.iter().all(|run| run.samples.is_empty()) {
        return Err("no row has roll, pitch, heading, depth, prop_rpm and four fins within a second".to_owned());
    }
    let declared = vehicle.short_runs.as_ref();
    let mut notes = configurations::assign(&mut runs, declared);
    // a file that `diagnose` wrote has the thrust of its runs
    let (vehicle, note) = match declared {
        Some(_) => (vehicle.clone(), Vec::new()),
        None => textbook::calibrated(vehicle, &runs),
    };
    notes.extend(note);
    let count = declared.map_or(1, |declared| declared.configurations.len());
    let models = Draft::of(&vehicle, count).models().map_err(|error| error.to_string())?;
    let squares = short_runs::predict::open_loop(&runs, &models, horizon_s);
    let name = |run: &Run| declared?.configurations.get(run.configuration).map(|of| of.name.clone());
    let runs = runs.iter().zip(squares).map(|(run, squares)| (run.label.clone(), name(run), squares)).collect();
    Ok(Predicted { runs, notes })
}
