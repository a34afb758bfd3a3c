//! A session in which the board was reset: the replay starts again with it, from what the board found.

use super::sim::{backseat, replay, rewrite};
use backseat_link::Client;
use backseat_logs::output::Existing;
use backseat_logs::session::{Clock, Event, Meta, Writer};
use hil_sim::backseat::InProcess;
use hil_sim::flight;
use hil_sim::scenario::Scenario;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Flies the mission of the fault table with these resets, recorded; the digest in the end.
fn flown(path: &Path, faults: &str) -> String {
    let text = include_str!("../../../../hil-sim/scenarios/faults/none.toml");
    let (head, _) = text.split_once("[limits]").unwrap();
    let mut scenario = Scenario::with_built_in_vehicle(&format!("{head}{faults}"), "reset.toml").unwrap();
    scenario.settings.duration_s = 240.0;
    let mut client = Client::new(InProcess::new());
    client.record(Writer::create(path, &Meta::new("test", Clock::Board), Existing::Keep).unwrap()).unwrap();
    let flight = flight::fly(&scenario, &mut client, None, &AtomicBool::new(false), |_| ()).unwrap();
    client.end_record().unwrap();
    format!("{:016x}", flight.digest)
}

const RESETS: &str = "
[[fault]]
name = \"reset\"
cause = \"watchdog\"
from_s = 140

[[fault]]
name = \"flash_corrupted\"
copies = 2
from_s = 150

[[fault]]
name = \"reset\"
cause = \"brown_out\"
down_s = 3.0
from_s = 190
";

#[test]
fn a_session_with_resets_is_the_same_to_the_bit_and_what_it_lacks_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("reset.mcap");
    let digest = flown(&path, RESETS);
    let (code, said, stderr) = replay(&path, &[]);
    assert_eq!((code, &said["exact"], &said["digest"]), (0, &true.into(), &digest.into()), "{said}{stderr}");
    let steps = said["steps"].as_u64().unwrap();
    // the flight ends with the mission, which a reset ends
    assert!((1400..2400).contains(&steps), "all but the time without a board: {steps}");
    assert!(said["compared"]["messages"].as_u64().unwrap() > 4000, "{said}");
    // one time axis over all starts: all steps, and at most the 3 s without a board
    let (stepped_s, replayed_s) = (0.1 * steps as f64, said["simulated_s"].as_f64().unwrap());
    assert!((stepped_s - 1.0..stepped_s + 4.0).contains(&replayed_s), "{replayed_s} s, {stepped_s} s");

    // Its tables have one time axis, and the vehicle's log is navigated.
    let tables = folder.path().join("tables");
    let (code, _, stderr) = backseat(&["export", path.to_str().unwrap(), "--csv", tables.to_str().unwrap()]);
    assert_eq!(code, 0, "{stderr}");
    let log = backseat_logs::Log::read(&tables.join("vehicle_log.csv")).unwrap();
    assert!((stepped_s - 1.0..stepped_s + 4.0).contains(&log.duration_s()), "{} s, {stepped_s} s", log.duration_s());
    let log = tables.join("vehicle_log.csv");
    let (code, _, stderr) = backseat(&["navigate", log.to_str().unwrap(), "--no-dvl", "--json", "--force"]);
    assert!(matches!(code, 0 | 3), "{stderr}");

    // Without the starts, as sessions were written before: the first difference has time and record.
    let lacking = folder.path().join("lacking.mcap");
    rewrite(&path, &lacking, Clock::Board, |entry| (!matches!(entry.event, Event::Start { .. })).then_some(entry));
    let (code, said, _) = replay(&lacking, &[]);
    assert_eq!((code, &said["exact"]), (1, &false.into()), "{said}");

    // With another restart record than the board had, position and mission differ from the first step on.
    let other = folder.path().join("other.mcap");
    rewrite(&path, &other, Clock::Board, |mut entry| {
        if let Event::Start { record, .. } = &mut entry.event {
            record.clear();
        }
        Some(entry)
    });
    let (code, said, _) = replay(&other, &[]);
    assert_eq!((code, &said["exact"]), (1, &false.into()), "{said}");
}
