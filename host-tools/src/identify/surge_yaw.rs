//! Surge and yaw of a log that has servo counts in place of propeller speed and fin angles.

use super::Args;
use crate::log_input::ReadLog;
use crate::outcome::Outcome;
use crate::provenance;
use anyhow::bail;
use backseat_data::console;
use backseat_data::output::{self, Existing};
use backseat_data::report::{Provenance, Report, Table};
use backseat_data::{Column, Log, VehicleFile};
use backseat_identify::surge_yaw::{NAMES, Prediction, SurgeYawData, SurgeYawEstimate, UNITS};
use backseat_identify::validation::COLUMNS;
use serde_json::{Map, Value, json};
use std::fmt::Write as _;
use std::path::Path;

/// Share that is fitted; the rest is predicted.
const FITTED: f64 = 0.6;
/// Horizons of the predictions, s.
const HORIZONS_S: [f64; 3] = [5.0, 10.0, 30.0];

/// Whether a log has counts, and no actuators in SI.
pub fn is_for(log: &Log) -> bool {
    SurgeYawData::is_in(log) && !log.has(Column::PropRpm)
}

struct Found<'a> {
    log: &'a Path,
    estimate: SurgeYawEstimate,
    predictions: Vec<Prediction>,
    counts: [f64; 2],
    vehicle: String,
    judged_on: &'static str,
    notes: Vec<String>,
}

pub fn run(args: &Args, read: &ReadLog, page: Option<&Path>, existing: Existing) -> anyhow::Result<Outcome> {
    let Some(path) = args.log.as_deref() else { bail!("no log") };
    if args.out.is_some() {
        bail!(
            "{}: --out is not possible: surge and yaw in servo counts do not determine a vehicle file",
            path.display()
        );
    }
    let declared = match &args.vehicle {
        Some(path) => VehicleFile::read(path)?,
        None => VehicleFile::reference(),
    };
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
    let found = Found { log: path, estimate, predictions, counts, vehicle: declared.name.clone(), judged_on, notes };
    if let Some(page) = page {
        if let Some(folder) = page.parent() {
            std::fs::create_dir_all(folder)?;
        }
        let html = found.html();
        output::write(page, existing, |file| file.write_all(html.as_bytes()))?;
    }
    let text = if args.json { found.json(page) } else { found.text(page) };
    console::print(text.as_bytes())?;
    Ok(Outcome::doubtful_if(read.examination.is_suspicious()))
}

