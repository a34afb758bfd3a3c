//! The result of an identification, as JSON and as text.

use backseat_core::identification::Visibility;
use backseat_identify::validation::COLUMNS;
use backseat_identify::{Estimate, IdentificationData, TimingEstimate, Validation};
use backseat_logs::VehicleFile;
use serde_json::{Map, Value, json};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// What the estimate is judged on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeldOut {
    /// The last fifth of the log.
    LastPart,
    /// Another log.
    Another,
}

/// The headline of an identification that accepted no step.
pub const NOTHING: &str = "Nothing identified: no step predicts the held-out data better than the declared vehicle, which \
                           is unchanged; no vehicle file is written.";

/// What the report shows.
pub struct IdentificationResult {
    /// Where the log came from.
    pub log: PathBuf,
    /// Name of its format.
    pub format: &'static str,
    /// Parameters with intervals, and the steps to them.
    pub estimate: Estimate,
    /// Open-loop prediction with the declared vehicle; `None` if nothing is held out.
    pub before: Option<Validation>,
    /// The same with the identified one.
    pub after: Option<Validation>,
    /// What it is judged on.
    pub held_out: HeldOut,
    /// The samples it is judged on.
    pub judge: IdentificationData,
    /// The vehicle before.
    pub declared: VehicleFile,
    /// The declared vehicle with the identified parameters.
    pub identified: VehicleFile,
    /// When the inputs act; `None` where the log does not show it.
    pub timing: Option<TimingEstimate>,
    /// Any parameter differs from the declared one.
    pub is_changed: bool,
    /// Why the result should not be trusted.
    pub doubts: Vec<String>,
    /// Time taken with reading, s.
    pub wall_s: f64,
}

impl HeldOut {
    pub const fn text(self) -> &'static str {
        match self {
            Self::LastPart => "the last fifth of the log, held out",
            Self::Another => "the other log",
        }
    }
}

/// One word for what the motion shows of a parameter.
pub const fn seen(visibility: Visibility) -> &'static str {
    match visibility {
        Visibility::Known => "known",
        Visibility::Frozen => "not seen",
        Visibility::Collinear => "collinear",
        Visibility::Separate => "seen",
    }
}

impl IdentificationResult {
    /// First lines of the vehicle file.
    pub fn source(&self) -> String {
        let name = self.log.file_name().map_or_else(|| "a log".into(), |name| name.to_string_lossy());
        format!(
            "Identified by `backseat identify --method {}` from {name}; prior: {}.\nParameters that the log does not show are as declared.",
            self.estimate.method, self.declared.name
        )
    }

