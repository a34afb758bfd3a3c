//! `cargo lab vessel navigate`: dead reckoning by a manoeuvring model.

use super::data::ManoeuvringData;
use super::model::ManoeuvringModel;
use super::readings::{Reading, actuators, length_m, readings};
use anyhow::{Context, bail};
use backseat_analysis::read_log::ReadLog;
use backseat_estimation::dead_reckoning::{Position, errors_against_fixes};
use backseat_logs::stats::ErrorSummary;
use backseat_logs::{Column, Log, VehicleFile};
use backseat_report::{Report, console};
use std::path::PathBuf;

/// Command line.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Example:
  cargo lab vessel navigate ship3/log.csv --identify ship1/log.csv")]
pub struct Args {
    /// Log with the vessel's propellers, rudders, heading and fixes
    log: PathBuf,
    /// Log of the same vessel that its model is identified from [default: the same log]
    #[arg(long, value_name = "LOG2")]
    identify: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

impl Args {
    /// Identifies, navigates and prints the errors against the fixes that were withheld.
    ///
    /// # Errors
    /// A log that cannot be read, or lacks what the model needs.
    pub fn run(&self) -> anyhow::Result<()> {
        let read = ReadLog::of(&self.log, None)?;
        let fitted = self.identify.as_ref().map(|path| ReadLog::of(path, None)).transpose()?;
        let fitted = fitted.as_ref().unwrap_or(&read);
        let (length_m, _) = length_m(&fitted.log, &VehicleFile::reference());
        let model = ManoeuvringData::from_log(&fitted.log, length_m).fit()?.model;
        let errors = errors_against_fixes(&by_model(&read.log, &model)?, &read.log);
        let errors: Vec<f64> = errors.into_iter().map(|(_, error_m)| error_m).collect();
        let ErrorSummary { count, median_m, p95_m, max_m, .. } =
            ErrorSummary::of(&errors).context("no fix after the first of a run")?;
        let answer =
            format!("median {median_m:.2} m, 95 % {p95_m:.2} m, max {max_m:.2} m against {count} withheld fixes");
        let report = Report::new("A vessel by its manoeuvring model and its heading", answer)
            .value("median_m", median_m)
            .value("p95_m", p95_m)
            .value("max_m", max_m)
            .value("fixes", count);
        console::print(if self.json { report.to_json() } else { report.to_text() }.as_bytes())
    }
}

/// Positions by a manoeuvring model: it moves with the propeller and the rudder along the measured heading, and starts
/// each run at its first fix; later fixes are withheld.
fn by_model(log: &Log, model: &ManoeuvringModel) -> anyhow::Result<Vec<Position>> {
    let mut needed = model.actuators.iter().flatten().chain(&[Column::Heading, Column::GpsX, Column::GpsY]);
    if let Some(missing) = needed.find(|column| !log.has(**column)) {
        bail!("{}: no {}", log.path.display(), missing.name());
    }
    if actuators(log) != model.actuators {
        bail!("{}: other propellers and rudders than those of the model", log.path.display());
    }
    let start_us = log.rows.first().map_or(0, |row| row.time_us);
    let mut positions = Vec::new();
    for (_, run) in readings(log) {
        let Some(first) = run.iter().position(|reading| reading.position_m.is_some()) else { continue };
        let readings = &run[first..];
        let time_us = |reading: &Reading| start_us + (reading.t_s * 1e6).round() as u64;
        let track = readings.iter().zip(model.track(readings));
        positions.extend(track.map(|(reading, position_m)| Position { time_us: time_us(reading), position_m }));
    }
    if positions.len() < 2 {
        bail!("{}: no two rows with actuators, heading and a fix before", log.path.display());
    }
    Ok(positions)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vessel::model::Coefficient;
    use crate::vessel::planar::terms;
    use backseat_logs::LogRow;

    #[test]
    fn val_a_model_moves_with_its_propeller_along_the_heading() {
        let term = |axis: usize, name: &str| terms(axis, [1, 1]).position(|term| term.name == name).unwrap();
        let of = |name, value| Coefficient { axis: 0, term: term(0, name), value, ci95: None };
        let actuators = [vec![Column::PropRpm], vec![Column::Rudder]];
        let mut model = ManoeuvringModel { actuators, coefficients: vec![of("uu", -0.1), of("nn", 0.001)] };
        let row = |second: u64| {
            let mut row = LogRow::new(second * 1_000_000);
            row.set(Column::Heading, std::f64::consts::FRAC_PI_2);
            if second.is_multiple_of(50) {
                row.set_all(Column::GpsX, &[5.0, second as f64]);
            }
            // 10 rps: 1 m/s when 0.1 u² is 0.001 n²
            row.set(Column::PropRpm, 600.0).set(Column::Rudder, 0.0);
            row
        };
        let log = Log { rows: (0..=100).map(row).collect(), ..Log::default() };
        let positions = by_model(&log, &model).unwrap();
        let errors = errors_against_fixes(&positions, &log);
        // it starts at the speed of its fixes, 50 s apart: none; 1 m/s is reached with a time constant of 5 s
        let [north, east] = positions.last().unwrap().position_m;
        assert_eq!(errors.len(), 2);
        assert!((north - 5.0).abs() < 1e-9 && (93.0..=100.0).contains(&east), "{north} {east}");
        model.actuators[1].clear();
        assert!(by_model(&log, &model).unwrap_err().to_string().contains("other propellers and rudders"));
        assert!(by_model(&Log::default(), &model).unwrap_err().to_string().contains("no prop_rpm"));
    }
}
