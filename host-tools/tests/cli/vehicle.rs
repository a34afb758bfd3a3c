//! `backseat vehicle` and the simulator's refusal of vehicles that do not fly.

use crate::harness::{backseat, text};
use serde_json::Value;

#[test]
fn every_template_flies_and_a_scaled_one_too() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for template in ["iver3", "remus100", "lauv"] {
        let file = format!("{template}.toml");
        assert!(backseat(at, &["vehicle", "new", "--from", template, "--out", &file]).status.success());
        let output = backseat(at, &["vehicle", "check", &file, "--json"]);
        let json: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!((output.status.code(), json["flies"].as_bool()), (Some(0), Some(true)), "{json}");
        let printed = text(&backseat(at, &["vehicle", "check", &file]).stdout);
        assert!(printed.contains(" flies: ") && printed.contains("sideways"), "{printed}");
    }
    // Prestero's thesis: 1500 rpm drive his vehicle at 1.54 m/s; the trim at 1.5 m/s takes a little more.
    let output = backseat(at, &["vehicle", "check", "remus100.toml", "--json"]);
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let at_1_5 = json["cruises"].as_array().unwrap().iter().find(|cruise| cruise["speed_mps"] == 1.5).unwrap();
    let rpm = at_1_5["rpm"].as_f64().unwrap();
    assert!((rpm / 1500.0 - 1.0).abs() < 0.1, "{rpm}");
    let scaled = [
        "vehicle",
        "new",
        "--name",
        "ours",
        "--length",
        "1.7",
        "--diameter",
        "0.16",
        "--mass",
        "31",
        "--out",
        "ours.toml",
    ];
    assert!(backseat(at, &scaled).status.success());
    let output = backseat(at, &["vehicle", "check", "ours.toml"]);
    assert!(output.status.success(), "{}", text(&output.stdout));
    let again = backseat(at, &scaled);
    assert_eq!(again.status.code(), Some(1));
    assert!(text(&again.stderr).contains("--force"));
}

#[test]
fn a_vehicle_that_does_not_fly_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let heavy = include_str!("../../logs/vehicles/iver3.toml")
        .replace("mass_kg = 38.0", "mass_kg = 3000.0")
        .replace("displaced_mass_kg = 38.15", "displaced_mass_kg = 3010.0")
        .replace("[39.3, 74.0, 74.0, 0.2, 20.0, 20.0]", "[3100.0, 6000.0, 6000.0, 20.0, 2000.0, 2000.0]");
    std::fs::write(at.join("heavy.toml"), heavy).unwrap();
    let output = backseat(at, &["vehicle", "check", "heavy.toml"]);
    assert_eq!(output.status.code(), Some(3));
    let printed = text(&output.stdout);
    assert!(printed.contains("DOES NOT FLY: vehicle.displaced_mass_kg: 3010 kg is 86"), "{printed}");
    let output = backseat(at, &["sim", "run", "--vehicle", "heavy.toml", "--minutes", "1", "--out", "a"]);
    assert_eq!(output.status.code(), Some(1));
    let printed = text(&output.stderr);
    assert!(printed.contains("does not fly: vehicle.displaced_mass_kg") && printed.contains("--force"), "{printed}");
    assert!(printed.lines().count() == 1 && !at.join("a").exists(), "{printed}");
}

#[test]
fn a_capsized_vehicle_is_the_headline() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("iver3.toml"), include_str!("../../../hil-sim/scenarios/iver3.toml")).unwrap();
    // what nobody declared: the centre of gravity lies 25 mm above the centre of buoyancy
    let survey = include_str!("../../../hil-sim/scenarios/survey.toml");
    let scenario = survey.replace("[plant] ", "[plant]\ncg_offset_m = [0.0, 0.0, -0.04]\n#");
    assert_ne!(scenario, survey);
    std::fs::write(at.join("top_heavy.toml"), scenario).unwrap();
    let output = backseat(at, &["sim", "run", "top_heavy.toml", "--minutes", "4", "--out", "a"]);
    assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
    let printed = text(&output.stdout);
    assert!(printed.starts_with("CAPSIZED: ") && !printed.contains("flown to its end"), "{printed}");
    assert!(
        std::fs::read_to_string(at.join("a/report.html"))
            .unwrap()
            .contains("<p class=\"alarm\" role=\"alert\">CAPSIZED")
    );
}
