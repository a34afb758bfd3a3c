//! The draft of an entry of the catalogue, as the Rust file that a developer completes.

use super::terms::{Term, Terms};
use backseat_diagnose::regressors::{GenericTerm, Target};
use backseat_report::Report;
use std::fmt::Write as _;
use std::path::Path;

/// The report on a draft that was written to `out`.
///
/// # Errors
/// The terms are no JSON.
pub fn report(name: &str, terms: &Terms, draft: String, out: Option<&Path>) -> serde_json::Result<Report> {
    let report = Report::new(name, format!("Draft of {name} by {} terms", terms.term.len()));
    let report = report.value("name", name).value("terms", serde_json::to_value(&terms.term)?);
    Ok(report.value("draft", draft).file("file", out))
}

/// The file's text.
pub fn text(name: &str, terms: &Terms) -> String {
    let equations: Vec<String> = terms.term.iter().enumerate().map(|(k, term)| equation(term, &parameter(k))).collect();
    let mut out = String::new();
    let _ = writeln!(out, "//! `{name}`: TODO one line: which physical cause.\n//!");
    let _ = writeln!(out, "//! A draft by `backseat effect new` from terms fitted to a log:");
    for term in &terms.term {
        let _ = writeln!(
            out,
            "//! {} with k = {}, 95 % {} to {} {}{}",
            equation(term, "k"),
            term.value,
            term.ci95[0],
            term.ci95[1],
            term.unit,
            term.physical_reading.as_ref().map_or_else(String::new, |reading| format!(" ({reading})"))
        );
    }
    let readings = terms.term.iter().all(|term| !is_process(term));
    let _ = writeln!(out, "\nuse super::{{EffectInfo, Enters, Hooks, ParameterInfo}};\n\n/// The catalogue's entry.");
    let _ = writeln!(out, "pub const INFO: EffectInfo = EffectInfo {{\n    name: \"{name}\",\n    parameters: &[");
    for (k, term) in terms.term.iter().enumerate() {
        // Ten times what was found: what is plausible is for the developer to say.
        let most = 10.0 * term.value.abs();
        let _ = writeln!(
            out,
            "        ParameterInfo::symmetric(\"{}\", \"{}\", {most:e}), // TODO name with its unit, plausible range",
            parameter(k),
            term.unit
        );
    }
    let _ = writeln!(out, "    ],");
    let _ = writeln!(out, "    enters: Enters::{},", if readings { "Measurement" } else { "Process" });
    let _ = writeln!(out, "    equations: \"{}\",", equations.join("; "));
    let _ = writeln!(out, "    signature: \"TODO what it leaves in the residual of a model that lacks it\",");
    let _ = writeln!(
        out,
        "    confused_with: &[], // TODO entries that leave the same, when, and which manoeuvre separates them"
    );
    let hook = if readings { "measure: Some(Measure { channels, apply })" } else { "plant, wrench_by or input" };
    let _ = writeln!(out, "    hooks: Hooks::NONE, // TODO {hook}\n}};");
    let _ = writeln!(
        out,
        "\n// Then: add `{name}` to CATALOGUE (firmware/core/src/effects/mod.rs), inject it in the simulator by its own equations\n\
         // (hil-sim/src/scenario/effects), and run hil-sim/tests/simulator/effects, which names what is missing."
    );
    out
}

fn parameter(k: usize) -> String {
    format!("k{}", k + 1)
}

fn equation(term: &Term, factor: &str) -> String {
    let times = if term.times == "1" { String::new() } else { format!(" {}", term.times) };
    format!("{} += {factor}{times}", term.adds_to)
}

fn is_process(term: &Term) -> bool {
    GenericTerm::find(&term.adds_to, &term.times).is_none_or(|term| !matches!(term.target, Target::Reading(_)))
}
