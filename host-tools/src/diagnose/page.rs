//! The diagnosis as an HTML page: effects, before and after, the residual, all hypotheses.

use super::DiagnosisReport;
use super::sentence::{next, sentence};
use super::text::{headline, number, rows};
use backseat_analysis::provenance;
use backseat_diagnose::figures;
use backseat_diagnose::samples::ResidualChannel;
use backseat_diagnose::scores::{HORIZONS_S, PREDICTED};
use backseat_diagnose::verdict::Verdict;
use backseat_report::plots::{self, Bar, BarPlot, ErrorPlot, Point, Scale, TimePlot, TrackPlot, XyPlot};
use backseat_report::{Provenance, Report, Table};

/// Hypotheses shown of each round.
const SHOWN: usize = 10;
/// Time over which residuals are averaged to be drawn, s.
const BIN_S: f64 = 20.0;
/// Time without fixes across which no line is drawn, µs.
const FIX_GAP_US: u64 = 30_000_000;

/// The page, one file.
pub fn html(outcome: &DiagnosisReport<'_>) -> String {
    let title = outcome.log.path.file_name().map_or_else(|| "log".into(), |name| name.to_string_lossy());
    let mut report = Report::new(format!("Diagnosis of {title}"), sentence(outcome)).warnings(&outcome.doubts);
    report = before_after(map(report, outcome), outcome);
    report = residual(report, outcome);
    report = effects(report.section("What was found").text(&headline(outcome)), outcome);
    report = ladder(report, outcome);
    report = details(report, outcome);
    if !outcome.notes.is_empty() {
        report = report.section("Notes");
        for note in &outcome.notes {
            report = report.text(note);
        }
    }
    let (next, why) = next(outcome);
    report = report.section("Next").text(&format!("{}:", capital(&why))).command(&next);
    let command = provenance::command();
    report.provenance(Provenance { command: &command, seed: None, version: env!("CARGO_PKG_VERSION") }).html()
}

/// The flight filter's track before and after, and the fixes.
fn map(report: Report, outcome: &DiagnosisReport<'_>) -> Report {
    let (before, after) = (&outcome.before.track, &outcome.after.track);
    if before.is_empty() {
        return report;
    }
    let fixes = fixes(outcome);
    let mut lines: Vec<plots::Series<'_>> = vec![("before", before)];
    if !outcome.diagnosis.effects.is_empty() {
        lines.push(("after", after));
    }
    lines.push(("GNSS fixes", &fixes));
    let svg = plots::track(&TrackPlot { estimates: &lines, ..TrackPlot::default() });
    let withheld = if outcome.before.position_against == Some("truth") { "" } else { ", its later fixes withheld" };
    report.figure(&format!("Track of the flight filter with the declared vehicle and with the effect{withheld}."), svg)
}

/// North and east; the line breaks where fixes are missing.
fn fixes(outcome: &DiagnosisReport<'_>) -> Vec<Point> {
    let (mut points, mut previous_us): (Vec<Point>, Option<u64>) = (Vec::new(), None);
    for row in &outcome.log.rows {
        let Some([north_m, east_m]) = row.gnss_m() else { continue };
        if previous_us.is_some_and(|previous_us| row.time_us - previous_us > FIX_GAP_US) {
            points.push((f64::NAN, f64::NAN));
        }
        points.push((north_m, east_m));
        previous_us = Some(row.time_us);
    }
    points
}