    /// The JSON object of the command, with the paths of the vehicle file and the report that were written.
    pub fn json(&self, [vehicle_file, report]: [Option<&Path>; 2]) -> String {
        let mut parameters = Map::new();
        for parameter in &self.estimate.parameters {
            parameters.insert(
                parameter.name.to_owned(),
                json!({"value": parameter.value, "ci95": parameter.ci95, "prior": parameter.prior, "unit": parameter.unit,
                    "seen": seen(parameter.visibility)}),
            );
        }
        let columns = |validation: &Option<Validation>| {
            validation.map_or(Value::Null, |validation| {
                let pairs = COLUMNS.iter().zip(validation.mean_absolute);
                Value::Object(pairs.map(|(name, value)| ((*name).to_owned(), json!(value))).collect())
            })
        };
        let path = |path: Option<&Path>| path.map(|path| path.display().to_string());
        let unseen: Vec<Value> = self
            .estimate
            .unseen
            .iter()
            .map(|unseen| json!({"parameter": unseen.name, "manoeuvre": unseen.manoeuvre}))
            .collect();
        let steps: Vec<Value> = self
            .estimate
            .steps
            .iter()
            .map(|step| {
                json!({"what": step.what, "held_out_before": step.held_out[0], "held_out_after": step.held_out[1],
                    "standard_error": step.standard_error, "accepted": step.accepted})
            })
            .collect();
        let timing = self.timing.as_ref().map(|timing| {
            let actuators = timing.actuators.iter().map(|a| {
                (a.name.to_owned(), json!({"hold": a.hold.kind.name(), "delay_s": a.hold.delay_s, "ci95": a.ci95}))
            });
            let outputs = timing.whiteness.iter().map(|output| {
                (output.name.to_owned(), json!({"p": output.p, "max_autocorrelation": output.max_autocorrelation}))
            });
            json!({"actuators": actuators.collect::<Map<_, _>>(), "gain": timing.gain,
                "whiteness": outputs.collect::<Map<_, _>>()})
        });
        let object = json!({
            "method": self.estimate.method.name(),
            "changed": self.is_changed,
            "trust": if self.is_changed && self.doubts.is_empty() { "ok" } else { "suspicious" },
            "doubts": self.doubts,
            "parameters": parameters,
            "validation": columns(&self.after),
            "validation_before": columns(&self.before),
            "validated_on": self.held_out.text(),
            "collinear": self.estimate.collinear,
            "not_seen": unseen,
            "steps": steps,
            "input_timing": timing,
            "notes": self.estimate.notes,
            "vehicle_file": path(vehicle_file),
            "report": path(report),
            "wall_s": self.wall_s,
        });
        format!("{object}\n")
    }

    /// The text of the command.
    pub fn text(&self, [vehicle_file, report]: [Option<&Path>; 2]) -> String {
        let mut out = String::new();
        let _ = writeln!(out, "{} ({}), method {}", self.log.display(), self.format, self.estimate.method);
        for note in &self.estimate.notes {
            let _ = writeln!(out, "note: {note}");
        }
        for doubt in &self.doubts {
            let _ = writeln!(out, "DO NOT TRUST: {doubt}");
        }
        if !self.is_changed {
            let _ = writeln!(out, "\n{NOTHING}");
        }
        let _ = writeln!(out, "\n{:<6} {:>12} {:>12} {:>25}  seen        unit", "", "declared", "identified", "95 %");
        for p in &self.estimate.parameters {
            let interval = p.ci95.map_or_else(String::new, |[low, high]| format!("{low:.6} to {high:.6}"));
            let _ = writeln!(
                out,
                "{:<6} {:>12.6} {:>12.6} {interval:>25}  {:<10}  {}",
                p.name,
                p.prior,
                p.value,
                seen(p.visibility),
                p.unit
            );
        }
        for unseen in &self.estimate.unseen {
            let _ = writeln!(
                out,
                "{} cannot be seen in this log; a manoeuvre that shows it: {}",
                unseen.name, unseen.manoeuvre
            );
        }
        for step in &self.estimate.steps {
            let verdict = if step.accepted { "accepted" } else { "rejected" };
            let [before, after] = step.held_out;
            let _ = writeln!(out, "{:<30} held-out error {before:.4} to {after:.4}: {verdict}", step.what);
        }
        if let (Some(before), Some(after)) = (self.before, self.after) {
            let _ = writeln!(
                out,
                "\nmean absolute error of {:.0} s predicted open loop on {} (sensor noise included)",
                after.duration_s,
                self.held_out.text()
            );
            let _ = writeln!(out, "{:<12} {:>10} {:>10}", "", "declared", "identified");
            for ((name, before), after) in COLUMNS.iter().zip(before.mean_absolute).zip(after.mean_absolute) {
                let _ = writeln!(out, "{name:<12} {before:>10.5} {after:>10.5}");
            }
        }
        for (what, path) in [("vehicle file", vehicle_file), ("report", report)] {
            if let Some(path) = path {
                let _ = writeln!(out, "{what:<13} {}", path.display());
            }
        }
        let _ = writeln!(out, "time          {:.1} s", self.wall_s);
        out
    }
}
