//! A second program at the host port of a vehicle under way: what it did to a board without a key, and tries with one.

use backseat_link::{BackseatError, Client, Ports};
use backseat_wire::hostlink::{Decoder, MAX_FRAME, ModeReason, Port, Step, ToBoard, Waypoint, encode};
use backseat_wire::ship_state::Key;
use hil_sim::backseat::InProcess;
use hil_sim::flight::{FlightLog, fly};
use hil_sim::scenario::Scenario;
use std::sync::atomic::AtomicBool;

const KEY: Key = Key::new([0x5A; 16]);
/// Steps before it begins: the vehicle is on its first leg by then.
const BEGINS: usize = 1_200;

/// What it sends in one step, of all that the operator has sent until then.
type Attack = fn(step: usize, heard: &[Vec<u8>]) -> Vec<Vec<u8>>;

/// The board's ports, with the second program on the same line.
struct Shared {
    board: InProcess,
    attack: Attack,
    steps: usize,
    heard: Vec<Vec<u8>>,
    /// What the board has answered it, which the simulator hears as well.
    answered: Vec<u8>,
}

impl Ports for Shared {
    fn write(&mut self, port: Port, bytes: &[u8]) -> Result<(), BackseatError> {
        if port == Port::Host {
            let is_step = is_step(bytes);
            self.steps += usize::from(is_step);
            if is_step && self.steps > BEGINS {
                let said = (self.attack)(self.steps - BEGINS, &self.heard);
                said.iter().try_for_each(|frame| self.board.write(port, frame))?;
                self.board.poll(port, &mut self.answered)?;
            }
            self.heard.push(bytes.to_vec());
        }
        self.board.write(port, bytes)
    }

    fn read(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        self.hear(port, received);
        if received.is_empty() { self.board.read(port, received) } else { self.board.poll(port, received) }
    }

    fn poll(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        self.hear(port, received);
        self.board.poll(port, received)
    }
}

impl Shared {
    fn hear(&mut self, port: Port, received: &mut Vec<u8>) {
        if port == Port::Host {
            received.append(&mut self.answered);
        }
    }
}

