//! `cargo lab vessel identify`: surge, sway and yaw of a vessel with propellers and rudders.

use super::data::{ManoeuvringData, ManoeuvringEstimate, ManoeuvringPrediction};
use super::model::AXES;
use super::readings::length_m;
use crate::partial::{self, Horizon, Partial, Quantity};
use backseat_analysis::read_log::ReadLog;
use backseat_logs::VehicleFile;
use backseat_logs::output::{Existing, write};
use backseat_report::console;
use serde_json::{Map, json};
use std::path::PathBuf;

/// Command line.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Example:
  cargo lab vessel identify ship1/log.csv --validate ship3/log.csv")]
pub struct Args {
    /// Log with prop_rpm (or commands of thrusters), rudder_rad, heading_rad, and dvl_u_mps, dvl_v_mps, r_radps or the
    /// positions gps_x_m, gps_y_m
    log: PathBuf,
    /// Log for validation [default: the last two fifths of each stretch under way, held out]
    #[arg(long, value_name = "LOG2")]
    validate: Option<PathBuf>,
    /// Write a page; never over an earlier one
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

impl Args {
    /// Identifies and prints the report.
    ///
    /// # Errors
    /// A log that cannot be read, or whose motion shows nothing; a page that cannot be written.
    pub fn run(&self) -> anyhow::Result<()> {
        let read = ReadLog::of(&self.log, None)?;
        let other = self.validate.as_ref().map(|path| ReadLog::of(path, None)).transpose()?;
        let report = identify(&read, other.as_ref(), &VehicleFile::reference())?.report();
        if let Some(path) = &self.report {
            write(path, Existing::Keep, |file| file.write_all(report.html().as_bytes()))?;
        }
        console::print(if self.json { report.to_json() } else { report.to_text() }.as_bytes())
    }
}

/// Share of each run that is fitted; the rest is predicted.
const FITTED: f64 = 0.6;
/// Horizons of the predictions, s.
const HORIZONS_S: [f64; 3] = [5.0, 10.0, 30.0];

/// Fits surge, sway and yaw, and predicts the other log or the last part of the same.
///
/// # Errors
/// The motion shows nothing.
fn identify(read: &ReadLog, other: Option<&ReadLog>, declared: &VehicleFile) -> anyhow::Result<Partial> {
    let (length_m, is_stated) = length_m(&read.log, declared);
    let data = ManoeuvringData::from_log(&read.log, length_m);
    let [first, rest] = data.split(FITTED);
    let (fitted, judge, judged_on) = match other {
        Some(other) => (data, ManoeuvringData::from_log(&other.log, length_m), "the other log"),
        None => (first, rest, "the last two fifths of each stretch under way, held out"),
    };
    let estimate = fitted.fit()?;
    let predictions: Vec<ManoeuvringPrediction> =
        HORIZONS_S.iter().filter_map(|horizon| judge.predict(&estimate.model, *horizon)).collect();
    let mut notes = read.log.notes.clone();
    notes.push(
        "the log has propeller, rudder and heading, but not the columns of a whole vehicle: surge, sway and yaw of a \
         vessel on or near the surface are identified"
            .to_owned(),
    );
    if !is_stated {
        notes.push(format!("the log states no length_m: {length_m} m, of {}", declared.name));
    }
    if fitted.measured() != [true; 3] {
        notes.push("the log lacks velocities: they follow from positions and heading".to_owned());
    }
    let validation = predictions.iter().find(|p| p.horizon_s == 10.0).map_or_else(Vec::new, |p| {
        vec![("u_mps", p.speed_mps[0]), ("r_degps", p.heading_rad[0].to_degrees() / p.horizon_s)]
    });
    let mut json = Map::new();
    json.insert("length_m".to_owned(), json!(length_m));
    let model = &estimate.model;
    let coefficients = model
        .coefficients
        .iter()
        .map(|coefficient| {
            let (name, unit) = model.name(coefficient);
            partial::Coefficient {
                name: format!("{}_{name}", AXES[coefficient.axis]),
                unit,
                value: coefficient.value,
                ci95: coefficient.ci95.unwrap_or([f64::NAN; 2]),
            }
        })
        .collect();
    Ok(Partial {
        log: read.log.path.clone(),
        method: "manoeuvring",
        what: "surge, sway and yaw of a vessel with propeller and rudder",
        fitted: fitted_text(&estimate),
        coefficients,
        horizons: predictions.iter().map(horizon).collect(),
        judged_on,
        goes_on: "speed and yaw rate stay",
        remarks: vec![
            "u, v: surge, sway [m/s]; r: yaw rate [rad/s]; n: propeller [rps]; d: sine of the rudder angle. Terms that the log \
             does not tell apart are left out: another propeller speed or other manoeuvres would show them."
                .to_owned(),
        ],
        notes,
        json,
        validation,
        doubts: read.examination.suspicions().map(|finding| finding.message.clone()).collect(),
    })
}

fn fitted_text(estimate: &ManoeuvringEstimate) -> String {
    let (segments, segment_s) = estimate.segments;
    let units = ["u", "v", "r", "heading", "north", "east"].into_iter().zip(estimate.residual);
    let residuals: Vec<String> = units
        .filter_map(|(name, residual)| {
            let residual = residual?;
            Some(match name {
                "u" | "v" => format!("{name} {residual:.4} m/s"),
                "r" => format!("r {:.3} deg/s", residual.to_degrees()),
                "heading" => format!("heading {:.2} deg", residual.to_degrees()),
                _ => format!("{name} {residual:.3} m"),
            })
        })
        .collect();
    format!("{segments} segments of {segment_s:.0} s; residual {}", residuals.join(", "))
}

fn horizon(p: &ManoeuvringPrediction) -> Horizon {
    let quantity = |name, unit, keys, digits, errors| Quantity { name, unit, keys, digits, errors };
    let mut quantities = vec![
        quantity("speed", "m/s", ["speed_rms_mps", "speed_if_it_stays_mps"], 3, p.speed_mps),
        quantity(
            "heading",
            "deg",
            ["heading_rms_deg", "heading_if_the_rate_stays_deg"],
            1,
            p.heading_rad.map(f64::to_degrees),
        ),
    ];
    if p.position_m[0].is_finite() {
        let keys = ["position_rms_m", "position_if_it_goes_on_m"];
        quantities.push(quantity("position", "m", keys, 2, p.position_m));
    }
    Horizon { horizon_s: p.horizon_s, count: p.count, quantities }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vessel::ship::{Voyage, simulate};
    use backseat_logs::importers::Imported;
    use serde_json::Value;

    #[test]
    #[ignore = "half a minute without optimisation: .ci/nightly"]
    fn a_vessel_without_velocities_is_identified() {
        let voyage = Voyage { duration_s: 1800.0, velocities: false, wind_mps: [0.0; 2], noise: true };
        let read = ReadLog::new(Imported { format: "", log: simulate(&voyage, 1).0 });
        let report = identify(&read, None, &VehicleFile::reference()).unwrap().report();
        let json: Value = serde_json::from_str(&report.to_json()).unwrap();
        assert_eq!(json["method"], "manoeuvring");
        // drag opposes and thrust drives
        assert!(json["parameters"]["surge_uu"]["value"].as_f64() < Some(0.0), "{json}");
        assert!(json["parameters"]["surge_nn"]["value"].as_f64() > Some(0.0), "{json}");
        let thirty = &json["predictions"][2];
        let errors = ["heading_rms_deg", "heading_if_the_rate_stays_deg"].map(|key| thirty[key].as_f64().unwrap());
        assert!(thirty["horizon_s"] == 30.0 && errors[0] < 0.5 * errors[1], "{thirty}");
    }
}