/// With a capital first letter.
fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Effects found: a table, and a sentence each.
fn effects(mut report: Report, outcome: &DiagnosisReport<'_>) -> Report {
    let d = &outcome.diagnosis;
    if !d.effects.is_empty() {
        let header = ["effect", "parameter", "value (95 % interval)", "p"];
        let mut table = Table::new("Effects found", &header);
        for found in &d.effects {
            for (i, value) in found.values.iter().enumerate() {
                let name = if i == 0 { found.instance.candidate.effect } else { "" };
                let p = if i > 0 {
                    String::new()
                } else if found.p_value < 1e-12 {
                    "< 1e-12".to_owned()
                } else {
                    format!("{:.0e}", found.p_value)
                };
                table = table.row([name.to_owned(), value.name.to_owned(), number(value), p]);
            }
        }
        report = report.table(table);
    }
    for found in &d.effects {
        let info = found.instance.candidate.info();
        report = report.text(&format!("{}: {}. {}.", info.name, info.equations, info.signature));
        for alternative in found.possible_alternatives() {
            let manoeuvre = alternative.separating_manoeuvre.map_or_else(
                || "no manoeuvre is known that separates them".to_owned(),
                |manoeuvre| format!("to separate them: {manoeuvre}"),
            );
            report = report.text(&format!(
                "It could also be {} (values {:.4?}; χ² larger by {:.1}); {manoeuvre}.",
                alternative.instance.candidate.label(),
                alternative.instance.sizes,
                alternative.deficit
            ));
        }
    }
    if !d.structure.hints.is_empty() {
        let header = ["the residual depends on", "χ² gain", "held-out gain", "p"];
        let mut table = Table::new("Structure outside the catalogue, the strongest term first", &header);
        for hint in &d.structure.hints {
            let cells = [format!("{:.0}", hint.gain), format!("{:.0}", hint.held_gain), format!("{:.0e}", hint.p)];
            table = table.row([hint.generic.name()].into_iter().chain(cells));
        }
        report = report.table(table);
    }
    if !d.structure.named.is_empty() {
        let header = ["the residual depends on", "factors", "χ² gain", "held-out gain", "p"];
        let mut table = Table::new("Structure outside the catalogue", &header);
        for term in &d.structure.named {
            let factors: Vec<String> = term.values.iter().map(|value| format!("{value:.3}")).collect();
            let numbers = [format!("{:.0}", term.gain), format!("{:.0}", term.held_gain), format!("{:.0e}", term.p)];
            table = table.row([term.name.to_owned(), factors.join(", ")].into_iter().chain(numbers));
        }
        report = report.table(table);
    }
    report
}

fn before_after(mut report: Report, outcome: &DiagnosisReport<'_>) -> Report {
    let mut table = Table::new(
        "Before and after on held-out data: a third of the log in blocks, and its last fifth",
        &["", "before", "after"],
    );
    for (name, before, after) in rows(outcome) {
        table = table.row([name, before, after]);
    }
    report = report.table(table);
    let (before, after) = (broken(&outcome.before.position_errors), broken(&outcome.after.position_errors));
    if let Some(against) = outcome.before.position_against {
        let mut series: Vec<plots::Series<'_>> = vec![("before", &before)];
        if !outcome.diagnosis.effects.is_empty() {
            series.push(("after", &after));
        }
        let svg = plots::error_vs_time(&ErrorPlot {
            y_label: "horizontal error [m]",
            series: &series,
            bound: None,
            scale: Scale::Linear,
        });
        let whose = if super::text::is_predicted(outcome) { "the flight filter" } else { "the model" };
        report = report.figure(&format!("Error of {whose} against {against}."), svg);
    }
    report
}

/// Points in hours; the line breaks where a minute has none.
fn broken(errors: &[(f64, f64)]) -> Vec<Point> {
    let mut points: Vec<Point> = Vec::with_capacity(errors.len());
    for (t_s, error) in errors {
        if points.last().is_some_and(|last| t_s / 3600.0 - last.0 > 60.0 / 3600.0) {
            points.push((t_s / 3600.0, f64::NAN));
        }
        points.push((t_s / 3600.0, *error));
    }
    points
}

/// The residual that the effects change most: in time, against the variable that explains most of it, and its spectrum.
fn residual(report: Report, outcome: &DiagnosisReport<'_>) -> Report {
    let d = &outcome.diagnosis;
    let has_effect = !d.effects.is_empty();
    let channel = figures::most_changed_channel(&d.before, &d.after);
    let label = format!("{} residual [{}]", channel.name(), channel.unit());
    let (before, after) = (figures::channel(&d.before, channel), figures::channel(&d.after, channel));
    let drawn = figures::smooth(before.iter().map(|r| (r.t_s, r.innovation)), BIN_S);
    let effect = figures::smooth(before.iter().zip(&after).map(|(b, a)| (b.t_s, b.innovation - a.innovation)), BIN_S);
    let rest = figures::smooth(after.iter().map(|r| (r.t_s, r.innovation)), BIN_S);
    // the colours of before and after are those of the map
    let mut series: Vec<plots::Series<'_>> = vec![("before", &drawn)];
    if has_effect {
        series.extend([("after", &rest[..]), ("explained by the effect", &effect[..])]);
    }
    let over = plots::time_series(&TimePlot { y_label: &label, series: &series, band: None });
    let mut report = report.section("The residual").figure(
        &format!(
            "Innovations of {}, means of {BIN_S:.0} s{}.",
            channel.name(),
            if has_effect { ": before, after, and the part that the effect explains" } else { "" }
        ),
        over,
    );
    let (variable, [line_before, line_after]) = figures::best_variable(&d.before, &d.after, channel);
    let mut lines: Vec<plots::Series<'_>> = vec![("before", &line_before)];
    if has_effect {
        lines.push(("after", &line_after));
    }
    let svg = plots::xy(&XyPlot {
        x_label: variable,
        y_label: &label,
        series: &lines,
        reference: Some(("zero", 0.0)),
        ..XyPlot::default()
    });
    if !line_before.is_empty() {
        report = report.figure("The same residual against the variable that explains most of it, means in bins.", svg);
    }
    let (white_before, white_after) = (figures::spectrum(&d.before, channel), figures::spectrum(&d.after, channel));
    let mut lines: Vec<plots::Series<'_>> = vec![("before", &white_before)];
    if has_effect {
        lines.push(("after", &white_after));
    }
    let svg = plots::xy(&XyPlot {
        x_label: "frequency [Hz]",
        y_label: "power, 1 if white",
        series: &lines,
        reference: Some(("white", 1.0)),
        x_scale: Scale::Log,
        y_scale: Scale::Log,
    });
    report.figure("Spectrum of the normalised innovations; slow structure is at the left.", svg)
}