fn is_step(mut frame: &[u8]) -> bool {
    let mut decoder = Decoder::new();
    let Some(Ok(frame)) = decoder.feed(&mut frame) else { return false };
    matches!(frame.message::<ToBoard<'_>>().and_then(ToBoard::unsigned), Ok(ToBoard::Step(_)))
}

fn frames(messages: &[ToBoard<'_>]) -> Vec<Vec<u8>> {
    messages.iter().map(|message| encode(message, &mut [0; MAX_FRAME]).unwrap().to_vec()).collect()
}

fn set(name: &str, value: f64) -> Vec<Vec<u8>> {
    let set = ToBoard::ParameterSet { name, value };
    frames(&[ToBoard::Unlock, ToBoard::ParameterBegin, set, ToBoard::ParameterCommit])
}

fn nothing(_: usize, _: &[Vec<u8>]) -> Vec<Vec<u8>> {
    Vec::new()
}

/// A centimetre a second faster each step: no jump for a gate, and ranges that are wrong.
fn ramps_the_sound_speed(step: usize, _: &[Vec<u8>]) -> Vec<Vec<u8>> {
    set("installation.sound_speed_mps", (1_500.0 + 0.01 * step as f64).min(1_600.0))
}

/// Limits may become stricter under way: too strict.
fn narrows_a_limit(step: usize, _: &[Vec<u8>]) -> Vec<Vec<u8>> {
    if step == 10 { set("safety.depth_max_m", 2.0) } else { Vec::new() }
}

fn stops(step: usize, _: &[Vec<u8>]) -> Vec<Vec<u8>> {
    if step == 10 { frames(&[ToBoard::MissionStop]) } else { Vec::new() }
}

/// Stops it, puts a mission of its own and starts that.
fn flies_elsewhere(step: usize, _: &[Vec<u8>]) -> Vec<Vec<u8>> {
    let waypoint = Waypoint { x_m: -200.0, y_m: 300.0, depth_m: 0.0, speed_mps: 1.0 };
    let item = ToBoard::MissionItem { index: 0, waypoint };
    match step {
        10 => frames(&[ToBoard::MissionStop]),
        60 => frames(&[ToBoard::MissionBegin { count: 1 }, item, ToBoard::MissionCommit, ToBoard::MissionStart]),
        _ => Vec::new(),
    }
}

/// Moves the clock that the board takes its time from.
fn sets_the_clock(step: usize, _: &[Vec<u8>]) -> Vec<Vec<u8>> {
    let time_us = (BEGINS + step + 300) as u64 * 100_000;
    let ahead = Step { time_us, pps_us: Default::default(), chunks: Default::default(), fittings: Default::default() };
    if step == 10 { frames(&[ToBoard::Step(ahead)]) } else { Vec::new() }
}

/// Has what the operator said once more: parameters, mission, start, steps, as they were signed.
fn replays(step: usize, heard: &[Vec<u8>]) -> Vec<Vec<u8>> {
    if step.is_multiple_of(10) { heard[heard.len() % 37..].iter().step_by(37).cloned().collect() } else { Vec::new() }
}

fn flight(key: Key, attack: Attack) -> Result<(FlightLog, u32), BackseatError> {
    let mut scenario = Scenario::built_in("survey").unwrap();
    scenario.settings.seed = 3;
    scenario.settings.duration_s = 300.0;
    scenario.settings.acoustics.key = key;
    let ports = Shared { board: InProcess::new(), attack, steps: 0, heard: Vec::new(), answered: Vec::new() };
    let mut client = Client::new(ports);
    let flight = match fly(&scenario, &mut client, None, &AtomicBool::new(false), |_| {}) {
        Ok(flight) => flight,
        Err(hil_sim::flight::FlightError::Backseat(error)) => return Err(error),
        Err(error) => panic!("{error}"),
    };
    let refused = client.ports().board.health().refused_requests();
    Ok((flight, refused))
}

/// The truth and the board's state at the end of each second.
fn path(flight: &FlightLog) -> Vec<([f64; 12], [f64; 12])> {
    flight.samples.iter().map(|sample| (sample.truth.state, sample.telemetry.state)).collect()
}

const ATTACKS: [(&str, Attack); 6] = [
    ("ramps the sound speed", ramps_the_sound_speed),
    ("narrows a limit", narrows_a_limit),
    ("stops", stops),
    ("flies elsewhere", flies_elsewhere),
    ("sets the clock", sets_the_clock),
    ("replays", replays),
];

#[test]
fn without_a_key_a_hostile_host_has_the_vehicle() {
    let (honest, _) = flight(Key::NONE, nothing).unwrap();
    for (what, attack) in ATTACKS {
        match flight(Key::NONE, attack) {
            Ok((attacked, refused)) => {
                assert_ne!(attacked.digest, honest.digest, "{what}");
                assert_eq!(refused, 0, "{what}");
            }
            // the simulator has lost its board to it
            Err(error) => println!("{what}: {error}"),
        }
    }
    let (stopped, _) = flight(Key::NONE, narrows_a_limit).unwrap();
    assert!(stopped.modes.iter().any(|change| change.reason == ModeReason::TooDeep), "{:?}", stopped.modes);
}

#[test]
fn with_a_key_it_changes_nothing() {
    let (honest, refused) = flight(KEY, nothing).unwrap();
    assert_eq!(refused, 0);
    for (what, attack) in ATTACKS {
        let (attacked, refused) = flight(KEY, attack).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert_eq!(attacked.digest, honest.digest, "{what}");
        assert!(path(&attacked) == path(&honest), "{what}");
        assert!(refused > 0, "{what}");
    }
}
