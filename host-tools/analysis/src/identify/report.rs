//! What an identification gave, as a report.

use super::IdentificationResult;
use crate::provenance;
use crate::read_log::file_name;
use backseat_core::dynamics::{VehicleModel, VehicleParameters};
use backseat_core::identification::Visibility;
use backseat_identify::validation::COLUMNS;
use backseat_identify::{Sample, Validation, simulation};
use backseat_report::plots::{self, Bar, BarPlot, BeforeAfter, Point, Scale, TimePlot};
use backseat_report::{Report, Table};
use serde_json::{Map, Value, json};

/// Time drawn, s: long enough to see drift, short enough to see the motion.
const SHOWN_S: usize = 300;
/// Outputs drawn: where they stand, label, factor.
const SHOWN: [(usize, &str, f64); 5] = [
    (2, "surge u [m/s]", 1.0),
    (3, "sway v [m/s]", 1.0),
    (0, "roll [deg]", 180.0 / std::f64::consts::PI),
    (1, "pitch [deg]", 180.0 / std::f64::consts::PI),
    (7, "yaw rate r [deg/s]", 180.0 / std::f64::consts::PI),
];

/// The report, but for the files that are written.
pub fn report(result: &IdentificationResult) -> Report {
    let estimate = &result.estimate;
    let verdict = match (result.before, result.after) {
        _ if !result.is_changed => {
            "No step predicts the held-out data better than the declared vehicle, which is unchanged; \
                                   no vehicle file is written."
                .to_owned()
        }
        _ if result.is_useless => format!(
            "The identified vehicle predicts worse, on {}, than saying that nothing changes; no vehicle file is written.",
            result.held_out.text()
        ),
        (Some(before), Some(after)) => format!(
            "Open loop the identified vehicle predicts surge to {:.4} m/s (the declared one {:.4}), pitch to {:.3}° ({:.3}), \
             on {}.",
            after.mean_absolute[5],
            before.mean_absolute[5],
            after.mean_absolute[1],
            before.mean_absolute[1],
            result.held_out.text()
        ),
        _ => "Nothing to judge the estimate by.".to_owned(),
    };
    let mut report =
        Report::new(format!("Identification from {}", file_name(&result.log)), verdict).warnings(&result.doubts);
    if !result.is_changed || result.is_useless {
        report = report.alarm("Nothing identified");
    }
    report = report.fact("log", format!("{}, {}", result.log.display(), result.format));
    report = report.fact("method", estimate.method.name()).notes(&estimate.notes);
    report = parameters(validation(report, result), result);
    if !estimate.steps.is_empty() {
        let header = ["step", "held-out error before", "after", "standard error", "taken"];
        let mut table = Table::new(
            "Squared error on held-out data in units of what the better model leaves; 1 is noise alone",
            &header,
        );
        for step in &estimate.steps {
            let [before, after] = step.held_out.map(|value| format!("{value:.4}"));
            let taken = if step.accepted { "yes" } else { "no" };
            table =
                table.row([step.what.clone(), before, after, format!("{:.4}", step.standard_error), taken.to_owned()]);
        }
        report = report.table(table);
    }
    report = motion(report, result);
    if !estimate.unseen.is_empty() {
        let mut table = Table::new("Not seen in this log, and what would show it", &["parameter", "manoeuvre"]);
        for unseen in &estimate.unseen {
            table = table.row([unseen.name, unseen.manoeuvre]);
        }
        report = report.table(table);
    }
    report = report.on_terminal().fact("time", format!("{:.1} s", result.wall_s)).everywhere();
    provenance::of(values(report, result), None)
}

/// Adds the values of the JSON object.
fn values(report: Report, result: &IdentificationResult) -> Report {
    let mut parameters = Map::new();
    for parameter in &result.estimate.parameters {
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
    let unseen = result.estimate.unseen.iter();
    let unseen = unseen.map(|unseen| json!({"parameter": unseen.name, "manoeuvre": unseen.manoeuvre}));
    let steps = result.estimate.steps.iter().map(|step| {
        json!({"what": step.what, "held_out_before": step.held_out[0], "held_out_after": step.held_out[1],
            "standard_error": step.standard_error, "accepted": step.accepted})
    });
    let timing = result.timing.as_ref().map(|timing| {
        let actuators = timing.actuators.iter().map(|a| {
            (a.name.to_owned(), json!({"hold": a.hold.kind.name(), "delay_s": a.hold.delay_s, "ci95": a.ci95}))
        });
        let outputs = timing.whiteness.iter().map(|output| {
            (output.name.to_owned(), json!({"p": output.p, "max_autocorrelation": output.max_autocorrelation}))
        });
        json!({"actuators": actuators.collect::<Map<_, _>>(), "gain": timing.gain,
            "whiteness": outputs.collect::<Map<_, _>>()})
    });
    report
        .value("method", result.estimate.method.name())
        .value("changed", result.is_changed)
        .value(
            "trust",
            if result.is_changed && !result.is_useless && result.doubts.is_empty() { "ok" } else { "suspicious" },
        )
        .value("doubts", result.doubts.clone())
        .value("parameters", parameters)
        .value("validation", columns(&result.after))
        .value("validation_before", columns(&result.before))
        .value("validated_on", result.held_out.text())
        .value("collinear", json!(result.estimate.collinear))
        .value("not_seen", unseen.collect::<Vec<_>>())
        .value("steps", steps.collect::<Vec<_>>())
        .value("input_timing", timing)
        .value("notes", result.estimate.notes.clone())
        .value("wall_s", result.wall_s)
}

/// Wide enough for any vehicle, narrow enough for a terminal.
fn four_digits(value: f64) -> String {
    let decimals = if value == 0.0 { 0.0 } else { 3.0 - value.abs().log10().floor() };
    format!("{value:.*}", decimals.clamp(0.0, 8.0) as usize)
}

/// One word for what the motion shows of a parameter.
const fn seen(visibility: Visibility) -> &'static str {
    match visibility {
        Visibility::Known => "known",
        Visibility::Frozen => "not seen",
        Visibility::Collinear => "collinear",
        Visibility::Separate => "seen",
    }
}

