//! What a simulated sea trial leaves behind, joined again from the logs of vehicle, receiver and both modems.

use crate::harness::program;
use serde_json::Value;
use std::path::Path;

/// Of the built-in scenario's local frame.
const ORIGIN: &str = "41.5,-70.7";

fn backseat(arguments: &[&str]) -> Value {
    program(Path::new("."), arguments).json()
}

/// Ranges that the vehicle heard, that the ship heard (its uplinks), and both: each brings a vehicle without a DVL
/// home, and neither does it no good.
#[test]
fn val_the_ranges_of_both_modems_navigate_the_vehicle() {
    let folder = tempfile::tempdir().unwrap();
    let flight = folder.path().join("flight");
    let scenarios = concat!(env!("CARGO_MANIFEST_DIR"), "/../hil-sim/scenarios");
    let vehicle = format!("{scenarios}/iver3.toml");
    backseat(&["sim", "run", "sea_trial", "--minutes", "30", "--out", text(&flight), "--json"]);
    let at = |name: &str| flight.join("trial").join(name);
    let [ship, of_vehicle, of_ship] = ["ship.nmea", "vehicle_modem.log", "ship_modem.log"].map(at);
    let navigate = |modems: &[&Path]| {
        let (log, truth) = (at("vehicle.csv"), at("truth.csv"));
        let places = ["--origin", ORIGIN, "--vehicle", &vehicle, "--truth", text(&truth), "--no-dvl", "--json"];
        let mut arguments = vec!["navigate", text(&log), "--ship", text(&ship)];
        arguments.extend(modems.iter().flat_map(|modem| ["--modem", text(modem)]));
        arguments.extend(places);
        let result = backseat(&arguments);
        (result["error"]["median_m"].as_f64().unwrap(), result["fused"]["range"].as_u64().unwrap_or(0))
    };
    let (without_m, none) = navigate(&[]);
    let (of_ship_m, uplinks) = navigate(&[&of_ship]);
    let (of_vehicle_m, downlinks) = navigate(&[&of_vehicle]);
    let (both_m, all) = navigate(&[&of_vehicle, &of_ship]);
    eprintln!(
        "without ranges {without_m:.2} m; {uplinks} of the ship's modem {of_ship_m:.2} m; {downlinks} of the vehicle's \
         {of_vehicle_m:.2} m; {all} of both {both_m:.2} m"
    );
    // a cycle of 30 s has one uplink and three downlinks
    assert!(none == 0 && (50..=60).contains(&uplinks) && (150..=180).contains(&downlinks), "{uplinks} {downlinks}");
    assert_eq!(all, uplinks + downlinks);
    assert!(of_ship_m < 2.0 && of_vehicle_m < 1.0 && both_m < 1.0, "{of_ship_m} {of_vehicle_m} {both_m}");
    assert!(without_m > 5.0 * of_ship_m, "{without_m} {of_ship_m}");
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}
