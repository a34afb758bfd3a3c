//! What the robust filter has estimated beside the motion, and what of it may be read as a finding.

use backseat_core::navigation::{ESTIMATE_NAMES, ESTIMATE_UNITS, StateEstimate};
use backseat_estimation::filter::FilterRun;
use backseat_report::{Report, Table};
use serde_json::{Map, Value, json};
use std::fmt::Write as _;

const ABOUT: &str = "The filter uses all of them. An estimate that is not separable yet is no finding: the motion so far \
                     does not tell it from its prior, or from another estimate. What causes a difference is named by \
                     backseat diagnose.";

const HEADER: [&str; 5] = ["estimate", "value", "sigma", "declared sigma", "separable"];

/// Name, value, sigma and prior sigma with their unit, and whether it is separable.
fn cells(estimate: &StateEstimate) -> Option<[String; 5]> {
    let place = estimate.parameter.place()?;
    let number = |value: f64| match ESTIMATE_UNITS[place] {
        // the logarithm of a factor
        "1" => format!("{:.1} %", 100.0 * value),
        "rad" => format!("{:.2} deg", value.to_degrees()),
        unit if unit.ends_with("s^2") => format!("{value:.1e} {unit}"),
        unit => format!("{value:.3} {unit}"),
    };
    let value = if ESTIMATE_UNITS[place] == "1" { estimate.value.exp_m1() } else { estimate.value };
    let separable = if estimate.is_separable() { "yes" } else { "not separable yet" };
    let [value, sigma, prior] = [value, estimate.sigma, estimate.prior_sigma].map(number);
    Some([ESTIMATE_NAMES[place].to_owned(), value, sigma, prior, separable.to_owned()])
}

/// One line about all of them.
fn verdict(run: &FilterRun) -> String {
    let separable = run.estimates.iter().filter(|estimate| estimate.is_separable()).count();
    if separable == 0 {
        return "The log is too short, or its motion too uniform, to separate any estimate from the others.".to_owned();
    }
    format!("The log separates {separable} of {} estimates.", run.estimates.len())
}

/// When the filter itself was least certain, if that was while it was learning.
fn worst(run: &FilterRun) -> Option<String> {
    let first_us = run.track.first()?.time_us;
    let worst = run.track.iter().max_by(|a, b| a.drms_m().total_cmp(&b.drms_m()))?;
    let last = run.track.last()?;
    let minutes = (worst.time_us - first_us) as f64 / 6e7;
    Some(format!(
        "It expected its largest error, {:.2} m (DRMS), {minutes:.0} min after the start, and {:.2} m at the end: a dive is \
         worst while little is learnt. One that starts from a [learnt] section (--learn) is less so.",
        worst.drms_m(),
        last.drms_m()
    ))
}

pub fn text(out: &mut String, run: &FilterRun) {
    if run.estimates.is_empty() {
        return;
    }
    let [name, value, sigma, prior, separable] = HEADER;
    let _ = writeln!(out, "\n{name:<18} {value:>14} {sigma:>14} {prior:>14}   {separable}");
    for [name, value, sigma, prior, separable] in run.estimates.iter().filter_map(cells) {
        let _ = writeln!(out, "{name:<18} {value:>14} {sigma:>14} {prior:>14}   {separable}");
    }
    let _ = writeln!(out, "{} {ABOUT}", verdict(run));
    if let Some(worst) = worst(run) {
        let _ = writeln!(out, "{worst}");
    }
}

pub fn section(report: Report, run: &FilterRun) -> Report {
    if run.estimates.is_empty() {
        return report;
    }
    let mut table = Table::new("What the robust filter has estimated at the end of the log", &HEADER);
    for cells in run.estimates.iter().filter_map(cells) {
        table = table.row(cells);
    }
    let about = format!("{} {ABOUT}", verdict(run));
    let report = report.table(table).text(&about);
    match worst(run) {
        Some(worst) => report.text(&worst),
        None => report,
    }
}

/// By name; the value of a parameter of the model is the logarithm of true over declared.
pub fn json(run: &FilterRun) -> Value {
    let named = run.estimates.iter().filter_map(|estimate| {
        let place = estimate.parameter.place()?;
        let value = json!({
            "value": estimate.value, "sigma": estimate.sigma, "declared_sigma": estimate.prior_sigma,
            "unit": ESTIMATE_UNITS[place], "largest_correlation": estimate.correlation,
            "separable": estimate.is_separable(),
        });
        Some((ESTIMATE_NAMES[place].to_owned(), value))
    });
    let named: Map<String, Value> = named.collect();
    if named.is_empty() { Value::Null } else { Value::Object(named) }
}
