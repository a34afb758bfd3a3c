//! Surge, sway and yaw of a vessel with propellers and rudders.

use super::Args;
use super::partial::{self, Horizon, Partial, Quantity};
use backseat_analysis::read_log::ReadLog;
use backseat_identify::manoeuvring::{ManoeuvringData, ManoeuvringEstimate, ManoeuvringPrediction};
use backseat_logs::log::Column;
use backseat_logs::manoeuvring::AXES;
use backseat_logs::{ManoeuvringModel, VehicleFile};
use serde_json::{Map, json};
use std::path::Path;

/// Share of each run that is fitted; the rest is predicted.
const FITTED: f64 = 0.6;
/// Horizons of the predictions, s.
const HORIZONS_S: [f64; 3] = [5.0, 10.0, 30.0];

pub fn identify(
    args: &Args,
    path: &Path,
    read: &ReadLog,
    declared: &VehicleFile,
) -> anyhow::Result<(Partial, ManoeuvringModel)> {
    let stated = read.log.column(Column::Length).next();
    let length_m = stated.map_or(declared.parameters.length_m, |(_, length_m)| length_m);
    let data = ManoeuvringData::from_log(&read.log, length_m);
    let [first, rest] = data.split(FITTED);
    let (fitted, judge, judged_on) = match &args.validate {
        Some(path) => {
            let other = ManoeuvringData::from_log(&args.input.read(path)?.log, length_m);
            (data, other, "the other log")
        }
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
    if stated.is_none() {
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
    let model = estimate.model.clone();
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
    let found = Partial {
        log: path.to_owned(),
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
    };
    Ok((found, model))
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
    format!("fitted to {segments} segments of {segment_s:.0} s; residual {}", residuals.join(", "))
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
