//! A replay as a report.

use super::{Found, Replayed, approximate, board};
use crate::provenance;
use backseat_logs::stats::ErrorSummary;
use backseat_report::Report;
use serde_json::{Value, json};

const NOT_EXACT: &str =
    "the session has the times of a PC, which reads late, and not the app's own steps and pulse edges";

impl Replayed {
    fn span_us(&self) -> Option<(u64, u64)> {
        match &self.found {
            Found::Exact(outcome) => outcome.span_us,
            Found::Approximate(outcome) => outcome.span_us,
        }
    }

    fn simulated_s(&self) -> f64 {
        self.span_us().map_or(0.0, |(first, last)| last.saturating_sub(first) as f64 * 1e-6)
    }

    fn times_real(&self) -> f64 {
        self.simulated_s() / self.wall.as_secs_f64()
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = match &self.found {
            Found::Exact(outcome) => outcome.notes.clone(),
            Found::Approximate(outcome) => outcome.notes.clone(),
        };
        if self.damage.cut_bytes > 0 {
            notes.push(format!("cut off: its last {} bytes are no whole record", self.damage.cut_bytes));
        }
        if self.damage.broken_records > 0 {
            notes.push(format!("{} broken records were left out", self.damage.broken_records));
        }
        notes
    }
}

/// The report of a replay.
pub fn report(replayed: &Replayed) -> Report {
    let (answer, steps, digest) = match &replayed.found {
        Found::Exact(outcome) => (exact(outcome), outcome.steps, outcome.digest),
        Found::Approximate(outcome) => (distance(outcome), outcome.steps, outcome.digest),
    };
    let title = format!("Replay of {}", replayed.log.display());
    let mut report = provenance::of(Report::new(title, answer), None).values(json(replayed));
    if let Found::Exact(outcome) = &replayed.found {
        for difference in [&outcome.step, &outcome.record].into_iter().flatten() {
            report = report.text(&format!("  {difference}"));
        }
    }
    report = report.fact("log", format!("{}, by {}", replayed.log.display(), replayed.meta.program));
    for (name, value) in &replayed.meta.facts {
        report = report.fact(name, value);
    }
    report
        .fact(
            "replayed",
            format!(
                "{steps} steps, {:.1} s in {:.2} s: {:.0} times real time",
                replayed.simulated_s(),
                replayed.wall.as_secs_f64(),
                replayed.times_real()
            ),
        )
        .fact("digest", format!("{digest:016x}"))
        .notes(&replayed.notes())
}

fn exact(outcome: &board::ExactReplay) -> String {
    let board::ExactReplay { steps, differing_steps, bytes, messages, .. } = outcome;
    if outcome.step.is_none() && outcome.record.is_none() {
        format!("the same to the bit: every step's digest, {messages} messages to the host, {bytes} bytes to devices")
    } else {
        format!("NOT the same: {differing_steps} of {steps} steps have another digest; first")
    }
}

fn distance(outcome: &approximate::ApproximateReplay) -> String {
    let mut text = format!("not to the bit: {NOT_EXACT}");
    if let Some(ErrorSummary { median_m, p95_m, max_m, count, .. }) = ErrorSummary::of(&outcome.distances_m) {
        text += &format!(
            "\ndistance from the board's position at {count} steps: median {median_m:.3} m, 95 % {p95_m:.3} m, max \
             {max_m:.3} m"
        );
    }
    if outcome.unmatched > 0 {
        text += &format!("\nat {} steps only one of the two had a position", outcome.unmatched);
    }
    text
}

fn json(replayed: &Replayed) -> Value {
    let mut value = json!({
        "log": replayed.log,
        "program": replayed.meta.program,
        "facts": replayed.meta.facts,
        "simulated_s": replayed.simulated_s(),
        "wall_s": replayed.wall.as_secs_f64(),
        "times_real": replayed.times_real(),
        "notes": replayed.notes(),
    });
    let own = match &replayed.found {
        Found::Exact(outcome) => json!({
            "clock": "board",
            "exact": replayed.first_difference().is_none(),
            "steps": outcome.steps,
            "digest": format!("{:016x}", outcome.digest),
            "compared": {"messages": outcome.messages, "bytes": outcome.bytes},
            "differing_steps": outcome.differing_steps,
            "difference": {"step": outcome.step, "record": outcome.record},
        }),
        Found::Approximate(outcome) => json!({
            "clock": "host",
            "exact": false,
            "why": NOT_EXACT,
            "steps": outcome.steps,
            "digest": format!("{:016x}", outcome.digest),
            "pulse_edges": outcome.edges,
            "distance_m": ErrorSummary::of(&outcome.distances_m)
                .map(|error| json!({"median": error.median_m, "p95": error.p95_m, "max": error.max_m})),
            "steps_unmatched": outcome.unmatched,
        }),
    };
    if let (Value::Object(value), Value::Object(own)) = (&mut value, own) {
        value.extend(own);
    }
    value
}