/// Every hypothesis with its evidence, round by round.
fn ladder(mut report: Report, outcome: &DiagnosisReport<'_>) -> Report {
    report = report.section("Hypotheses tested").text(
        "Each entry of the catalogue is fitted to the whitened residual. Its evidence is the square root of the χ² that it \
         removes, in sigmas. Beyond the line, chance alone gives such evidence in fewer than one log of five hundred, all \
         hypotheses counted.",
    );
    for (index, round) in outcome.diagnosis.rounds.iter().enumerate() {
        let shown: Vec<(String, f64)> = round
            .ladder
            .iter()
            .take(SHOWN)
            .map(|e| (e.instance.candidate.label(), (e.gain / e.inflation.max(1.0)).max(0.0).sqrt()))
            .collect();
        let mut sorted = shown;
        sorted.sort_by(|a, b| b.1.total_cmp(&a.1));
        let bars: Vec<Bar<'_>> =
            sorted.iter().map(|(name, value)| Bar { name, value: *value, interval: None }).collect();
        let svg =
            plots::bars(&BarPlot { x_label: "evidence [sigma]", bars: &bars, reference: Some(("significant", 4.7)) });
        let caption = match index {
            0 => "Round 1: beside the declared model.".to_owned(),
            _ => format!("Round {}: beside the effects accepted before.", index + 1),
        };
        report = report.figure(&caption, svg);
    }
    report
}

/// Prediction by horizon and whiteness by channel.
fn details(mut report: Report, outcome: &DiagnosisReport<'_>) -> Report {
    let has_effect = outcome.diagnosis.verdict != Verdict::None && !outcome.diagnosis.effects.is_empty();
    let mut header = vec!["".to_owned()];
    for horizon in HORIZONS_S {
        header.push(format!("{horizon:.0} s"));
        if has_effect {
            header.push("after".to_owned());
        }
    }
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let mut table = Table::new("Open-loop prediction on held-out data: root-mean-square error by horizon", &header);
    for (place, channel) in PREDICTED.iter().enumerate() {
        let (before, after) = (&outcome.before.prediction[place], &outcome.after.prediction[place]);
        if before.iter().all(Option::is_none) {
            continue;
        }
        let mut cells = vec![format!("{} [{}]", channel.name(), channel.unit())];
        for horizon in 0..HORIZONS_S.len() {
            let cell = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.4}"));
            cells.push(cell(before[horizon]));
            if has_effect {
                cells.push(cell(after[horizon]));
            }
        }
        table = table.row(cells);
    }
    report = report.section("In numbers");
    if super::text::is_predicted(outcome) {
        report = report.table(table);
    }
    let header = ["channel", "samples", "NIS before", "NIS after", "whiteness p before", "p after"];
    let mut table = Table::new(
        "Innovations on held-out data: mean normalised innovation squared (NIS, 1 if consistent), Ljung-Box test over 20 lags",
        &header,
    );
    for channel in ResidualChannel::ALL {
        let of = |scores: &backseat_diagnose::scores::Scores| {
            scores.whiteness.iter().find(|w| w.channel == channel).cloned()
        };
        let (Some(before), Some(after)) = (of(&outcome.before), of(&outcome.after)) else { continue };
        let p = super::text::probability;
        table = table.row([
            channel.name().to_owned(),
            before.count.to_string(),
            format!("{:.2}", before.nis),
            format!("{:.2}", after.nis),
            p(before.p),
            p(after.p),
        ]);
    }
    report.table(table)
}
