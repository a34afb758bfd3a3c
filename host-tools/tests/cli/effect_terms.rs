//! What no vehicle file holds, from `diagnose` through `navigate --terms` and `effect new` to a draft: a compass that
//! drifts (in no entry of the catalogue) and one that lags (an entry without a parameter of the board).

use crate::harness::{Outcome, program};
use serde_json::Value;
use std::path::Path;

fn backseat(folder: &Path, arguments: &str) -> Outcome {
    program(folder, arguments.split_whitespace())
}

/// The JSON object that a command prints. A compass that errs by so much is noticed: exit code 3.
fn json(folder: &Path, arguments: &str) -> Value {
    backseat(folder, arguments).json()
}

fn simulate(folder: &Path, effect: &str, seed: u32, name: &str) {
    json(
        folder,
        &format!("sim dataset --effect {effect} --seed {seed} --hours 0.25 --excite --no-ranges --out {name} --json"),
    );
}

/// Adds to the heading of a log a drift of so many radians over its length.
fn drift(path: &Path, rad: f64) {
    let log = std::fs::read_to_string(path).unwrap();
    let mut lines: Vec<Vec<String>> =
        log.lines().map(|line| line.split(',').map(ToOwned::to_owned).collect()).collect();
    let column = |name: &str| lines[0].iter().position(|cell| cell == name).unwrap();
    let (time, heading) = (column("t_s"), column("heading_rad"));
    let end_s: f64 = lines.last().unwrap()[time].parse().unwrap();
    for cells in lines.iter_mut().skip(1) {
        let t_s: f64 = cells[time].parse().unwrap();
        if let Ok(value) = cells[heading].parse::<f64>() {
            cells[heading] = (value + rad * (t_s / end_s - 0.5)).to_string();
        }
    }
    let rows: Vec<String> = lines.iter().map(|cells| cells.join(",")).collect();
    std::fs::write(path, rows.join("\n") + "\n").unwrap();
}

/// Medians of the true horizontal error without and with what the file of terms takes out of the log, m.
fn medians(folder: &Path, set: &str) -> [f64; 2] {
    ["", " --terms out/proposed_terms.toml"].map(|terms| {
        let line = format!(
            "navigate {set}/log.csv --vehicle {set}/vehicle.toml --model nominal --truth {set}/truth/truth.csv --json{terms}"
        );
        json(folder, &line)["error"]["median_m"].as_f64().unwrap()
    })
}

#[test]
fn a_cause_in_no_entry_becomes_a_term_a_better_track_and_a_draft() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    simulate(folder, "none", 42, "set");
    drift(&folder.join("set/log.csv"), 0.3);
    let found = json(folder, "diagnose set/log.csv --vehicle set/vehicle.toml --report out --json");
    assert_eq!(found["verdict"], "unexplained");
    let term = &found["proposed_terms"][0];
    assert!(term["formula"].as_str().unwrap().starts_with("heading += "), "{term}");
    let [before, after] = medians(folder, "set");
    println!("drift: {before} -> {after} m");
    assert!(after < 0.5 * before, "{before} -> {after}");

    let draft = backseat(folder, "effect new compass_drift --from out/proposed_terms.toml --out draft.rs");
    draft.good("effect new");
    let draft = std::fs::read_to_string(folder.join("draft.rs")).unwrap();
    let terms: toml::Table = std::fs::read_to_string(folder.join("out/proposed_terms.toml")).unwrap().parse().unwrap();
    let first = &terms["term"][0];
    let [low, high] = [0, 1].map(|end| first["ci95"][end].as_float().unwrap());
    assert!(low < 0.3 && 0.3 < high, "{low} {high}");
    for part in [
        "//! heading += k (t/T - 1/2) with k = ",
        &format!("95 % {low} to {high} rad"),
        "pub const INFO: EffectInfo = EffectInfo {",
        "name: \"compass_drift\"",
        "ParameterInfo::symmetric(\"k1\", \"rad\", ",
        "enters: Enters::Measurement",
        "equations: \"heading += k1 (t/T - 1/2)",
    ] {
        assert!(draft.contains(part), "{part}\n{draft}");
    }
    let count = |c: char| draft.chars().filter(|other| *other == c).count();
    assert!(count('{') == count('}') && count('[') == count(']') && count('(') == count(')'), "{draft}");
    let again = backseat(folder, "effect new heading_lag --from out/proposed_terms.toml");
    assert!(again.stderr.contains("the catalogue has this entry already"));
}

#[test]
fn a_late_compass_is_named_and_taken_out_of_the_log() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    simulate(folder, "heading_lag:s=1.5", 91, "set");
    let found =
        json(folder, "diagnose set/log.csv --vehicle set/vehicle.toml --truth set/truth/truth.csv --report out --json");
    assert_eq!(
        (found["verdict"].as_str(), found["effects"][0]["name"].as_str()),
        (Some("explained"), Some("heading_lag"))
    );
    let ci95 = &found["effects"][0]["parameters"]["s"]["ci95"];
    assert!(ci95[0].as_f64().unwrap() < 1.5 && 1.5 < ci95[1].as_f64().unwrap(), "{ci95}");
    let position = |part: &str| found[part]["position_rmse_m"].as_f64().unwrap();
    assert!(position("after") < 0.6 * position("before"), "{} {}", position("before"), position("after"));
    let [before, after] = medians(folder, "set");
    println!("lag: {before} -> {after} m");
    assert!(after < 0.5 * before, "{before} -> {after}");
    // It is an entry already: there is nothing to draft.
    let none = backseat(folder, "effect new other --from out/proposed_terms.toml");
    assert!(none.code != Some(0) && none.stderr.contains("no [[term]]"));
}

#[test]
fn the_catalogue_is_listed_and_shown() {
    let folder = tempfile::tempdir().unwrap();
    let listed = json(folder.path(), "effect list --json");
    let names: Vec<&str> =
        listed["effects"].as_array().unwrap().iter().map(|entry| entry["name"].as_str().unwrap()).collect();
    assert!(
        ["water_current", "waves", "heading_lag", "depth_scale"].iter().all(|name| names.contains(name)),
        "{names:?}"
    );
    let printed = backseat(folder.path(), "effect list").stdout;
    assert!(names.iter().all(|name| printed.contains(&format!("\n{name} "))), "{printed}");
    let shown = backseat(folder.path(), "effect show heading_lag").stdout;
    assert!(shown.starts_with("heading_lag\n\nequations   psi_m") && shown.contains("signature"), "{shown}");
    let unknown = backseat(folder.path(), "effect show gremlins");
    assert!(unknown.code != Some(0) && unknown.stderr.contains("no effect gremlins"));
}