fn validation(report: Report, result: &IdentificationResult) -> Report {
    let (Some(before), Some(after)) = (result.before, result.after) else { return report };
    let header = ["", "declared", "identified"];
    let caption = format!(
        "Mean absolute error of {:.0} s predicted open loop on {}; sensor noise included",
        after.duration_s,
        result.held_out.text()
    );
    let mut table = Table::new(caption, &header);
    let rows: Vec<(&str, f64, f64)> =
        COLUMNS.iter().zip(before.mean_absolute).zip(after.mean_absolute).map(|((n, b), a)| (*n, b, a)).collect();
    for (name, before, after) in &rows {
        table = table.row([(*name).to_owned(), format!("{before:.5}"), format!("{after:.5}")]);
    }
    let figure = plots::before_after(&BeforeAfter {
        x_label: "mean absolute error [deg, deg/s, m/s]",
        rows: &rows,
        scale: Scale::Log,
    });
    report.table(table).figure("Open-loop prediction with the declared and with the identified vehicle.", figure)
}

fn parameters(report: Report, result: &IdentificationResult) -> Report {
    let header = ["", "unit", "declared", "identified", "95 % from", "to", "motion"];
    let mut table = Table::new("Parameters, and what the motion shows of them", &header);
    for p in &result.estimate.parameters {
        let [low, high] = p.ci95.map_or([String::new(), String::new()], |ends| ends.map(four_digits));
        let cells = [p.name.to_owned(), p.unit.to_owned(), four_digits(p.prior), four_digits(p.value)];
        table = table.row(cells.into_iter().chain([low, high, seen(p.visibility).to_owned()]));
    }
    let ratio = |value: f64, prior: f64| value / prior;
    let bars: Vec<Bar<'_>> = result
        .estimate
        .parameters
        .iter()
        .filter(|p| p.prior.abs() > 1.0e-9)
        .map(|p| Bar {
            name: p.name,
            value: ratio(p.value, p.prior),
            interval: p.ci95.map(|[low, high]| {
                let (a, b) = (ratio(low, p.prior), ratio(high, p.prior));
                (a.min(b), a.max(b))
            }),
        })
        .collect();
    let plot = BarPlot { x_label: "identified / declared, 95 %", bars: &bars, reference: Some(("declared", 1.0)) };
    report.table(table).figure("Every parameter as a multiple of what was declared.", plots::bars(&plot))
}

/// The first minutes of what was held out, measured and predicted.
fn motion(mut report: Report, result: &IdentificationResult) -> Report {
    let Some(samples) = result.judge.stretches().next() else { return report };
    let samples = &samples[..samples.len().min(SHOWN_S * 10)];
    let (Some(before), Some(after)) =
        (run(&result.declared.parameters, samples), run(&result.estimate.vehicle, samples))
    else {
        return report;
    };
    let time_h = |k: usize| k as f64 * 0.1 / 3600.0;
    for (output, label, factor) in SHOWN {
        let measured: Vec<Point> =
            samples.iter().enumerate().map(|(k, s)| (time_h(k), factor * simulation::measured(s)[output])).collect();
        let line = |run: &[[f64; 8]]| -> Vec<Point> {
            run.iter().enumerate().map(|(k, x)| (time_h(k), factor * x[output])).collect()
        };
        let (before, after) = (line(&before), line(&after));
        let series = [("measured", &measured[..]), ("declared", &before[..]), ("identified", &after[..])];
        let figure = plots::time_series(&TimePlot { y_label: label, series: &series, band: None });
        report =
            report.figure(&format!("{label}: open loop from the first sample of {}.", result.held_out.text()), figure);
    }
    report
}

fn run(vehicle: &VehicleParameters, samples: &[Sample]) -> Option<Vec<[f64; 8]>> {
    let model = VehicleModel::new(vehicle).ok()?;
    let states = simulation::free_run(&model, &simulation::start(samples.first()?), samples);
    Some(states.iter().step_by(2).map(|x| simulation::output(x).data.0[0]).collect())
}
