//! Whole flights, end to end: the backseat as a process on virtual serial ports.

use crate::harness::{Outcome, PROGRAM, command, program, signal, text, wait_for};
use backseat_link::Pty;
use backseat_link::{BackseatError, Client, Process, Serial};
use backseat_logs::{Column, Log};
use hil_sim::backseat::InProcess;
use hil_sim::flight::{FlightError, FlightLog, Start, fly, fly_realtime};
use hil_sim::scenario::Scenario;
use std::path::Path;
use std::process::Stdio;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

fn survey(seed: u64, minutes: f64) -> Scenario {
    let mut scenario = Scenario::built_in("survey").unwrap();
    scenario.settings.seed = seed;
    scenario.settings.duration_s = 60.0 * minutes;
    scenario
}

fn on_pseudo_terminals(scenario: &Scenario, folder: Option<&Path>) -> FlightLog {
    let mut client = Client::new(Process::spawn(Path::new(PROGRAM)).unwrap());
    fly(scenario, &mut client, folder, &AtomicBool::new(false), |_| {}).unwrap()
}

fn backseat(arguments: &[&str]) -> Outcome {
    program(Path::new("."), arguments)
}

/// The one line of a failure, and its exit code.
fn complaint(outcome: &Outcome) -> (String, Option<i32>) {
    let text = &outcome.stderr;
    let lines: Vec<&str> = text.lines().filter(|line| line.starts_with("error")).collect();
    assert_eq!(lines.len(), 1, "{text}");
    (lines[0].to_owned(), outcome.code)
}

#[test]
fn one_seed_gives_the_same_bytes_each_time_and_in_process() {
    let scenario = survey(7, 4.0);
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let digests = folders.each_ref().map(|folder| on_pseudo_terminals(&scenario, Some(folder.path())).digest);
    assert_eq!(digests[0], digests[1]);
    for file in ["log.csv", "truth.csv"] {
        let bytes = folders.each_ref().map(|folder| std::fs::read(folder.path().join(file)).unwrap());
        assert!(bytes[0].len() > 10_000 && bytes[0] == bytes[1], "{file}");
    }
    // No operating system in between: the same app, the same bytes.
    let mut client = Client::new(InProcess::new());
    let flight = fly(&scenario, &mut client, None, &AtomicBool::new(false), |_| {}).unwrap();
    assert_eq!(flight.digest, digests[0]);
    // Another seed is another flight.
    assert_ne!(on_pseudo_terminals(&survey(8, 4.0), None).digest, digests[0]);
}

#[test]
fn a_mission_is_flown_to_its_end_within_metres() {
    let text = include_str!("short_mission.toml");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("short.toml");
    std::fs::write(&path, text).unwrap();
    std::fs::write(folder.path().join("iver3.toml"), include_str!("../../../../hil-sim/scenarios/iver3.toml")).unwrap();
    let scenario = Scenario::load(&path).unwrap();
    let flight = on_pseudo_terminals(&scenario, None);
    assert!(flight.finished);
    let analysis = backseat_analysis::flight_score::analyse(&scenario, &flight).unwrap();
    // Ten minutes after the last fix of 1.5 m, with a range of 1 m every 30 s; a filter that is lost is off by tens of
    // metres.
    let backseat = &analysis.configurations[0].error;
    assert!(backseat.median_m < 1.5 && backseat.p95_m < 4.0, "{backseat:?}");
    let track = analysis.track.unwrap();
    assert!(track.cross_track.p95_m < 4.0 && track.depth.p95_m < 0.2, "{track:?}");
}

#[test]
#[ignore = "in real time: .ci/nightly"]
fn at_the_speed_of_the_clock() {
    let scenario = survey(1, 0.4);
    let mut client = Client::new(Process::spawn(Path::new(PROGRAM)).unwrap());
    let begun = Instant::now();
    let flight =
        fly_realtime(&scenario, &mut client, Start::AtOnce, None, None, &AtomicBool::new(false), |_| {}).unwrap();
    assert!(begun.elapsed() >= Duration::from_secs(24), "not sooner");
    let last = flight.samples.last().unwrap();
    // Under way: it navigates, and the propeller turns.
    assert!(last.telemetry.sigma[0] > 0.0 && last.truth.actuators.propeller_radps > 50.0, "{last:?}");
}

/// Two pseudo-terminals as one cable: what one end sends comes out of the other.
fn cable(unplugged: &Arc<AtomicBool>) -> [String; 2] {
    let unplugged = Arc::clone(unplugged);
    let ends = [Pty::open().unwrap(), Pty::open().unwrap()];
    let paths = ends.each_ref().map(|end| end.path().to_owned());
    std::thread::spawn(move || {
        while !unplugged.load(Ordering::Relaxed) {
            for (from, to) in [(0, 1), (1, 0)] {
                let mut buffer = [0; 4096];
                let count = ends[from].read(&mut buffer, 1).unwrap_or(0);
                let _ = ends[to].write_all(&buffer[..count]);
            }
        }
    });
    paths
}

#[test]
fn a_board_on_five_serial_ports_flies_the_same_bytes() {
    let unplugged = Arc::new(AtomicBool::new(false));
    let cables: Vec<[String; 2]> = (0..5).map(|_| cable(&unplugged)).collect();
    let board: Vec<&str> = cables.iter().map(|ends| ends[0].as_str()).collect();
    let mut child = command(Path::new(".")).arg("__backseat").args(board).spawn().unwrap();
    let ours: Vec<&str> = cables.iter().map(|ends| ends[1].as_str()).collect();
    let scenario = survey(7, 0.5);
    let mut client = Client::new(Serial::open(&ours.join(",")).unwrap());
    let flight = fly(&scenario, &mut client, None, &AtomicBool::new(false), |_| {});
    child.kill().unwrap();
    child.wait().unwrap();
    unplugged.store(true, Ordering::Relaxed);
    assert_eq!(flight.unwrap().digest, on_pseudo_terminals(&scenario, None).digest);
}

