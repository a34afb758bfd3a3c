//! The diagnosis as text.

use super::DiagnosisReport;
use super::sentence::{next, sentence};
use backseat_core::effects::{FIN_NAMES, ParameterKind, fin_index};
use backseat_diagnose::diagnosis::ParameterEstimate;
use backseat_diagnose::verdict::Verdict;
use std::fmt::Write as _;

pub fn text(outcome: &DiagnosisReport<'_>) -> String {
    let mut out = String::new();
    for doubt in &outcome.doubts {
        let _ = writeln!(out, "DO NOT TRUST: {doubt}");
    }
    let _ = writeln!(out, "{}\n\n{}", sentence(outcome), headline(outcome));
    for found in &outcome.diagnosis.effects {
        let _ = writeln!(out, "\n  {}", found.instance.candidate.effect);
        for value in &found.values {
            let _ = writeln!(out, "    {:24} {}", value.name, number(value));
        }
        let _ = writeln!(out, "    {}", found.instance.candidate.info().signature);
        for alternative in found.possible_alternatives() {
            let _ = writeln!(out, "    could also be {}", alternative.instance.candidate.label());
            if let Some(manoeuvre) = alternative.separating_manoeuvre {
                let _ = writeln!(out, "      to separate them: {manoeuvre}");
            }
        }
    }
    for hint in &outcome.diagnosis.structure.hints {
        let _ = writeln!(out, "  the residual depends on: {} (p {:.1e})", hint.generic.name(), hint.p);
    }
    for term in &outcome.diagnosis.structure.named {
        let _ = writeln!(
            out,
            "\n  the residual depends on: {} (p {:.1e}, {:.4?}, 95 % {:.4?})",
            term.name, term.p, term.values, term.ci95
        );
    }
    for (k, term) in outcome.diagnosis.proposed.iter().enumerate() {
        let title = if k == 0 { "\n  proposed terms, in no entry of the catalogue\n" } else { "" };
        let reading = term.physical_reading().map_or_else(String::new, |reading| format!("; {reading}"));
        let _ = writeln!(out, "{title}    {} ({}) {}{reading}", term.formula(), term.interval(), term.unit());
    }
    let _ = writeln!(out, "\n  {:28} {:>12} {:>12}", "on held-out data", "before", "after");
    for (name, before, after) in rows(outcome) {
        let _ = writeln!(out, "  {name:28} {before:>12} {after:>12}");
    }
    if let Some(with) = &outcome.with_terms {
        let some = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.4}"));
        let (velocity, position) = (some(with.velocity_rmse_mps), some(with.position_rmse_m));
        let p = probability(with.innovation_whiteness_p);
        let _ =
            writeln!(out, "  with the proposed terms: velocity {velocity} m/s, position {position} m, whiteness p {p}");
    }
    for note in &outcome.notes {
        let _ = writeln!(out, "  note: {note}");
    }
    for path in [outcome.vehicle_file, outcome.terms_file.as_deref(), outcome.page].into_iter().flatten() {
        let _ = writeln!(out, "  written: {}", path.display());
    }
    let (command, why) = next(outcome);
    let _ = writeln!(out, "  next: {command}\n        {why}");
    let _ = writeln!(out, "  {:.0} s of log diagnosed in {:.1} s", outcome.log.duration_s(), outcome.wall_s);
    out
}

/// The verdict by the names of the catalogue.
pub fn headline(outcome: &DiagnosisReport<'_>) -> String {
    let d = &outcome.diagnosis;
    let names: Vec<String> = d.effects.iter().map(|found| found.instance.candidate.label().replace('_', " ")).collect();
    let names = names.join(" and ");
    match d.verdict {
        Verdict::None => "none: the declared model leaves no significant residual.".to_owned(),
        Verdict::Explained => format!("explained: the model lacks {names}."),
        Verdict::Ambiguous => {
            let others: Vec<String> = d
                .effects
                .iter()
                .flat_map(|found| found.possible_alternatives())
                .map(|alternative| alternative.instance.candidate.label().replace('_', " "))
                .collect();
            format!("ambiguous: the model lacks {names}, or {} instead.", others.join(", "))
        }
        Verdict::Unexplained => {
            let hint = d
                .structure
                .hints
                .first()
                .map_or_else(String::new, |hint| format!(" It depends most on {}.", hint.generic.name()));
            let named = d
                .structure
                .named
                .first()
                .map_or_else(String::new, |term| format!(" It depends most on {}.", term.name));
            let beside = if names.is_empty() { String::new() } else { format!(" beside {names}") };
            format!(
                "unexplained: a residual remains{beside} that no entry of the catalogue describes ({}).{hint}{named}",
                d.reason
            )
        }
    }
}

/// A value with its interval and unit.
pub fn number(value: &ParameterEstimate) -> String {
    let unit = if value.unit == "1" { "" } else { value.unit };
    match value.kind {
        ParameterKind::Fin => fin_index(value.value).map_or("–", |fin| FIN_NAMES[fin]).to_owned(),
        _ if value.ci95.iter().all(|end| end.is_finite()) => {
            let [low, high] = value.ci95;
            // Two digits of the interval's half width.
            let digits = (1.0 - ((high - low) * 0.5).max(1e-12).log10().floor()).clamp(0.0, 8.0) as usize;
            format!("{:.digits$} {unit} ({low:.digits$} to {high:.digits$})", value.value)
        }
        _ => format!("{:.6} {unit}", value.value),
    }
}

/// A probability for the report.
pub fn probability(p: f64) -> String {
    match p {
        p if p < 1e-12 => "< 1e-12".to_owned(),
        p if p < 1e-4 => format!("{p:.0e}"),
        p => format!("{p:.4}"),
    }
}

/// The scores: name, before, after.
pub fn rows(outcome: &DiagnosisReport<'_>) -> Vec<(String, String, String)> {
    let (a, b) = (&outcome.before, &outcome.after);
    let some = |value: Option<f64>, digits: usize| value.map_or_else(|| "–".to_owned(), |v| format!("{v:.digits$}"));
    let against = a.position_against.map_or_else(String::new, |what| format!(" ({what})"));
    let p = probability;
    let mut rows = vec![
        (velocity_name(outcome), some(a.velocity_rmse_mps, 4), some(b.velocity_rmse_mps, 4)),
        (format!("position [m]{against}"), some(a.position_rmse_m, 2), some(b.position_rmse_m, 2)),
        ("innovation whiteness, p".to_owned(), p(a.innovation_whiteness_p), p(b.innovation_whiteness_p)),
        (
            "largest autocorrelation".to_owned(),
            format!("{:.3}", a.max_autocorrelation),
            format!("{:.3}", b.max_autocorrelation),
        ),
    ];
    for ((name, before), (_, after)) in a.unexplained_variance.iter().zip(&b.unexplained_variance) {
        let share = |value: &f64| format!("{value:.3}");
        rows.push((format!("{name}, variance unexplained"), share(before), share(after)));
    }
    rows
}

/// Whether the model predicts readings ahead of time.
pub fn is_predicted(outcome: &DiagnosisReport<'_>) -> bool {
    outcome.before.prediction.iter().flatten().any(Option::is_some)
}

/// The velocity score: predicted ten seconds ahead, or the velocity missing between fixes.
fn velocity_name(outcome: &DiagnosisReport<'_>) -> String {
    if is_predicted(outcome) { "velocity in 10 s [m/s]" } else { "velocity [m/s]" }.to_owned()
}
