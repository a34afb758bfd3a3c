//! Scenario files: what is accepted, and the errors for everything else.

use hil_sim::scenario::{Scenario, Settings};
use std::path::Path;

const SURVEY: &str = include_str!("../../scenarios/survey.toml");

/// The error of the survey with one piece of text replaced.
fn error(from: &str, to: &str) -> String {
    assert!(SURVEY.contains(from));
    Settings::parse(&SURVEY.replacen(from, to, 1), Path::new("s.toml")).unwrap_err().to_string()
}

/// "s.toml:LINE:" of a piece of text in the survey.
fn line_of(text: &str) -> String {
    let before = &SURVEY[..SURVEY.find(text).unwrap()];
    format!("s.toml:{}:", before.matches('\n').count() + 1)
}

#[test]
fn built_in_scenarios_are_valid_and_differ_as_they_say() {
    let [survey, current, pd] = ["survey", "survey_current", "survey_pd"].map(|n| Scenario::built_in(n).unwrap());
    assert_eq!(survey.settings.waypoints().len(), 22);
    assert_eq!(survey.settings.lines().len(), 10);
    let c = current.settings.environment.current;
    assert!((c.north_mps.hypot(c.east_mps) - 0.15).abs() < 1e-15);
    assert!(current.settings.backseat.current_state && !survey.settings.backseat.current_state);
    assert_ne!(survey.settings.backseat.control_law, pd.settings.backseat.control_law);
    assert!(Scenario::built_in("nowhere").unwrap_err().to_string().contains("survey_current"));
}

#[test]
fn errors_name_file_line_and_key() {
    for (from, to, expected) in [
        ("radius_m = 600.0", "radius_km = 0.6", "unknown field `radius_km`"),
        ("period_s = 30", "period_s = 0", "acoustics.period_s: "),
        ("loss_share = 0.0", "loss_share = 1.5", "acoustics.loss_share: 1.5 is outside 0 to 1"),
        ("first_line_m = [0.0, 0.0]", "first_line_m = [0.0, nan]", "first_line_m: NaN is outside"),
        ("depth_m = 3.0", "depth_m = \"deep\"", "depth_m: invalid type: string \"deep\""),
        ("control_law = \"lqr\"", "control_law = \"mpc\"", "backseat.control_law: unknown variant `mpc`"),
        ("step_us = 10_000", "step_us = 7_000", "plant.step_us: 7000 is not a divisor"),
        ("exchange = \"downlink\"", "exchange = \"smoke\"", "unknown variant `smoke`"),
        ("y_m = 0.0\n", "\n", "start: missing field `y_m`"),
        ("rate_hz = 7.0", "rate_hz = = 7.0", "s.toml:"),
    ] {
        let message = error(from, to);
        assert!(message.contains(expected), "{message}");
        assert!(!message.contains('\n'), "one line: {message}");
        let line = if to == "\n" { line_of("[start]") } else { line_of(from) };
        assert!(message.starts_with(&line), "{message} {line}");
    }
}

#[test]
fn effects_are_read_by_name_and_checked() {
    let read = |effects: &str| Settings::parse(&format!("{SURVEY}\n{effects}"), Path::new("s.toml"));
    let settings =
        read("[effects.fin_stuck]\nfin = \"port\"\nrad = 0.05\ntime_s = 100\n[effects.heading_bias]\ncos_rad = 0.02\n")
            .unwrap();
    let texts: Vec<String> = settings.effects.as_slice().iter().map(ToString::to_string).collect();
    let mut texts: Vec<&str> = texts.iter().map(String::as_str).collect();
    texts.sort_unstable();
    assert_eq!(texts, ["fin_stuck:fin=port,rad=0.05,time_s=100", "heading_bias:const_rad=0,sin_rad=0,cos_rad=0.02"]);
    for (effects, expected) in [
        ("[effects.gremlin]\nsize = 1.0\n", "no effect gremlin"),
        ("[effects.dvl_scale]\nratio = 0.9\n", "effects.dvl_scale.ratio: 0.9 is outside -0.1 to 0.1"),
        ("[effects.dvl_scale]\ngain = 0.9\n", "dvl_scale has no gain; it has ratio"),
        ("[effects.fin_bias]\nfin = \"left\"\nrad = 0.1\n", "effects.fin_bias.fin: left: top, bottom"),
        ("[effects.fin_bias]\nfin = \"top\"\n", "fin_bias: rad is missing"),
    ] {
        let message = read(effects).unwrap_err().to_string();
        assert!(message.contains(expected) && !message.contains('\n'), "{message}");
        let line = SURVEY.lines().count() + 2;
        assert!((0..3).any(|more| message.starts_with(&format!("s.toml:{}:", line + more))), "{message}");
    }
}

#[test]
fn a_missing_scenario_and_a_missing_vehicle_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    assert!(Scenario::load(&path).unwrap_err().to_string().contains("mine.toml: "));
    std::fs::write(&path, SURVEY).unwrap();
    let message = Scenario::load(&path).unwrap_err().to_string();
    assert!(message.contains("mine.toml:6:1: vehicle: no such file"), "{message}");
    std::fs::write(folder.path().join("iver3.toml"), include_str!("../../scenarios/iver3.toml")).unwrap();
    assert_eq!(Scenario::load(&path).unwrap().settings.name, "survey");
}

#[test]
fn waypoint_missions_are_read() {
    let lawnmower = SURVEY.find("[mission.lawnmower]").unwrap();
    let end = SURVEY.find("[backseat]").unwrap();
    let legs = "[[mission.waypoints]]\nx_m = 50.0\ny_m = 0.0\ndepth_m = 0.0\nspeed_mps = 1.0\n\
                [[mission.waypoints]]\nx_m = 90.0\ny_m = 5.0\ndepth_m = 2.0\nspeed_mps = 1.0\nscored = true\n";
    let text = format!("{}{legs}{}", &SURVEY[..lawnmower], &SURVEY[end..]);
    let settings = Settings::parse(&text, Path::new("s.toml")).unwrap();
    assert_eq!(settings.waypoints().len(), 2);
    assert_eq!(settings.lines()[0].from_m, [50.0, 0.0]);
}
