//! What only the page shows of a diagnosis: the map, the residual, all hypotheses.

use super::DiagnosisResult;
use super::format::{optional, probability};
use backseat_diagnose::figures;
use backseat_diagnose::samples::ResidualChannel;
use backseat_diagnose::scores::{HORIZONS_S, PREDICTED};
use backseat_diagnose::verdict::Verdict;
use backseat_report::plots::{self, Bar, BarPlot, ErrorPlot, Point, Scale, TimePlot, TrackPlot, XyPlot};
use backseat_report::{Report, Table};

/// Hypotheses shown of each round.
const SHOWN: usize = 10;
/// Time over which residuals are averaged to be drawn, s.
const BIN_S: f64 = 20.0;
/// Time without fixes across which no line is drawn, µs.
const FIX_GAP_US: u64 = 30_000_000;

/// What the page shows beyond the text: errors, the residual, all hypotheses, the scores channel by channel.
pub fn evidence(report: Report, result: &DiagnosisResult<'_>) -> Report {
    details(ladder(residual(errors(report, result), result), result), result)
}

/// The track before and after, and the fixes.
pub fn map(report: Report, result: &DiagnosisResult<'_>) -> Report {
    let (before, after) = (&result.before.track, &result.after.track);
    if before.is_empty() {
        return report;
    }
    let fixes = fixes(result);
    let mut lines = series(result, before, after);
    lines.push(("GNSS fixes", &fixes));
    let svg = plots::track(&TrackPlot { estimates: &lines, ..TrackPlot::default() });
    let withheld = if result.before.position_against == Some("truth") { "" } else { ", its later fixes withheld" };
    let whose = if is_predicted(result) { "the flight filter" } else { "dead reckoning from the first fix on" };
    let found = if result.diagnosis.effects.is_empty() { "" } else { " and with the vehicle file that was found" };
    report.figure(&format!("Track of {whose} with the declared vehicle{found}{withheld}."), svg)
}

/// North and east; the line breaks where fixes are missing.
fn fixes(result: &DiagnosisResult<'_>) -> Vec<Point> {
    let (mut points, mut previous_us): (Vec<Point>, Option<u64>) = (Vec::new(), None);
    for row in &result.log.rows {
        let Some([north_m, east_m]) = row.gnss_m() else { continue };
        if previous_us.is_some_and(|previous_us| row.time_us - previous_us > FIX_GAP_US) {
            points.push((f64::NAN, f64::NAN));
        }
        points.push((north_m, east_m));
        previous_us = Some(row.time_us);
    }
    points
}

/// Errors of position in time.
fn errors(report: Report, result: &DiagnosisResult<'_>) -> Report {
    let Some(against) = result.before.position_against else { return report };
    let (before, after) = (broken(&result.before.position_errors), broken(&result.after.position_errors));
    let svg = plots::error_vs_time(&ErrorPlot {
        y_label: "horizontal error [m]",
        series: &series(result, &before, &after),
        bound: None,
        scale: Scale::Linear,
    });
    let whose = if is_predicted(result) { "the flight filter" } else { "the model" };
    report.figure(&format!("Error of {whose} against {against}."), svg)
}

/// Lines of the declared model and, if anything was found, with it.
fn series<'a>(result: &DiagnosisResult<'_>, before: &'a [Point], after: &'a [Point]) -> Vec<plots::Series<'a>> {
    let mut lines = vec![("before", before)];
    if !result.diagnosis.effects.is_empty() {
        lines.push(("after", after));
    }
    lines
}

/// Whether the model predicts readings ahead of time.
pub fn is_predicted(result: &DiagnosisResult<'_>) -> bool {
    result.before.prediction.iter().flatten().any(Option::is_some)
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
fn residual(report: Report, result: &DiagnosisResult<'_>) -> Report {
    let d = &result.diagnosis;
    let has_effect = !d.effects.is_empty();
    let channel = figures::most_changed_channel(&d.before, &d.after);
    let label = format!("{} residual [{}]", channel.name(), channel.unit());
    let (before, after) = (figures::channel(&d.before, channel), figures::channel(&d.after, channel));
    let drawn = figures::smooth(before.iter().map(|r| (r.t_s, r.innovation)), BIN_S);
    let effect = figures::smooth(before.iter().zip(&after).map(|(b, a)| (b.t_s, b.innovation - a.innovation)), BIN_S);
    let rest = figures::smooth(after.iter().map(|r| (r.t_s, r.innovation)), BIN_S);
    // the colours of before and after are those of the map
    let mut lines = series(result, &drawn, &rest);
    if has_effect {
        lines.push(("explained by the effect", &effect));
    }
    let over = plots::time_series(&TimePlot { y_label: &label, series: &lines, band: None });
    let mut report = report.section("The residual").figure(
        &format!(
            "Innovations of {}, means of {BIN_S:.0} s{}.",
            channel.name(),
            if has_effect { ": before, after, and the part that the effect explains" } else { "" }
        ),
        over,
    );
    let (variable, [line_before, line_after]) = figures::best_variable(&d.before, &d.after, channel);
    let svg = plots::xy(&XyPlot {
        x_label: variable,
        y_label: &label,
        series: &series(result, &line_before, &line_after),
        reference: Some(("zero", 0.0)),
        ..XyPlot::default()
    });
    if !line_before.is_empty() {
        report = report.figure("The same residual against the variable that explains most of it, means in bins.", svg);
    }
    let (white_before, white_after) = (figures::spectrum(&d.before, channel), figures::spectrum(&d.after, channel));
    let svg = plots::xy(&XyPlot {
        x_label: "frequency [Hz]",
        y_label: "power, 1 if white",
        series: &series(result, &white_before, &white_after),
        reference: Some(("white", 1.0)),
        x_scale: Scale::Log,
        y_scale: Scale::Log,
    });
    report.figure("Spectrum of the normalised innovations; slow structure is at the left.", svg)
}

/// Every hypothesis with its evidence, round by round.
fn ladder(mut report: Report, result: &DiagnosisResult<'_>) -> Report {
    report = report.section("Hypotheses tested").text(
        "Each entry of the catalogue is fitted to the whitened residual. Its evidence is the square root of the χ² that it \
         removes, in sigmas. Beyond the line, chance alone gives such evidence in fewer than one log of five hundred, all \
         hypotheses counted.",
    );
    for (index, round) in result.diagnosis.rounds.iter().enumerate() {
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
fn details(mut report: Report, result: &DiagnosisResult<'_>) -> Report {
    let has_effect = result.diagnosis.verdict != Verdict::None && !result.diagnosis.effects.is_empty();
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
        let (before, after) = (&result.before.prediction[place], &result.after.prediction[place]);
        if before.iter().all(Option::is_none) {
            continue;
        }
        let mut cells = vec![format!("{} [{}]", channel.name(), channel.unit())];
        for horizon in 0..HORIZONS_S.len() {
            cells.push(optional(before[horizon], 4));
            if has_effect {
                cells.push(optional(after[horizon], 4));
            }
        }
        table = table.row(cells);
    }
    report = report.section("In numbers");
    if is_predicted(result) {
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
        let (Some(before), Some(after)) = (of(&result.before), of(&result.after)) else { continue };
        table = table.row([
            channel.name().to_owned(),
            before.count.to_string(),
            format!("{:.2}", before.nis),
            format!("{:.2}", after.nis),
            probability(before.p),
            probability(after.p),
        ]);
    }
    report.table(table)
}
