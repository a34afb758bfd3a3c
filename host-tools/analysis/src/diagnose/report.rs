//! The diagnosis as a report: verdict, map, effects, before and after; the residual and all hypotheses on the page.

use super::files::Files;
use super::format::{number, optional, probability};
use super::sentence::{capital, next, predicted, sentence};
use super::{DiagnosisResult, HELD_OUT, json, page};
use crate::provenance;
use crate::read_log::file_name;
use backseat_diagnose::diagnosis::FoundEffect;
use backseat_diagnose::scores::Scores;
use backseat_report::{Report, Table};

/// The report, with the files that were written.
pub fn report(result: &DiagnosisResult<'_>, files: &Files<'_>) -> Report {
    let answer = format!("{}. {}", capital(result.diagnosis.verdict.name()), sentence(result));
    let mut report =
        Report::new(format!("Diagnosis of {}", file_name(&result.log.path)), answer).warnings(&result.doubts);
    report = page::map(report, result);
    report = effects(report, result);
    report = outside(report, result);
    report = report.table(before_after(result));
    report = page::evidence(report.on_page(), result);
    let mut notes = result.notes.clone();
    if files.vehicle.is_some() {
        notes.extend(result.vehicle_notes.iter().cloned());
    }
    if !notes.is_empty() {
        report = report.section("Notes");
    }
    report = report.everywhere().notes(&notes);
    report = report.file("vehicle_file", files.vehicle).file("terms_file", files.terms);
    let time = format!("{:.0} s of log diagnosed in {:.1} s", result.log.duration_s(), result.wall_s);
    let (command, why) = next(result, files);
    report = report.on_terminal().fact("time", time).everywhere();
    report = report.section("Next").text(&format!("{}:", capital(&why))).command(&command);
    provenance::of(json::values(report, result).value("notes", notes), None)
}

/// Effects found: a table, and a paragraph each.
fn effects(mut report: Report, result: &DiagnosisResult<'_>) -> Report {
    let found = &result.diagnosis.effects;
    if found.is_empty() {
        return report;
    }
    let mut table = Table::new("Effects found", &["effect", "parameter", "value (95 % interval)", "p"]);
    for found in found {
        for (i, value) in found.values.iter().enumerate() {
            let [name, p] = match i {
                0 => [found.instance.candidate.effect.to_owned(), probability(found.p_value)],
                _ => [String::new(), String::new()],
            };
            table = table.row([name, value.name.to_owned(), number(value), p]);
        }
    }
    report = report.table(table);
    found.iter().fold(report, effect)
}

fn effect(mut report: Report, found: &FoundEffect) -> Report {
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
    report
}

/// What remains outside the catalogue, and the terms proposed for it.
fn outside(mut report: Report, result: &DiagnosisResult<'_>) -> Report {
    let (structure, proposed) = (&result.diagnosis.structure, &result.diagnosis.proposed);
    let header = ["the residual depends on", "factor (95 % interval)", "χ² gain", "held-out gain", "p"];
    let mut table = Table::new("Structure outside the catalogue, the strongest term first", &header);
    let gains = |[gain, held]: [f64; 2], p| [format!("{gain:.0}"), format!("{held:.0}"), probability(p)];
    for hint in &structure.hints {
        let cells = gains([hint.gain, hint.held_gain], hint.p);
        table = table.row([hint.generic.name(), format!("{:.2e}", hint.value)].into_iter().chain(cells));
    }
    for term in &structure.named {
        let factors = term.values.iter().zip(&term.ci95);
        let factors: Vec<String> =
            factors.map(|(value, [low, high])| format!("{value:.4} ({low:.4} to {high:.4})")).collect();
        let cells = gains([term.gain, term.held_gain], term.p);
        table = table.row([term.name.to_owned(), factors.join(", ")].into_iter().chain(cells));
    }
    if !structure.hints.is_empty() || !structure.named.is_empty() {
        report = report.table(table);
    }
    if proposed.is_empty() {
        return report;
    }
    let header = ["term", "95 % interval", "unit", "what it could be"];
    let table = Table::new("Proposed terms, in no entry of the catalogue", &header);
    report.table(proposed.iter().fold(table, |table, term| {
        table.row([term.formula(), term.interval(), term.unit(), term.physical_reading().unwrap_or_default()])
    }))
}

/// The scores on held-out data, a column a model.
fn before_after(result: &DiagnosisResult<'_>) -> Table {
    let mut header = vec!["", "before", "after"];
    let mut columns = vec![cells(&result.before), cells(&result.after)];
    if let Some(with_terms) = &result.with_terms {
        header.push("with the proposed terms");
        columns.push(cells(with_terms));
    }
    let against = result.before.position_against.map_or_else(String::new, |what| format!(" ({what})"));
    let mut names = vec![
        // predicted ten seconds ahead, or the velocity missing between fixes
        if page::is_predicted(result) { "velocity in 10 s [m/s]" } else { "velocity [m/s]" }.to_owned(),
        format!("position [m]{against}"),
        "innovation whiteness, p".to_owned(),
        "largest autocorrelation".to_owned(),
    ];
    for (part, name) in
        ["position between fitted stretches [m]", "position in the forecast [m]"].into_iter().enumerate()
    {
        let [before, after] = result.position_by_part.map(|parts| parts[part]);
        if before.is_some() {
            names.insert(2 + part, name.to_owned());
            columns[0].insert(2 + part, optional(before, 2));
            columns[1].insert(2 + part, optional(after, 2));
            columns.iter_mut().skip(2).for_each(|cells| cells.insert(2 + part, "-".to_owned()));
        }
    }
    if let Some((channel, (before, after))) = predicted(&result.before, &result.after) {
        names.insert(1, format!("{} in 10 s [{}]", channel.name(), channel.unit()));
        for (column, value) in columns.iter_mut().zip([Some(before), Some(after), None]) {
            column.insert(1, optional(value, 4));
        }
    }
    names.extend(result.before.unexplained_variance.iter().map(|(name, _)| format!("{name}, variance unexplained")));
    let table = Table::new(format!("Before and after on held-out data: {HELD_OUT}"), &header);
    names.into_iter().enumerate().fold(table, |table, (row, name)| {
        let scores = columns.iter().map(|cells| cells.get(row).cloned().unwrap_or_default());
        table.row(std::iter::once(name).chain(scores))
    })
}

fn cells(scores: &Scores) -> Vec<String> {
    let mut cells = vec![
        optional(scores.velocity_rmse_mps, 4),
        optional(scores.position_rmse_m, 2),
        probability(scores.innovation_whiteness_p),
        optional(scores.max_autocorrelation, 3),
    ];
    cells.extend(scores.unexplained_variance.iter().map(|(_, share)| format!("{share:.3}")));
    cells
}
