//! What an identification gave, as a page.

use super::result::{IdentificationResult, NOTHING, seen};
use backseat_analysis::provenance;
use backseat_core::dynamics::{VehicleModel, VehicleParameters};
use backseat_identify::Sample;
use backseat_identify::simulation;
use backseat_identify::validation::COLUMNS;
use backseat_report::plots::{self, Bar, BarPlot, BeforeAfter, Point, Scale, TimePlot};
use backseat_report::{Provenance, Report, Table};

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

/// The page, one file.
pub fn html(outcome: &IdentificationResult) -> String {
    let estimate = &outcome.estimate;
    let title = outcome.log.file_name().map_or_else(|| "log".into(), |name| name.to_string_lossy());
    let verdict = match (outcome.before, outcome.after) {
        _ if !outcome.is_changed => NOTHING.to_owned(),
        (Some(before), Some(after)) => format!(
            "Surge predicted open loop to {:.4} m/s instead of {:.4}, pitch to {:.3}° instead of {:.3}°, on {}.",
            after.mean_absolute[5],
            before.mean_absolute[5],
            after.mean_absolute[1],
            before.mean_absolute[1],
            outcome.held_out.text()
        ),
        _ => "Nothing to judge the estimate by.".to_owned(),
    };
    let mut report = Report::new(format!("Identification from {title}"), verdict).warnings(&outcome.doubts);
    if !outcome.is_changed {
        report = report.alarm("Nothing identified");
    }
    for note in &estimate.notes {
        report = report.text(note);
    }
    report = validation(report, outcome);
    report = parameters(report, outcome);
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
    report = motion(report, outcome);
    if !estimate.unseen.is_empty() {
        let mut table = Table::new("Not seen in this log, and what would show it", &["parameter", "manoeuvre"]);
        for unseen in &estimate.unseen {
            table = table.row([unseen.name, unseen.manoeuvre]);
        }
        report = report.table(table);
    }
    let command = provenance::command();
    report.provenance(Provenance { command: &command, seed: None, version: env!("CARGO_PKG_VERSION") }).html()
}

fn validation(report: Report, outcome: &IdentificationResult) -> Report {
    let (Some(before), Some(after)) = (outcome.before, outcome.after) else { return report };
    let header = ["", "declared", "identified"];
    let caption = format!(
        "Mean absolute error of {:.0} s predicted open loop on {}; sensor noise included",
        after.duration_s,
        outcome.held_out.text()
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

fn parameters(report: Report, outcome: &IdentificationResult) -> Report {
    let mut table =
        Table::new("Parameters", &["", "unit", "declared", "identified", "95 % from", "to", "what the motion shows"]);
    for p in &outcome.estimate.parameters {
        let [low, high] = p.ci95.map_or([String::new(), String::new()], |ends| ends.map(|end| format!("{end:.6}")));
        let cells = [p.name.to_owned(), p.unit.to_owned(), format!("{:.6}", p.prior), format!("{:.6}", p.value)];
        table = table.row(cells.into_iter().chain([low, high, seen(p.visibility).to_owned()]));
    }
    let ratio = |value: f64, prior: f64| value / prior;
    let bars: Vec<Bar<'_>> = outcome
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
fn motion(mut report: Report, outcome: &IdentificationResult) -> Report {
    let Some(samples) = outcome.judge.stretches().next() else { return report };
    let samples = &samples[..samples.len().min(SHOWN_S * 10)];
    let (Some(before), Some(after)) =
        (run(&outcome.declared.parameters, samples), run(&outcome.estimate.vehicle, samples))
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
            report.figure(&format!("{label}: open loop from the first sample of {}.", outcome.held_out.text()), figure);
    }
    report
}

fn run(vehicle: &VehicleParameters, samples: &[Sample]) -> Option<Vec<[f64; 8]>> {
    let model = VehicleModel::new(vehicle).ok()?;
    let states = simulation::free_run(&model, &simulation::start(samples.first()?), samples);
    Some(states.iter().step_by(2).map(|x| simulation::output(x).data.0[0]).collect())
}
