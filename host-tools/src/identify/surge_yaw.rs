//! Surge and yaw of a log that has servo counts in place of propeller speed and fin angles.

use super::Args;
use super::partial::{Coefficient, Horizon, Partial, Quantity};
use anyhow::bail;
use backseat_analysis::read_log::ReadLog;
use backseat_identify::surge_yaw::{NAMES, Prediction, SurgeYawData, UNITS};
use backseat_logs::{Column, Log, VehicleFile};
use serde_json::{Map, json};
use std::path::Path;

/// Share that is fitted; the rest is predicted.
const FITTED: f64 = 0.6;
/// Horizons of the predictions, s.
const HORIZONS_S: [f64; 3] = [5.0, 10.0, 30.0];

/// Whether a log has counts, and no actuators in SI.
pub fn is_for(log: &Log) -> bool {
    SurgeYawData::is_in(log) && !log.has(Column::PropRpm)
}

pub fn identify(args: &Args, path: &Path, read: &ReadLog, declared: &VehicleFile) -> anyhow::Result<Partial> {
    if args.out.is_some() {
        bail!(
            "{}: --out is not possible: surge and yaw in servo counts do not determine a vehicle file",
            path.display()
        );
    }
    let data = SurgeYawData::from_log(&read.log);
    let [first, rest] = data.split(FITTED);
    let (fitted, judge, judged_on) = match &args.validate {
        Some(path) => (data, SurgeYawData::from_log(&args.input.read(path)?.log), "the other log"),
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
        log: path.to_owned(),
        method: "surge-yaw",
        what: "surge and yaw in servo counts",
        fitted: format!(
            "fitted to {} samples in segments of 20 s; residual {:.3} m/s, {:.1} deg",
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
    })
}
