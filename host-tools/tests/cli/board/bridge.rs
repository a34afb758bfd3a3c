//! `backseat bridge`: what comes back.

use super::bench::Bench;
use super::check::checked;
use hil_sim::scenario::Scenario;
use serde_json::Value;
use std::cmp::Ordering;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread::scope;

/// A message of MOOS, from whom does not matter: its kind and that of its data, number or text.
fn message(kind: u8, data: u8, key: &str, number: f64, text: &str) -> Vec<u8> {
    let bytes = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    let strings = [bytes("pHelm"), bytes(""), bytes(""), bytes(key)].concat();
    let numbers = [0.0, number, 0.0].map(f64::to_le_bytes).concat();
    let body = [&[0xFF; 4], &[kind, data][..], &strings, &numbers, &bytes(text)].concat();
    [&(body.len() as u32 + 4).to_le_bytes()[..], &body].concat()
}

fn packet_of(messages: &[Vec<u8>]) -> Vec<u8> {
    let length = 9 + messages.iter().map(Vec::len).sum::<usize>();
    let head = [&(length as u32).to_le_bytes()[..], &(messages.len() as u32).to_le_bytes(), &[0]].concat();
    [head, messages.concat()].concat()
}

/// A packet of one message with a text, to a client.
fn packet(kind: u8, key: &str, text: &str) -> Vec<u8> {
    packet_of(&[message(kind, b'S', key, 0.0, text)])
}

/// What follows the length of a packet; none: the bridge has gone.
fn receive_bytes(socket: &mut TcpStream) -> Option<Vec<u8>> {
    let mut length = [0; 4];
    socket.read_exact(&mut length).ok()?;
    let mut rest = vec![0; u32::from_le_bytes(length) as usize - 4];
    socket.read_exact(&mut rest).ok()?;
    Some(rest)
}

fn receive(socket: &mut TcpStream) -> String {
    String::from_utf8_lossy(&receive_bytes(socket).expect("a packet")).into_owned()
}

/// Welcomes the bridge, and tells it what stood in the database before.
fn welcome(database: &TcpListener, before: &[u8]) -> TcpStream {
    let (mut socket, _) = database.accept().unwrap();
    socket.read_exact(&mut [0; 32]).unwrap();
    for answer in [&packet(b'W', "", "synchronous"), before] {
        receive(&mut socket);
        socket.write_all(answer).unwrap();
    }
    socket
}

/// A board with a key takes a mission from MOOS, its start and its stop, through a bridge that has the key, and nothing
/// through one that has none.
#[test]
#[ignore = "in real time: .ci/nightly"]
fn a_mission_comes_back_signed_by_the_bridge() {
    let bench = Bench::new();
    bench.write("ship.key", "000102030405060708090a0b0c0d0e0f\n");
    bench.good(&["params", "set", "PORT", "app.acoustic_key=@ship.key"]);
    let mission = "[[mission.waypoints]]\nx_m = 500.0\ny_m = 0.0\ndepth_m = 3.0\nspeed_mps = 1.0\n";
    let cases: [(&[&str], &[_]); 2] = [
        (&[], &[(mission, "refused: "), ("start", "refused: "), ("stop", "refused: ")]),
        (
            &["--key", "ship.key"],
            &[(mission, "stored: 1 waypoints"), ("start", "started"), ("[mission]", "refused: "), ("stop", "stopped")],
        ),
    ];
    for (key, asked) in cases {
        let database = TcpListener::bind("127.0.0.1:0").unwrap();
        let at = database.local_addr().unwrap().to_string();
        let arguments = [&["bridge", "PORT", "--moos", &at, "--accept", "--for", "20", "--json"], key].concat();
        let counts = scope(|scope| {
            let bridge = scope.spawn(|| bench.run(&arguments).json());
            let mut socket = welcome(&database, &packet(b'N', "BACKSEAT_MISSION", "start"));
            for (text, expected) in asked {
                receive(&mut socket);
                socket.write_all(&packet(b'N', "BACKSEAT_MISSION", text)).unwrap();
                loop {
                    let heard = receive(&mut socket);
                    if let Some((_, answer)) = heard.split_once("BACKSEAT_ANSWER") {
                        assert!(answer.contains(expected), "{text}: {answer}");
                        break;
                    }
                    socket.write_all(&packet(b'N', "", "")).unwrap();
                }
                socket.write_all(&packet(b'N', "", "")).unwrap();
            }
            bridge.join().unwrap()
        });
        assert_eq!(counts["sides"]["moos"]["refused"], 0, "{counts}");
    }
    assert_eq!(bench.json(&["mission", "get", "PORT"])["waypoints"].as_array().unwrap().len(), 1);
}