impl Found<'_> {
    fn json(&self, page: Option<&Path>) -> String {
        let parameters: Map<String, Value> = (0..NAMES.len())
            .map(|j| {
                let value =
                    json!({"value": self.estimate.coefficients[j], "ci95": self.estimate.ci95[j], "unit": UNITS[j]});
                (NAMES[j].to_owned(), value)
            })
            .collect();
        // The contract's columns: speed and yaw rate over ten seconds, the others were not measured.
        let ten = self.predictions.iter().find(|p| p.horizon_s == 10.0);
        let validation: Map<String, Value> = COLUMNS
            .iter()
            .map(|name| {
                let value = match (*name, ten) {
                    ("u_mps", Some(p)) => json!(p.surge_mps[0]),
                    ("r_degps", Some(p)) => json!(p.heading_rad[0].to_degrees() / p.horizon_s),
                    _ => Value::Null,
                };
                ((*name).to_owned(), value)
            })
            .collect();
        let predictions: Vec<Value> = self
            .predictions
            .iter()
            .map(|p| {
                json!({"horizon_s": p.horizon_s, "count": p.count,
                    "surge_rms_mps": p.surge_mps[0], "surge_if_it_stays_mps": p.surge_mps[1],
                    "heading_rms_deg": p.heading_rad[0].to_degrees(),
                    "heading_if_the_rate_stays_deg": p.heading_rad[1].to_degrees()})
            })
            .collect();
        let object = json!({
            "method": "surge-yaw",
            "parameters": parameters,
            "validation": validation,
            "validated_on": self.judged_on,
            "predictions": predictions,
            "count_is": {"propeller_radps": self.counts[0], "rudder_rad": self.counts[1], "if_the_vehicle_were": self.vehicle},
            "notes": self.notes,
            "vehicle_file": Value::Null,
            "report": page.map(|path| path.display().to_string()),
        });
        format!("{object}\n")
    }

    fn text(&self, page: Option<&Path>) -> String {
        let mut out = String::new();
        let _ = writeln!(out, "{}: surge and yaw in servo counts", self.log.display());
        for note in &self.notes {
            let _ = writeln!(out, "note: {note}");
        }
        let _ = writeln!(
            out,
            "\nfitted to {} samples in segments of 20 s; residual {:.3} m/s, {:.1} deg",
            self.estimate.samples,
            self.estimate.residual[0],
            self.estimate.residual[1].to_degrees()
        );
        for j in 0..NAMES.len() {
            let [low, high] = self.estimate.ci95[j];
            let _ = writeln!(
                out,
                "{:<24} {:>12.3e}   95 % {low:.3e} to {high:.3e} {}",
                NAMES[j], self.estimate.coefficients[j], UNITS[j]
            );
        }
        let _ = writeln!(
            out,
            "\nif it were {}: a count is {:.2} rad/s of the propeller, {:.3} deg of the rudder",
            self.vehicle,
            self.counts[0],
            self.counts[1].to_degrees()
        );
        let _ = writeln!(
            out,
            "\npredicted on {}, root mean square error (in brackets: speed, yaw rate stay)",
            self.judged_on
        );
        if self.predictions.is_empty() {
            let _ = writeln!(out, "nothing to predict: no measured speed there");
        }
        for p in &self.predictions {
            let _ = writeln!(
                out,
                "{:>4.0} s   speed {:.3} m/s ({:.3})   heading {:.1} deg ({:.1})   {} times",
                p.horizon_s,
                p.surge_mps[0],
                p.surge_mps[1],
                p.heading_rad[0].to_degrees(),
                p.heading_rad[1].to_degrees(),
                p.count
            );
        }
        if let Some(page) = page {
            let _ = writeln!(out, "report        {}", page.display());
        }
        out
    }

    fn html(&self) -> String {
        let verdict = self.predictions.iter().find(|p| p.horizon_s == 10.0).map_or_else(
            || "Nothing to predict.".to_owned(),
            |p| {
                format!(
                    "Over ten seconds speed is predicted to {:.3} m/s ({:.3} if it just stays), heading to {:.1}° ({:.1}° if \
                     the yaw rate stays), on {}.",
                    p.surge_mps[0],
                    p.surge_mps[1],
                    p.heading_rad[0].to_degrees(),
                    p.heading_rad[1].to_degrees(),
                    self.judged_on
                )
            },
        );
        let name = self.log.file_name().map_or_else(|| "log".into(), |name| name.to_string_lossy());
        let mut report = Report::new(format!("Surge and yaw from {name}"), verdict);
        for note in &self.notes {
            report = report.text(note);
        }
        let mut table = Table::new("Coefficients", &["", "unit", "value", "95 % from", "to"]);
        for j in 0..NAMES.len() {
            let [low, high] = self.estimate.ci95[j].map(|end| format!("{end:.3e}"));
            let value = format!("{:.3e}", self.estimate.coefficients[j]);
            table = table.row([NAMES[j].to_owned(), UNITS[j].to_owned(), value, low, high]);
        }
        report = report.table(table);
        let header = [
            "horizon [s]",
            "speed [m/s]",
            "if it stays [m/s]",
            "heading [deg]",
            "if the rate stays [deg]",
            "predictions",
        ];
        let mut table = Table::new(format!("Root mean square errors on {}", self.judged_on), &header);
        for p in &self.predictions {
            let cells = [
                format!("{:.0}", p.horizon_s),
                format!("{:.3}", p.surge_mps[0]),
                format!("{:.3}", p.surge_mps[1]),
                format!("{:.1}", p.heading_rad[0].to_degrees()),
                format!("{:.1}", p.heading_rad[1].to_degrees()),
                p.count.to_string(),
            ];
            table = table.row(cells);
        }
        report = report.table(table).text(&format!(
            "If it were {}, a count would be {:.2} rad/s of the propeller and {:.3}° of the rudder.",
            self.vehicle,
            self.counts[0],
            self.counts[1].to_degrees()
        ));
        let command = provenance::command();
        report.provenance(Provenance { command: &command, seed: None, version: env!("CARGO_PKG_VERSION") }).html()
    }
}
