//! `backseat bridge`: what comes back.

use super::bench::Bench;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread::scope;

/// A packet of one message of MOOS: to a client, from whom does not matter.
fn packet(kind: u8, key: &str, text: &str) -> Vec<u8> {
    let bytes = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    let strings = [bytes("pHelm"), bytes(""), bytes(""), bytes(key)].concat();
    let body = [&[0xFF; 4], &[kind, b'S'][..], &strings, &[0; 24], &bytes(text)].concat();
    let message = [&(body.len() as u32 + 4).to_le_bytes()[..], &body].concat();
    [&(message.len() as u32 + 9).to_le_bytes()[..], &[1, 0, 0, 0, 0], &message].concat()
}

fn receive(socket: &mut TcpStream) -> String {
    let mut length = [0; 4];
    socket.read_exact(&mut length).unwrap();
    let mut rest = vec![0; u32::from_le_bytes(length) as usize - 4];
    socket.read_exact(&mut rest).unwrap();
    String::from_utf8_lossy(&rest).into_owned()
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
            let (mut socket, _) = database.accept().unwrap();
            socket.read_exact(&mut [0; 32]).unwrap();
            for answer in [packet(b'W', "", "synchronous"), packet(b'N', "BACKSEAT_MISSION", "start")] {
                receive(&mut socket);
                socket.write_all(&answer).unwrap();
            }
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
