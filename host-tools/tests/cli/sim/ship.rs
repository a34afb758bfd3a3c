//! Topside as a process on three pseudo-terminals, in lock-step: the bytes of the library, and a death that is told.

use crate::harness::{command, program, signal};
use backseat_link::{Arrival, Client};
use backseat_topside::{Port, Topside};
use backseat_wire::ship_state::Key;
use hil_sim::backseat::InProcess;
use hil_sim::flight::{FlightError, FlightLog, fly_with_ship};
use hil_sim::scenario::Scenario;
use hil_sim::ship_end::{self, Known, OnPorts, Program, ProgramClock, ProgramError, ShipEnd};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{Sender, channel};

/// Tells what a program sends to its modem, and when.
struct Told<P> {
    program: P,
    given_us: u64,
    sent: Sender<(u64, Vec<u8>)>,
}

impl<P: Program> Program for Told<P> {
    fn give(&mut self, now_us: u64, arrivals: &[(Port, Arrival)], step: bool) -> Result<(), ProgramError> {
        self.given_us = now_us;
        self.program.give(now_us, arrivals, step)
    }

    fn take(&mut self) -> Result<Vec<u8>, ProgramError> {
        let sent = self.program.take()?;
        if !sent.is_empty() {
            self.sent.send((self.given_us, sent.clone())).unwrap();
        }
        Ok(sent)
    }

    fn knows(&self, utc_us: u64, vehicle: u8) -> Option<Known> {
        self.program.knows(utc_us, vehicle)
    }
}

fn sea_trial(minutes: f64) -> Scenario {
    let mut scenario = Scenario::built_in("sea_trial").unwrap();
    scenario.settings.duration_s = 60.0 * minutes;
    scenario.settings.acoustics.key = Key::new([7; 16]);
    scenario
}

/// The configuration that `sim run` writes for the scenario, with these ports.
fn configuration(folder: &Path, [gnss, modem]: [&str; 2]) -> String {
    let out = folder.join("written");
    program(folder, ["sim", "run", "sea_trial", "--minutes", "0.02", "--json", "--out", "written"]).json();
    let text = std::fs::read_to_string(out.join("topside.toml")).unwrap();
    assert!(!text.contains("key"), "the key stands in no file: {text}");
    let lines = text.lines().map(|line| match line.split(' ').next() {
        Some("gnss") => format!("gnss = \"{gnss}:19200\"\n"),
        Some("modem") => format!("modem = \"{modem}:19200\"\n"),
        _ => format!("{line}\n"),
    });
    lines.collect()
}

fn process(scenario: &Scenario, folder: &Path) -> OnPorts {
    let file = folder.join("topside.toml");
    let start = |paths: &[&str]| {
        std::fs::write(&file, configuration(folder, [paths[0], paths[1]]))?;
        let mut command = command(folder);
        command.arg("__topside").arg(&file).arg(paths[2]);
        Ok(command)
    };
    let key = scenario.settings.acoustics.key;
    OnPorts::start(ProgramClock::Lockstep, key, &folder.join("topside.jsonl"), start).unwrap()
}

/// The flight, and what was sent to the ship's modem.
fn fly(scenario: &Scenario, program: impl Program + 'static) -> (FlightLog, Vec<(u64, Vec<u8>)>) {
    let (sent, told) = channel();
    let mut ship = ShipEnd::new(scenario, Box::new(Told { program, given_us: 0, sent }));
    let mut client = Client::new(InProcess::new());
    let flight = fly_with_ship(scenario, &mut client, Some(&mut ship), None, &AtomicBool::new(false), |_| {}).unwrap();
    (flight, told.try_iter().collect())
}

#[test]
fn a_process_on_the_ship_sends_the_bytes_of_the_library() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = sea_trial(6.0);
    let library = Topside::new(ship_end::config(&scenario).unwrap()).unwrap();
    let (by_library, sent_by_library) = fly(&scenario, ship_end::InProcess::new(library));
    let (by_process, sent_by_process) = fly(&scenario, process(&scenario, folder.path()));
    let bytes: usize = sent_by_library.iter().map(|(_, bytes)| bytes.len()).sum();
    // settings, and three downlinks in each of eleven cycles
    assert!(bytes > 3000, "{bytes}");
    assert!(sent_by_process == sent_by_library, "{bytes} bytes of the library");
    assert_eq!(by_process.digest, by_library.digest);
    // What it prints is a millisecond old at most: its clock is set by sentences.
    assert_eq!(by_process.ship_side.len(), by_library.ship_side.len());
    let mut tracked = 0;
    for (one, other) in by_process.ship_side.iter().zip(&by_library.ship_side) {
        for (one, other) in [(one.ship, other.ship), (one.vehicle, other.vehicle)] {
            assert_eq!(one.is_some(), other.is_some());
            let (Some([one_m, _]), Some([other_m, _])) = (one, other) else { continue };
            assert!((one_m - other_m).abs() < 0.02, "{one_m} {other_m}");
            tracked += 1;
        }
    }
    assert!(tracked > 600, "{tracked}");
}

/// Kills topside at a time.
struct Killed {
    program: OnPorts,
    at_us: u64,
}

impl Program for Killed {
    fn give(&mut self, now_us: u64, arrivals: &[(Port, Arrival)], step: bool) -> Result<(), ProgramError> {
        if now_us >= self.at_us {
            self.at_us = u64::MAX;
            signal("KILL", self.program.pid());
        }
        self.program.give(now_us, arrivals, step)
    }

    fn take(&mut self) -> Result<Vec<u8>, ProgramError> {
        self.program.take()
    }
}

#[test]
fn a_topside_that_dies_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = sea_trial(5.0);
    let program = Killed { program: process(&scenario, folder.path()), at_us: 20_000_000 };
    let mut ship = ShipEnd::new(&scenario, Box::new(program));
    let mut client = Client::new(InProcess::new());
    let flown = fly_with_ship(&scenario, &mut client, Some(&mut ship), None, &AtomicBool::new(false), |_| {});
    let error = flown.unwrap_err();
    assert!(matches!(error, FlightError::Ship(ProgramError::Ended(_))), "{error}");
    assert!(error.to_string().starts_with("topside's process ended (signal: 9"), "{error}");
}