/// What the helm wants, degrees.
const COURSE_DEG: f64 = 330.0;

/// Plays a database whose helm wants this course, for so many packets, and then to stop, while the bridge lasts, for so
/// many seconds; the headings that it tells, degrees, and its answers.
fn helm(bench: &Bench, seconds: &str, packets: usize) -> (Vec<f64>, Vec<String>) {
    let database = TcpListener::bind("127.0.0.1:0").unwrap();
    let at = database.local_addr().unwrap().to_string();
    let arguments = ["bridge", "PORT", "--moos", &at, "--accept", "--for", seconds];
    let wants = |variable, value| message(b'N', b'D', variable, value, "");
    let wanted =
        packet_of(&[wants("DESIRED_HEADING", COURSE_DEG), wants("DESIRED_DEPTH", 2.0), wants("DESIRED_SPEED", 1.2)]);
    scope(|scope| {
        let bridge = scope.spawn(|| bench.run(&arguments).good("bridge"));
        let mut socket = welcome(&database, &wanted);
        let (mut headings_deg, mut answers) = (Vec::new(), Vec::new());
        let all_stop = packet_of(&[wants("DESIRED_SPEED", 0.0)]);
        let nothing = packet_of(&[]);
        let mut told = 0;
        while let Some(heard) = receive_bytes(&mut socket) {
            let place = |key: &[u8]| heard.windows(key.len()).position(|part| part == key).map(|at| at + key.len());
            if let Some(at) = place(b"NAV_HEADING") {
                headings_deg.push(f64::from_le_bytes(heard[at + 8..at + 16].try_into().unwrap()));
            }
            if let Some(at) = place(b"BACKSEAT_ANSWER") {
                answers.push(String::from_utf8_lossy(&heard[at..]).into_owned());
            }
            told += 1;
            let mail = match told.cmp(&packets) {
                Ordering::Less => &wanted,
                Ordering::Equal => &all_stop,
                Ordering::Greater => &nothing,
            };
            if socket.write_all(mail).is_err() {
                break;
            }
        }
        bridge.join().unwrap();
        (headings_deg, answers)
    })
}

/// Refused once where it may not, obeyed where it may; its all-stop ends the mission.
#[test]
#[ignore = "in real time: .ci/nightly"]
fn a_helm_steers_where_it_may() {
    let mut bench = Bench::new();
    let (headings_deg, answers) = helm(&bench, "5", usize::MAX);
    assert!(headings_deg.is_empty() && answers.len() == 1, "{answers:?}");
    assert!(answers[0].contains("refused: the board refused to be steered: its parameters"), "{answers:?}");

    let scenario = Scenario::built_in("survey").unwrap();
    let declination = format!("app.declination_rad={}", scenario.settings.environment.magnetic_declination_rad);
    bench.simulate(scenario);
    bench.write("m.toml", include_str!("../../../../hil-sim/scenarios/survey.toml"));
    bench.good(&["mission", "put", "PORT", "m.toml"]);
    // this computer has no PPS input, so no ranges
    bench.good(&["params", "set", "PORT", "app.use_range=0", "app.use_dvl=1", "app.helm=1", &declination]);
    checked(|| bench.run(&["check", "PORT", "--json"]), |report| report["passed"] == true);
    bench.good(&["mission", "start", "PORT"]);
    // the zero of a helm that has not steered stops nothing
    let (_, answers) = helm(&bench, "3", 1);
    assert!(answers.is_empty(), "{answers:?}");
    let (headings_deg, answers) = helm(&bench, "40", 300);
    let held = headings_deg.windows(20).any(|held| held.iter().all(|deg| (deg - COURSE_DEG).abs() < 4.0));
    assert!(held, "{answers:?} {headings_deg:.0?}");
    let [steers, ends @ ..] = &answers[..] else { panic!("no answer") };
    assert!(steers.contains("a host steers: 330° 2.0 m 1.20 m/s"), "{answers:?}");
    for end in ["stopped: the helm's speed is zero", "no host steers any more"] {
        assert!(ends.len() == 2 && ends.iter().any(|answer| answer.contains(end)), "{answers:?}");
    }
    let seen = bench.run(&["monitor", "PORT", "--json", "--for", "3"]).good("monitor");
    let board: Value = serde_json::from_str(seen.lines().last().unwrap()).unwrap();
    assert_eq!((&board["mode"], &board["leg"], &board["helm"]), (&"safe".into(), &Value::Null, &Value::Null));
}
