//! Short runs of a torpedo as a user goes: simulated, read, predicted; diagnosed, and the vehicle file that is found.

use crate::harness::{Outcome, program};
use serde_json::Value;
use std::path::Path;

fn simulate(folder: &Path, effect: &str, flown: &str) {
    let arguments = ["sim", "short-runs", "--effect", effect, "--seed", "2", "--flown", flown, "--out", "runs"];
    program(folder, arguments).good("simulated");
}

/// Root mean squares of predictions of ten seconds.
fn predicted(folder: &Path, vehicle: &[&str]) -> Value {
    let arguments = ["diagnose", "runs", "--predict", "10", "--json"];
    program(folder, arguments.iter().chain(vehicle)).json()["prediction"].clone()
}

/// A run by its label.
fn navigated(folder: &Path, label: &str) -> Outcome {
    let log = format!("runs/IverControlData-{label}.log");
    program(folder, ["navigate", &log, "--vehicle", "found.toml"])
}

#[test]
fn short_runs_are_read_and_predicted_without_a_fit() {
    let folder = tempfile::tempdir().unwrap();
    simulate(folder.path(), "none", "1");
    let prediction = predicted(folder.path(), &[]);
    assert!(prediction["pooled"]["windows"].as_u64().unwrap() > 4, "{prediction}");
    let depth_m = prediction["pooled"]["depth_m"].as_f64().unwrap();
    assert!((0.01..3.0).contains(&depth_m), "the textbook's depth is {depth_m} m off");
    let runs = prediction["runs"].as_object().unwrap();
    assert_eq!(runs.keys().collect::<Vec<_>>(), ["20220913080000", "20220915080000"]);
    // two runs are too few to find anything in
    let refused = program(folder.path(), ["diagnose", "runs"]);
    assert_eq!(refused.code, Some(1), "{}", refused.stderr);
    assert!(refused.stderr.contains("2 runs with 3 s deeper than 0.5 m"), "{}", refused.stderr);
}

#[test]
#[ignore = "half a minute of a full diagnosis: .ci/nightly"]
fn what_short_runs_show_flies_navigates_and_predicts_better() {
    let folder = tempfile::tempdir().unwrap();
    simulate(folder.path(), "random", "3");
    let found = program(folder.path(), ["diagnose", "runs", "--out", "found.toml", "--json"]).json();
    assert!(found["effects"].is_array(), "{found}");
    let yaw_deg = |vehicle: &[&str]| predicted(folder.path(), vehicle)["pooled"]["yaw_deg"].as_f64().unwrap();
    let (textbook, found) = (yaw_deg(&[]), yaw_deg(&["--vehicle", "found.toml"]));
    assert!(found < 0.5 * textbook, "yaw over 10 s: {found} degrees by what was found, {textbook} by the textbook");
    program(folder.path(), ["vehicle", "check", "found.toml"]).good("flies");
    let navigated = navigated(folder.path(), "20220915080000");
    assert!(matches!(navigated.code, Some(0 | 3)), "{}", navigated.stderr);
    assert!(!navigated.stdout.contains("were refused"), "{}", navigated.stdout);
}