#[test]
fn a_backseat_that_dies_is_told() {
    let mut client = Client::new(Process::spawn(Path::new(PROGRAM)).unwrap());
    let pid = client.ports().pid();
    let mut seconds = 0;
    let outcome = fly(&survey(1, 60.0), &mut client, None, &AtomicBool::new(false), |_| {
        seconds += 1;
        if seconds == 20 {
            signal("KILL", pid);
        }
    });
    let error = outcome.unwrap_err();
    assert!(matches!(error, FlightError::Backseat(BackseatError::Died(_) | BackseatError::Port { .. })), "{error}");
}

#[test]
fn an_interrupted_flight_leaves_a_readable_log() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("flight");
    let mut child = command(folder.path())
        .args(["sim", "run", "--realtime", "--out", "flight"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let duration_s = || Log::read(&out.join("log.csv")).map(|log| log.duration_s());
    wait_for("a second of the flight", || {
        assert_eq!(child.try_wait().unwrap(), None, "it goes on");
        match duration_s() {
            Ok(seconds) if seconds > 1.0 => Ok(()),
            other => Err(format!("{other:?}")),
        }
    });
    signal("INT", child.id());
    let status = child.wait().unwrap();
    assert_eq!(status.code(), Some(1));
    assert!(duration_s().unwrap() > 1.0);
}

/// The ports stay open until whoever stopped the mission has heard it; the flight ends unfinished, not given up.
#[test]
#[ignore = "in real time: .ci/nightly"]
fn a_mission_that_is_stopped_is_said_to_be() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut child = command(at)
        .args(["sim", "run", "--realtime", "--monitor", "--topside", "off", "--out", "flight"])
        .stdout(Stdio::piped())
        .stderr(std::fs::File::create(at.join("aside")).unwrap())
        .spawn()
        .unwrap();
    wait_for("way on", || {
        assert_eq!(child.try_wait().unwrap(), None, "it goes on");
        match Log::read(&at.join("flight/log.csv")) {
            Ok(log) if log.column(Column::PropRpm).filter(|(_, rpm)| *rpm > 0.0).count() > 20 => Ok(()), // two seconds
            other => Err(format!("{:?}", other.map(|log| log.duration_s()))),
        }
    });
    let aside = std::fs::read_to_string(at.join("aside")).unwrap();
    let (_, rest) = aside.split_once("mission start ").unwrap();
    let stopped = program(at, ["mission", "stop", rest.split_once(',').unwrap().0]).good("mission stop");
    assert!(stopped.starts_with("stopped: ") && stopped.contains("Stopped)"), "{stopped}");
    // its exit code is that of a computer too busy for real time, if this one is
    let printed = text(&child.wait_with_output().unwrap().stdout);
    assert!(printed.contains("mission not finished: ") && !printed.contains("GIVEN UP"), "{printed}");
}

#[test]
fn bad_input_ends_in_one_clear_line() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let good = include_str!("../../../../hil-sim/scenarios/survey.toml");
    std::fs::write(folder.path().join("iver3.toml"), include_str!("../../../../hil-sim/scenarios/iver3.toml")).unwrap();

    let unknown = file("unknown.toml", &good.replace("spacing_m", "spacing_ft"));
    let (line, code) = complaint(&backseat(&["sim", "run", &unknown]));
    assert!(line.contains("unknown.toml:") && line.contains("spacing_ft") && code == Some(1), "{line}");

    let range = file("range.toml", &good.replace("sound_speed_mps = 1500.0", "sound_speed_mps = 15.0"));
    let (line, code) = complaint(&backseat(&["sim", "run", &range]));
    assert!(line.contains("range.toml:") && line.contains("sound_speed_mps") && code == Some(1), "{line}");

    let leaving = file("leaving.toml", &good.replace("name = \"survey\"", "name = \"../../survey\""));
    let (line, code) = complaint(&backseat(&["sim", "run", &leaving]));
    assert!(line.contains("leaving.toml:") && line.contains("a folder is called by it") && code == Some(1), "{line}");

    let (line, code) = complaint(&backseat(&["sim", "run", "nowhere.toml"]));
    assert!(line.contains("nowhere.toml") && code == Some(1), "{line}");

    let vehicle = file("vehicle.toml", &good.replace("iver3.toml", "no_vehicle.toml"));
    let (line, code) = complaint(&backseat(&["sim", "run", &vehicle]));
    assert!(line.contains("no_vehicle.toml") && code == Some(1), "{line}");

    let (line, code) =
        complaint(&backseat(&["__backseat", "/dev/null", "/dev/null", "/dev/null", "/dev/null", "/dev/null"]));
    assert!(line.contains("/dev/null") && code == Some(1), "{line}");

    let (line, code) = complaint(&backseat(&["sim", "run", "--minutes", "-3"]));
    assert!(line.contains("minutes -3: expected a positive number") && code.is_some_and(|code| code > 0), "{line}");

    // Wrong usage is refused by the parser of the command line.
    assert_eq!(backseat(&["sim", "run", "--no-such-flag"]).code, Some(2));
}
