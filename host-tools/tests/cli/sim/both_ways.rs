//! A mission on two-way ranges alone, from the sea to the desk: flown, exported, navigated again.

use crate::harness::program;
use serde_json::Value;
use std::path::Path;

const SCENARIOS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../hil-sim/scenarios");

fn backseat(arguments: &[&str]) -> String {
    program(Path::new("."), arguments).good(&format!("{arguments:?}"))
}

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&backseat(arguments)).unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Samples of a column of a table.
fn count(path: &Path, column: &str) -> usize {
    let table = std::fs::read_to_string(path).unwrap();
    let place = table.lines().next().unwrap().split(',').position(|name| name == column).expect("the column is there");
    table.lines().skip(1).filter(|line| line.split(',').nth(place).is_some_and(|cell| !cell.is_empty())).count()
}

/// Without a pulse on the vehicle no packet gives a range: the pings do. `navigate` over the exported log uses them, and
/// comes to the board's error; without them an undeclared current carries it off.
#[test]
#[ignore = "three tracks of half an hour: .ci/nightly"]
fn val_an_exported_two_way_mission_is_navigated_like_the_board() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::copy(format!("{SCENARIOS}/iver3.toml"), at("iver3.toml")).unwrap();
    let scenario = std::fs::read_to_string(format!("{SCENARIOS}/sea_trial.toml")).unwrap();
    assert!(scenario.contains("[acoustics]\n") && scenario.contains("exchange = \"uplink\""));
    let scenario = scenario.replace("[acoustics]\n", "[acoustics]\nvehicle_pulse = false\n");
    std::fs::write(at("two_way.toml"), scenario).unwrap();

    let flown =
        json(&["sim", "run", text(&at("two_way.toml")), "--minutes", "30", "--out", text(&at("flight")), "--json"]);
    assert!(flown["topside"]["vehicle"]["median_m"].is_number(), "topside is on the ship by default: {flown}");
    let board_m = flown["configurations"][0]["median_m"].as_f64().unwrap();

    let session = at("flight/session.mcap");
    backseat(&["export", text(&session), "--csv", text(&at("csv"))]);
    let log = at("csv/vehicle_log.csv");
    // one ping a cycle of 30 s, none in the first minute
    let pings = count(&log, "two_way_range_m");
    assert!((50..=60).contains(&pings) && count(&log, "range_m") == 0, "{pings}");
    // the simulator's own log has what the ship measured as well
    let own = at("flight/log.csv");
    assert!(count(&own, "two_way_range_m") >= pings && count(&own, "uplink_range_m") >= 50);

    let (vehicle, truth) = (at("iver3.toml"), at("flight/truth.csv"));
    let navigate = |log: &Path| {
        let more = ["--no-dvl", "--json"];
        json(&[&["navigate", text(log), "--vehicle", text(&vehicle), "--truth", text(&truth)][..], &more].concat())
    };
    let error_m = |result: &Value| result["error"]["median_m"].as_f64().unwrap();
    let with = navigate(&log);
    let table = std::fs::read_to_string(&log).unwrap();
    let without = at("without.csv");
    std::fs::write(&without, table.replacen("two_way_range_m", "left_out", 1)).unwrap();
    let [with_m, without_m, both_m] = [error_m(&with), error_m(&navigate(&without)), error_m(&navigate(&own))];
    eprintln!(
        "board {board_m:.2} m, navigate {with_m:.2} m, without two-way {without_m:.2} m, with uplinks {both_m:.2} m"
    );
    assert!(with["nis"]["range"].is_number() && with["rejected"]["range"] == 0, "{with}");
    // The same measurements with the ship's packets as its fixes; measured 0.34 m and the board's 0.69 m. Without them the
    // current that nobody declared is known from the surface alone: 2.7 m, and 1.3 to 18 m with other seeds.
    assert!(with_m < board_m + 0.5, "{with_m} {board_m}");
    assert!(both_m < with_m + 0.3, "uplinks help, or do no harm: {both_m} {with_m}");
    assert!(without_m > 5.0 * with_m, "{without_m} {with_m}");
}
