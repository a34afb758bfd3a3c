//! A replay for the eye, and as JSON.

use super::compare::Difference;
use super::ports::Played;
use super::{Found, Replayed, approximate, board};
use backseat_logs::session::port_name;
use backseat_logs::stats::ErrorSummary;
use serde_json::{Value, json};
use std::fmt::{self, Write as _};
use std::path::Path;
use std::time::Duration;

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { t_s, record, field, logged, replayed } = self;
        write!(f, "at {t_s} s, {record}, {field}: logged {logged}, replayed {replayed}")
    }
}

impl board::ExactReplay {
    /// The most informative difference: a record where there is one.
    pub fn first_difference(&self) -> Option<&Difference> {
        self.record.as_ref().or(self.step.as_ref())
    }
}

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

pub fn text(log: &Path, replayed: &Replayed) -> String {
    let mut text = format!("{}, by {}\n", log.display(), replayed.meta.program);
    for (name, value) in &replayed.meta.facts {
        let _ = writeln!(text, "  {name}: {value}");
    }
    let (steps, digest) = match &replayed.found {
        Found::Exact(outcome) => (outcome.steps, outcome.digest),
        Found::Approximate(outcome) => (outcome.steps, outcome.digest),
    };
    let _ = writeln!(
        text,
        "{steps} steps, {:.1} s in {:.2} s: {:.0} times real time; digest {digest:016x}",
        replayed.simulated_s(),
        replayed.wall.as_secs_f64(),
        replayed.times_real()
    );
    match &replayed.found {
        Found::Exact(outcome) => exact(outcome, &mut text),
        Found::Approximate(outcome) => distance(outcome, &mut text),
    }
    for note in replayed.notes() {
        let _ = writeln!(text, "note: {note}");
    }
    text
}

fn exact(outcome: &board::ExactReplay, text: &mut String) {
    let board::ExactReplay { steps, differing_steps, bytes, messages, .. } = outcome;
    let _ = if outcome.first_difference().is_none() {
        writeln!(
            text,
            "the same to the bit: every step's digest, {messages} messages to the host, {bytes} bytes to devices"
        )
    } else {
        writeln!(text, "NOT the same: {differing_steps} of {steps} steps have another digest; first")
    };
    for difference in [&outcome.step, &outcome.record].into_iter().flatten() {
        let _ = writeln!(text, "  {difference}");
    }
}

const NOT_EXACT: &str =
    "the session has the times of a PC, which reads late, and not the app's own steps and pulse edges";

fn distance(outcome: &approximate::ApproximateReplay, text: &mut String) {
    let _ = writeln!(text, "not to the bit: {NOT_EXACT}");
    if let Some(ErrorSummary { median_m, p95_m, max_m, .. }) = ErrorSummary::of(&outcome.distances_m) {
        let _ = writeln!(
            text,
            "distance from the board's position at {} steps: median {median_m:.3} m, 95 % {p95_m:.3} m, max {max_m:.3} m",
            outcome.distances_m.len()
        );
    }
    if outcome.unmatched > 0 {
        let _ = writeln!(text, "at {} steps only one of the two had a position", outcome.unmatched);
    }
}

pub fn json(log: &Path, replayed: &Replayed) -> String {
    let mut value = json!({
        "log": log,
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
            "exact": outcome.first_difference().is_none(),
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
                .map(|ErrorSummary { median_m: median, p95_m: p95, max_m: max, .. }| json!({"median": median, "p95": p95, "max": max})),
            "steps_unmatched": outcome.unmatched,
        }),
    };
    if let (Value::Object(value), Value::Object(own)) = (&mut value, own) {
        value.extend(own);
    }
    format!("{value}\n")
}

pub fn played(played: &[Played], wall: Duration) -> String {
    let mut text = format!("{:.1} s\n", wall.as_secs_f64());
    for port in played {
        let _ = write!(text, "{:<9} to {}: {} bytes", port_name(port.port), port.path, port.bytes);
        if let (Some(p99), Some(max)) = (port.late_ms(0.99), port.late_ms(1.0)) {
            let _ = write!(text, " in {} pieces, late by {p99:.3} ms (99 %), {max:.3} ms (max)", port.late_us.len());
        }
        text.push('\n');
    }
    text
}

pub fn played_json(played: &[Played], wall: Duration) -> String {
    let ports: Vec<_> = played
        .iter()
        .map(|port| {
            json!({
                "port": port_name(port.port),
                "path": port.path,
                "bytes": port.bytes,
                "late_ms": {"p50": port.late_ms(0.5), "p99": port.late_ms(0.99), "max": port.late_ms(1.0)},
            })
        })
        .collect();
    format!("{}\n", json!({"wall_s": wall.as_secs_f64(), "ports": ports}))
}
