//! `backseat mission`.

use super::bench::Bench;

const MISSION: &str = "\
[[mission.waypoints]]
x_m = 0.0
y_m = -0.125
depth_m = 0.0
speed_mps = 1.0

[[mission.waypoints]]
x_m = 300.0
y_m = 400.0
depth_m = 3.0
speed_mps = 1.25
";

#[test]
fn a_mission_goes_there_and_comes_back() {
    let bench = Bench::new();
    assert!(bench.complaint(&["mission", "get", "PORT"]).contains("no mission"));
    assert!(bench.complaint(&["mission", "start", "PORT"]).contains("no mission"));
    bench.write("m.toml", MISSION);
    assert_eq!(bench.good(&["mission", "put", "PORT", "m.toml"]), "2 waypoints, 500 m\n");
    let printed = bench.good(&["mission", "get", "PORT"]);
    assert!(printed.ends_with(MISSION), "{printed}");
    assert!(bench.good(&["mission", "get", "PORT", "-o", "out.toml"]).starts_with("2 waypoints to out.toml"));
    assert_eq!(bench.read("out.toml"), printed);
    // what was written can be put again; what exists is not replaced
    assert!(bench.complaint(&["mission", "get", "PORT", "out.toml"]).contains("exists already"));
    bench.good(&["mission", "get", "PORT", "out.toml", "--force"]);
    bench.good(&["mission", "put", "PORT", "out.toml"]);
    assert_eq!(bench.json(&["mission", "get", "PORT"])["waypoints"][1]["speed_mps"], 1.25);
    // no sensors here: it waits
    let started = bench.json(&["mission", "start", "PORT"]);
    assert!(started["leg"].is_null(), "{started}");
    assert!(bench.complaint(&["params", "store", "PORT"]).contains("stored nothing"));
    assert!(bench.good(&["mission", "stop", "PORT"]).starts_with("stopped"));
}

#[test]
fn a_scenario_is_a_mission() {
    let bench = Bench::new();
    bench.write("survey.toml", include_str!("../../../../hil-sim/scenarios/survey.toml"));
    assert_eq!(bench.json(&["mission", "put", "PORT", "survey.toml"])["waypoints"], 22);
    let waypoints = bench.json(&["mission", "get", "PORT"]);
    assert_eq!(waypoints["waypoints"].as_array().unwrap().len(), 22);
    assert_eq!(waypoints["waypoints"][0]["x_m"], -40.0);
}

#[test]
fn a_planned_mission_is_taken_and_started() {
    let bench = Bench::new();
    let arguments = ["identify", "--plan", "plan.toml", "--duration", "150", "--depth", "3,9", "--seed", "2"];
    let plan = bench.json(&arguments);
    let duration_s = plan["duration_s"].as_f64().unwrap();
    assert!((142.5..=157.5).contains(&duration_s) && plan["pitch_deg"].as_f64().unwrap() < 25.0, "{plan}");
    let put = bench.json(&["mission", "put", "PORT", "plan.toml"]);
    assert_eq!(put["waypoints"], plan["waypoints"]);
    let kept = bench.json(&["mission", "get", "PORT"]);
    assert_eq!(kept["waypoints"].as_array().unwrap().len() as u64, plan["waypoints"].as_u64().unwrap());
    // no sensors here: it waits
    assert!(bench.json(&["mission", "start", "PORT"])["leg"].is_null());
    assert!(bench.good(&["mission", "stop", "PORT"]).starts_with("stopped"));
}

#[test]
fn a_refused_mission_leaves_none() {
    let bench = Bench::new();
    bench.write("good.toml", MISSION);
    bench.good(&["mission", "put", "PORT", "good.toml"]);
    bench.write("deep.toml", &MISSION.replace("depth_m = 3.0", "depth_m = -3.0"));
    let line = bench.complaint(&["mission", "put", "PORT", "deep.toml"]);
    assert!(line.contains("deep.toml:10:11: ") && line.contains("depth_m"), "{line}");
    // the board has not heard of it
    assert!(bench.good(&["mission", "get", "PORT"]).ends_with(MISSION));
    bench.write("long.toml", &MISSION.repeat(65));
    let line = bench.complaint(&["mission", "put", "PORT", "long.toml"]);
    assert!(line.contains("130 waypoints") && line.contains("128"), "{line}");
    // the board has refused it: nobody may fly the mission before by mistake
    assert!(bench.complaint(&["mission", "get", "PORT"]).contains("no mission"));
    bench.good(&["mission", "put", "PORT", "good.toml"]);
    // the file lets zero speed pass, the board does not
    bench.write("still.toml", &MISSION.replace("1.25", "0.0"));
    let line = bench.complaint(&["mission", "put", "PORT", "still.toml"]);
    assert!(line.contains("refused waypoint 1") && line.contains("outside its range"), "{line}");
    assert!(bench.complaint(&["mission", "get", "PORT"]).contains("no mission"));
    bench.good(&["mission", "put", "PORT", "good.toml"]);
    // the cable breaks after about two requests
    let outcome = bench.run_until(&["mission", "put", "PORT", "good.toml"], 90);
    outcome.complaint("a broken cable");
    assert!(bench.complaint(&["mission", "get", "PORT"]).contains("no mission"));
}
