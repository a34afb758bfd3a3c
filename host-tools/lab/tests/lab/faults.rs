//! Faults by scenario file, and the fault table.
//!
//! The quick rows fly as they stand in `docs/results/fault_table.md`, one seed each; `cargo lab faults` flies all of
//! them.

use backseat_lab::fault_table::{Judge, JudgedFlight, Row, Summary, fly, markdown, rows};
use backseat_link::Client;
use hil_sim::backseat::InProcess;
use hil_sim::flight;
use hil_sim::scenario::{Scenario, Settings};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// A row of every place where faults act.
const QUICK: [&str; 8] = [
    "bit_flipped_frontseat",
    "silent_ahrs_60s",
    "babbling_dvl",
    "ahrs_nan",
    "gnss_jump_20s",
    "packet_duplicated",
    "frontseat_refuses",
    "reset_watchdog",
];

fn row(name: &str) -> Row {
    rows().unwrap().into_iter().find(|row| row.name == name).unwrap()
}

fn fly_all(rows: &[Row]) -> Vec<(String, JudgedFlight)> {
    std::thread::scope(|scope| {
        let flights: Vec<_> = rows.iter().map(|row| (row.name.clone(), scope.spawn(move || fly(row, 1)))).collect();
        flights.into_iter().map(|(name, flight)| (name, flight.join().unwrap())).collect()
    })
}

#[test]
fn every_row_is_read_and_says_why_its_limits() {
    let rows = rows().unwrap();
    assert!(rows.len() > 70, "{} rows", rows.len());
    for row in &rows {
        assert_eq!(row.scenario.settings.name, row.name, "named as its file");
        assert!(row.limits.why.len() > 20, "{}", row.name);
        let settings = &row.scenario.settings;
        let undisturbed = settings.faults.is_empty()
            && settings.effects.as_slice().is_empty()
            && settings.backseat.wrong_share == 0.0;
        assert_eq!(row.name.starts_with("none"), undisturbed, "{}", row.name);
        // the same file, read from disk with the vehicle that it names
        let path =
            Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../hil-sim/scenarios/faults/{}.toml", row.name));
        assert_eq!(Scenario::load(&path).unwrap().settings, row.scenario.settings);
    }
}

#[test]
fn quick_rows_keep_their_limits() {
    for (name, outcome) in fly_all(&QUICK.map(row)) {
        assert!(outcome.violations.is_empty(), "{name}: {outcome:?}");
    }
}

#[test]
fn a_row_is_the_same_when_flown_again_and_another_with_another_seed() {
    let row = row("bit_flipped_frontseat");
    let [first, again, other] = [1, 1, 2].map(|seed| fly(&row, seed));
    assert_eq!(first, again);
    assert_ne!(first.digest, other.digest);
}

/// What the table calls a pass can fail: the same flight against limits that it cannot keep.
#[test]
fn a_row_fails_when_its_limits_are_broken() {
    let mut row = row("frontseat_refuses");
    row.limits.error_m = 0.01;
    row.limits.mission = hil_sim::scenario::End::Flown;
    row.limits.reasons = vec!["depth_stale".to_owned()];
    let outcome = fly(&row, 1);
    assert_eq!(outcome.violations.len(), 3, "{:?}", outcome.violations);
    let text = markdown(&[Summary { row, outcomes: vec![outcome] }], "this test");
    assert!(text.contains("0 of 1 rows pass") && text.contains("**FAIL**"), "{text}");
}

/// The judge is fed by hand: an estimate that is off and calls itself healthy.
#[test]
fn an_error_beyond_three_sigmas_in_good_health_is_a_violation() {
    let row = row("none");
    let mut scenario = row.scenario.clone();
    scenario.settings.duration_s = 300.0;
    let mut judge = Judge::new(&scenario);
    let mut client = Client::new(InProcess::new());
    let flight = flight::fly_watched(&scenario, &mut client, None, &AtomicBool::new(false), |step| {
        let mut telemetry = step.telemetry.cloned();
        if let Some(telemetry) = telemetry.as_mut().filter(|_| step.time_us > 150_000_000) {
            telemetry.state[0] += 100.0;
        }
        judge.watch(&flight::Watched { telemetry: telemetry.as_ref(), ..step });
    })
    .unwrap();
    let outcome = judge.finish(1, &flight, &[], &row.limits);
    let violations = outcome.violations.join("; ");
    assert!(violations.contains("beyond 3 sigmas for 150 s of 600 s, silently"), "{violations}");
}

#[test]
fn wrong_faults_are_refused_with_file_line_and_key() {
    let text = include_str!("../../../../hil-sim/scenarios/faults/lost_ahrs.toml");
    let line = text.lines().position(|line| line == "[[fault]]").unwrap() + 1;
    for (from, to, offset, expected) in [
        ("name = \"lost\"", "name = \"gremlin\"", 1, "unknown variant `gremlin`"),
        ("port = \"ahrs\"", "port = \"sonar\"", 2, "unknown variant `sonar`"),
        ("share = 0.3", "share = 1.3", 3, "share: 1.3 is outside 0 to 1"),
        ("share = 0.3", "part = 0.3", 3, "unknown field `part`"),
        ("share = 0.3\n", "\n", 0, "fault lost: share is missing"),
        ("share = 0.3", "share = 0.3\ncopies = 1", 0, "fault lost: has no copies"),
        ("until_s = 500", "until_s = 100", 0, "fault lost: until_s is not after from_s"),
        ("until_s = 500", "until_s = nan", 5, "until_s: NaN is outside"),
    ] {
        assert!(text.contains(from));
        let error = Settings::parse(&text.replacen(from, to, 1), Path::new("s.toml")).unwrap_err().to_string();
        assert!(error.contains(expected) && !error.contains('\n'), "{error}");
        assert!(error.starts_with(&format!("s.toml:{}:", line + offset)), "{error}, wanted line {}", line + offset);
    }
}
