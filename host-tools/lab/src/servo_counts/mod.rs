//! `cargo lab servo-counts`: surge and yaw of a log that has servo counts in place of propeller speed and fin angles.

mod fit;

use crate::partial::{Coefficient, Horizon, Partial, Quantity};
use backseat_analysis::read_log::ReadLog;
use backseat_logs::VehicleFile;
use backseat_report::console;
use fit::{NAMES, Prediction, SurgeYawData, UNITS};
use serde_json::{Map, json};
use std::path::PathBuf;

/// Share that is fitted; the rest is predicted.
const FITTED: f64 = 0.6;
/// Horizons of the predictions, s.
const HORIZONS_S: [f64; 3] = [5.0, 10.0, 30.0];

/// Command line.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Example:
  cargo lab servo-counts iver_mission.log --validate another_day.log")]
pub struct Args {
    /// UVC mission log of an Iver, or another with prop_count, fin_yaw_count, speed_log_mps and heading_rad
    log: PathBuf,
    /// Log for validation [default: the last two fifths of the log, held out]
    #[arg(long, value_name = "LOG2")]
    validate: Option<PathBuf>,
    /// Vehicle file that says what a count would be worth, TOML [default: the built-in reference vehicle]
    #[arg(long, value_name = "V.toml")]
    vehicle: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Identifies and prints the report.
///
/// # Errors
/// A log that cannot be read, or whose motion shows nothing.
pub fn run(arguments: &Args) -> anyhow::Result<()> {
    let declared =
        arguments.vehicle.as_ref().map_or_else(|| Ok(VehicleFile::reference()), |path| VehicleFile::read(path))?;
    let read = ReadLog::of(&arguments.log, None)?;
    let other = arguments.validate.as_ref().map(|path| ReadLog::of(path, None)).transpose()?;
    let report = identify(&read, other.as_ref(), &declared)?.report();
    console::print(if arguments.json { report.to_json() } else { report.to_text() }.as_bytes())
}

/// Fits surge and yaw, and predicts the other log or the last part of the same.
///
/// # Errors
/// The motion shows nothing.
fn identify(read: &ReadLog, other: Option<&ReadLog>, declared: &VehicleFile) -> anyhow::Result<Partial> {
    let data = SurgeYawData::from_log(&read.log);
    let [first, rest] = data.split(FITTED);
    let (fitted, judge, judged_on) = match other {
        Some(other) => (data, SurgeYawData::from_log(&other.log), "the other log"),
        None => (first, rest, "the last two fifths of the log, held out"),
    };
    let estimate = fitted.fit()?;
    let predictions: Vec<Prediction> =
        HORIZONS_S.iter().filter_map(|horizon| judge.predict(&estimate.coefficients, *horizon)).collect();
    let counts = estimate.counts(&declared.parameters);
    let mut notes = read.log.notes.clone();
    notes.push("the log has no propeller speed, fin angles and DVL velocity: only surge and yaw are identified, in servo counts".to_owned());
    let ten = predictions.iter().find(|p| p.horizon_s == 10.0);
    // The contract's columns: speed and yaw rate over ten seconds, the others were not measured.
    let validation = ten.map_or_else(Vec::new, |p| {
        vec![("u_mps", p.surge_mps[0]), ("r_degps", p.heading_rad[0].to_degrees() / p.horizon_s)]
    });
    let mut json = Map::new();
    json.insert(
        "count_is".to_owned(),
        json!({"propeller_radps": counts[0], "rudder_rad": counts[1], "if_the_vehicle_were": declared.name}),
    );
    let coefficient = |j: usize| Coefficient {
        name: NAMES[j].to_owned(),
        unit: UNITS[j],
        value: estimate.coefficients[j],
        ci95: estimate.ci95[j],
    };
    let horizon = |p: &Prediction| Horizon {
        horizon_s: p.horizon_s,
        count: p.count,
        quantities: vec![
            Quantity {
                name: "speed",
                unit: "m/s",
                keys: ["surge_rms_mps", "surge_if_it_stays_mps"],
                digits: 3,
                errors: p.surge_mps,
            },
            Quantity {
                name: "heading",
                unit: "deg",
                keys: ["heading_rms_deg", "heading_if_the_rate_stays_deg"],
                digits: 1,
                errors: p.heading_rad.map(f64::to_degrees),
            },
        ],
    };
    Ok(Partial {
        log: read.log.path.clone(),
        method: "surge-yaw",
        what: "surge and yaw in servo counts",
        fitted: format!(
            "{} samples in segments of 20 s; residual {:.3} m/s, {:.1} deg",
            estimate.samples,
            estimate.residual[0],
            estimate.residual[1].to_degrees()
        ),
        coefficients: (0..NAMES.len()).map(coefficient).collect(),
        horizons: predictions.iter().map(horizon).collect(),
        judged_on,
        goes_on: "speed, yaw rate stay",
        remarks: vec![format!(
            "if it were {}: a count is {:.2} rad/s of the propeller, {:.3} deg of the rudder",
            declared.name,
            counts[0],
            counts[1].to_degrees()
        )],
        notes,
        json,
        validation,
        doubts: read.examination.suspicions().map(|finding| finding.message.clone()).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_logs::importers::Imported;
    use backseat_logs::{Column, Log, LogRow};
    use serde_json::Value;

    #[test]
    fn a_log_in_servo_counts_gives_surge_and_yaw() {
        let mut log = Log::default();
        let (mut u, mut psi, mut r) = (0.5_f64, 0.0_f64, 0.0_f64);
        for k in 0..900_u32 {
            let t = f64::from(k);
            let (motor, rudder) = (35.0 + 15.0 * (t / 60.0).sin().signum(), 40.0 * (t / 9.0).sin());
            let mut row = LogRow::new(u64::from(k) * 1_000_000);
            row.set(Column::SpeedLog, u).set(Column::Heading, psi);
            row.set(Column::PropCount, motor).set(Column::YawFinCount, rudder);
            log.rows.push(row);
            for _ in 0..10 {
                u += 0.1 * (6.0e-5 * motor * motor - 0.12 * u * u);
                r += 0.1 * (-(0.2 + 0.4 * u) * r - 3.0e-3 * u * u * (rudder - 6.0));
                psi += 0.1 * r;
            }
        }
        let read = ReadLog::new(Imported { format: "", log });
        let report = identify(&read, None, &VehicleFile::reference()).unwrap().report();
        let json: Value = serde_json::from_str(&report.to_json()).unwrap();
        let value = |name: &str| json["parameters"][name]["value"].as_f64().unwrap();
        // The log's own Euler steps are coarser than the model's.
        assert!((value("surge_thrust_per_count2") / 6.0e-5 - 1.0).abs() < 0.1, "{json}");
        assert!((value("yaw_per_count") / -3.0e-3 - 1.0).abs() < 0.1, "{json}");
        assert!(json["validation"]["u_mps"].as_f64().unwrap() < 0.02, "{json}");
        assert!(json["validation"]["v_mps"].is_null());
    }
}
