//! What identification finds in a log of a vehicle whose full dynamics it does not hold: coefficients with intervals, and
//! predictions beside a vehicle that goes on as it does.

use backseat_analysis::provenance;
use backseat_identify::validation::COLUMNS;
use backseat_report::{Provenance, Report, Table};
use serde_json::{Map, Value, json};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A coefficient.
pub struct Coefficient {
    pub name: String,
    pub unit: &'static str,
    pub value: f64,
    pub ci95: [f64; 2],
}

/// A quantity at a horizon.
pub struct Quantity {
    pub name: &'static str,
    pub unit: &'static str,
    /// Keys in JSON of the model's error, and of a vehicle that goes on.
    pub keys: [&'static str; 2],
    /// Digits behind the point.
    pub digits: usize,
    /// Root mean square errors: the model's, and of a vehicle that goes on.
    pub errors: [f64; 2],
}

/// Predictions at one horizon.
pub struct Horizon {
    pub horizon_s: f64,
    pub count: usize,
    pub quantities: Vec<Quantity>,
}

/// What was found.
pub struct Partial {
    pub log: PathBuf,
    pub method: &'static str,
    /// What it is of the vehicle: "surge and yaw in servo counts".
    pub what: &'static str,
    /// What was fitted, and how well, one line.
    pub fitted: String,
    pub coefficients: Vec<Coefficient>,
    pub horizons: Vec<Horizon>,
    pub judged_on: &'static str,
    /// How a vehicle goes on that the model is compared with.
    pub goes_on: &'static str,
    /// What follows for the reader, one line each.
    pub remarks: Vec<String>,
    pub notes: Vec<String>,
    /// Further members of the JSON object.
    pub json: Map<String, Value>,
    /// Validation over ten seconds under the names of the full identification.
    pub validation: Vec<(&'static str, f64)>,
}

impl Partial {
    pub fn json(&self, [vehicle, page]: [Option<&Path>; 2]) -> String {
        let parameters: Map<String, Value> = self
            .coefficients
            .iter()
            .map(|c| (c.name.clone(), json!({"value": c.value, "ci95": c.ci95, "unit": c.unit})))
            .collect();
        let of = |name: &str| self.validation.iter().find(|(known, _)| *known == name).map(|(_, value)| *value);
        let validation: Map<String, Value> = COLUMNS.iter().map(|name| ((*name).to_owned(), json!(of(name)))).collect();
        let predictions: Vec<Value> = self
            .horizons
            .iter()
            .map(|horizon| {
                let mut object = json!({"horizon_s": horizon.horizon_s, "count": horizon.count});
                for quantity in &horizon.quantities {
                    for (key, error) in quantity.keys.iter().zip(quantity.errors) {
                        object[*key] = json!(error);
                    }
                }
                object
            })
            .collect();
        let path = |path: Option<&Path>| path.map(|path| path.display().to_string());
        let mut object = json!({
            "method": self.method,
            "parameters": parameters,
            "validation": validation,
            "validated_on": self.judged_on,
            "predictions": predictions,
            "notes": self.notes,
            "vehicle_file": path(vehicle),
            "report": path(page),
        });
        self.json.iter().for_each(|(key, value)| object[key] = value.clone());
        format!("{object}\n")
    }

    pub fn text(&self, [vehicle, page]: [Option<&Path>; 2]) -> String {
        let mut out = String::new();
        let _ = writeln!(out, "{}: {}", self.log.display(), self.what);
        for note in &self.notes {
            let _ = writeln!(out, "note: {note}");
        }
        let _ = writeln!(out, "\n{}", self.fitted);
        for Coefficient { name, unit, value, ci95: [low, high] } in &self.coefficients {
            let _ = writeln!(out, "{name:<24} {value:>12.3e}   95 % {low:.3e} to {high:.3e} {unit}");
        }
        for remark in &self.remarks {
            let _ = writeln!(out, "\n{remark}");
        }
        let _ =
            writeln!(out, "\npredicted on {}, root mean square error (in brackets: {})", self.judged_on, self.goes_on);
        if self.horizons.is_empty() {
            let _ = writeln!(out, "nothing to predict: too little was measured there");
        }
        for horizon in &self.horizons {
            let _ = write!(out, "{:>4.0} s", horizon.horizon_s);
            for Quantity { name, unit, digits, errors: [model, stays], .. } in &horizon.quantities {
                let _ = write!(out, "   {name} {model:.digits$} {unit} ({stays:.digits$})");
            }
            let _ = writeln!(out, "   {} times", horizon.count);
        }
        for (name, path) in [("vehicle file", vehicle), ("report", page)] {
            if let Some(path) = path {
                let _ = writeln!(out, "{name:<13} {}", path.display());
            }
        }
        out
    }

    pub fn html(&self) -> String {
        let ten = self.horizons.iter().find(|horizon| horizon.horizon_s == 10.0).or(self.horizons.first());
        let verdict = ten.map_or_else(
            || "Nothing to predict.".to_owned(),
            |horizon| {
                let of = |q: &Quantity| {
                    let ([model, stays], digits) = (q.errors, q.digits);
                    format!("{} to {model:.digits$} {} ({stays:.digits$})", q.name, q.unit)
                };
                let all: Vec<String> = horizon.quantities.iter().map(of).collect();
                format!(
                    "Over {:.0} seconds it predicts {}, on {}; in brackets: {}.",
                    horizon.horizon_s,
                    all.join(", "),
                    self.judged_on,
                    self.goes_on
                )
            },
        );
        let name = self.log.file_name().map_or_else(|| "log".into(), |name| name.to_string_lossy());
        let mut report = Report::new(format!("{} from {name}", self.what), verdict).text(&self.fitted);
        for note in &self.notes {
            report = report.text(note);
        }
        let mut table = Table::new("Coefficients", &["", "unit", "value", "95 % from", "to"]);
        for c in &self.coefficients {
            let [low, high] = c.ci95.map(|end| format!("{end:.3e}"));
            table = table.row([c.name.clone(), c.unit.to_owned(), format!("{:.3e}", c.value), low, high]);
        }
        report = report.table(table);
        if let Some(first) = self.horizons.first() {
            let mut header = vec!["horizon [s]".to_owned()];
            for quantity in &first.quantities {
                header.push(format!("{} [{}]", quantity.name, quantity.unit));
                header.push(format!("if it goes on [{}]", quantity.unit));
            }
            header.push("predictions".to_owned());
            let header: Vec<&str> = header.iter().map(String::as_str).collect();
            let mut table = Table::new(format!("Root mean square errors on {}", self.judged_on), &header);
            for horizon in &self.horizons {
                let mut cells = vec![format!("{:.0}", horizon.horizon_s)];
                for Quantity { digits, errors, .. } in &horizon.quantities {
                    cells.extend(errors.iter().map(|error| format!("{error:.digits$}")));
                }
                cells.push(horizon.count.to_string());
                table = table.row(cells);
            }
            report = report.table(table);
        }
        for remark in &self.remarks {
            report = report.text(remark);
        }
        let command = provenance::command();
        report.provenance(Provenance { command: &command, seed: None, version: env!("CARGO_PKG_VERSION") }).html()
    }
}
