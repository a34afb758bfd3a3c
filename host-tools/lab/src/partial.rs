//! What identification finds in a log of a vehicle whose full dynamics it does not hold: coefficients with intervals, and
//! predictions beside a vehicle that goes on as it does.

use backseat_identify::validation::COLUMNS;
use backseat_report::{Report, Table};
use serde_json::{Map, Value, json};
use std::path::PathBuf;

/// A coefficient.
pub struct Coefficient {
    /// Name.
    pub name: String,
    /// Unit of its value.
    pub unit: &'static str,
    /// Fitted value.
    pub value: f64,
    /// 95 % interval, NaN where it has none.
    pub ci95: [f64; 2],
}

/// A quantity at a horizon.
pub struct Quantity {
    /// Name.
    pub name: &'static str,
    /// Unit of its errors.
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
    /// Time ahead, s.
    pub horizon_s: f64,
    /// Predictions made.
    pub count: usize,
    /// What was predicted.
    pub quantities: Vec<Quantity>,
}

/// What was found.
pub struct Partial {
    /// Where the log came from.
    pub log: PathBuf,
    /// Name of the method.
    pub method: &'static str,
    /// What it is of the vehicle: "surge and yaw in servo counts".
    pub what: &'static str,
    /// What it was fitted to, and how well, one line.
    pub fitted: String,
    /// What was fitted.
    pub coefficients: Vec<Coefficient>,
    /// Predictions of what was held out.
    pub horizons: Vec<Horizon>,
    /// What was held out.
    pub judged_on: &'static str,
    /// How a vehicle goes on that the model is compared with.
    pub goes_on: &'static str,
    /// What follows for the reader, one line each.
    pub remarks: Vec<String>,
    /// What was assumed and left out.
    pub notes: Vec<String>,
    /// Further members of the JSON object.
    pub json: Map<String, Value>,
    /// Validation over ten seconds under the names of the full identification.
    pub validation: Vec<(&'static str, f64)>,
    /// Why the result should not be trusted.
    pub doubts: Vec<String>,
}

impl Partial {
    /// The report, but for the files that are written.
    pub fn report(&self) -> Report {
        let ten = self.horizons.iter().find(|horizon| horizon.horizon_s == 10.0).or(self.horizons.first());
        let verdict = ten.map_or_else(
            || "Nothing to predict: too little was measured there.".to_owned(),
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
        let title = format!("Identification from {}", self.log.file_name().unwrap_or_default().to_string_lossy());
        let mut report = Report::new(title, verdict).warnings(&self.doubts).fact("log", self.log.display().to_string());
        report = report.fact("identified", self.what).fact("fitted to", self.fitted.clone()).notes(&self.notes);
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
        report = self.remarks.iter().fold(report, |report, remark| report.text(remark));
        self.values(report).values(Value::Object(self.json.clone()))
    }

    /// Adds the values of the JSON object.
    fn values(&self, report: Report) -> Report {
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
        report
            .value("method", self.method)
            .value("parameters", parameters)
            .value("validation", validation)
            .value("validated_on", self.judged_on)
            .value("predictions", predictions)
            .value("notes", self.notes.clone())
    }
}
