//! The session log of a flight: the same bytes each time, and all that it takes to do it again.

use crate::harness::program;
use backseat_app::App;
use backseat_logs::session::{Clock, Damage, Event, Reader};
use backseat_wire::hostlink::{Decoder, FromBoard, Port, ToBoard};
use std::path::Path;

fn fly(folder: &Path, arguments: &[&str]) {
    program(folder, [&["sim", "run", "--seed", "5", "--out", "."], arguments].concat()).good("sim run");
}

fn take(app: &mut App, port: Port) -> Vec<u8> {
    let mut bytes = Vec::new();
    while !app.transmit(port).is_empty() {
        bytes.extend_from_slice(app.transmit(port));
        let count = app.transmit(port).len();
        app.transmitted(port, count);
    }
    bytes
}

/// The messages of a stream but the answers to the lock-step clock, which the pump gives.
fn messages(mut bytes: &[u8]) -> Vec<String> {
    let (mut decoder, mut found) = (Decoder::new(), Vec::new());
    while let Some(frame) = decoder.feed(&mut bytes) {
        let frame = frame.unwrap();
        match frame.message().unwrap() {
            FromBoard::StepDone(_) => {}
            message => found.push(format!("{message:?}")),
        }
    }
    found
}

#[test]
fn a_flight_is_flown_again_from_its_session() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let paths = folders.each_ref().map(|folder| folder.path().join("session.mcap"));
    for folder in &folders {
        fly(folder.path(), &["--minutes", "3"]);
    }
    let bytes = paths.each_ref().map(|path| std::fs::read(path).unwrap());
    assert!(bytes[0].len() > 100_000 && bytes[0] == bytes[1], "{} bytes, {}", bytes[0].len(), bytes[1].len());

    let mut session = Reader::open(&paths[0]).unwrap();
    assert_eq!(session.meta().clock, Clock::Board);
    assert_eq!((session.meta().facts["seed"].as_str(), session.meta().facts["scenario"].as_str()), ("5", "survey"));
    assert!(session.attachments().iter().any(|file| file.name == "vehicle.toml" && file.bytes.len() > 1000));
    let mut app = Box::new(App::new());
    let (mut sent, mut logged) = ([const { Vec::new() }; 5], [const { Vec::new() }; 5]);
    let (mut steps, mut moved) = (0, false);
    for entry in &mut session {
        let entry = entry.unwrap();
        match entry.event {
            Event::Parameters(values) => assert_eq!(values.len(), backseat_app::parameters::PARAMETERS.len()),
            Event::Received { port, bytes } => app.receive(port, entry.time_us, &bytes),
            Event::Edge => app.pps(entry.time_us),
            Event::Restart => app.restart(),
            Event::Step { digest } => {
                app.step(entry.time_us);
                assert_eq!(app.digest(), digest, "{} µs", entry.time_us);
                steps += 1;
                moved |= digest != 0;
            }
            Event::Sent { port, bytes } => logged[port as usize].extend_from_slice(&bytes),
            event => panic!("{event:?}"),
        }
        for port in Port::ALL {
            sent[port as usize].extend(take(&mut app, port));
        }
    }
    assert_eq!(session.damage(), Damage::default());
    assert_eq!(steps, 1801, "one at time zero, ten a second");
    assert!(moved && app.digest() != 0);
    for port in Port::DEVICES {
        assert!(sent[port as usize] == logged[port as usize], "{port:?}");
    }
    let (sent, logged) = (messages(&sent[4]), messages(&logged[4]));
    assert!(sent.len() > 3000 && sent == logged, "{} {}", sent.len(), logged.len());
}

#[test]
#[ignore = "in real time: .ci/nightly"]
fn at_the_speed_of_the_clock_the_bytes_are_there_without_steps() {
    let folder = tempfile::tempdir().unwrap();
    fly(folder.path(), &["--minutes", "0.05", "--realtime"]);
    let session = Reader::open(&folder.path().join("session.mcap")).unwrap();
    assert_eq!(session.meta().clock, Clock::Host);
    let entries: Vec<_> = session.map(Result::unwrap).collect();
    let bytes_to = |wanted| {
        entries.iter().filter(|entry| matches!(entry.event, Event::Received { port, .. } if port == wanted)).count()
    };
    assert!(Port::ALL.iter().all(|port| bytes_to(*port) > 0), "{:?}", Port::ALL.map(bytes_to));
    assert!(entries.iter().all(|entry| !matches!(entry.event, Event::Step { .. } | Event::Edge)));
    let started = entries.iter().any(|entry| {
        let Event::Received { port: Port::Host, bytes } = &entry.event else { return false };
        let mut bytes = bytes.as_slice();
        Decoder::new().feed(&mut bytes).is_some_and(|frame| frame.unwrap().message() == Ok(ToBoard::MissionStart))
    });
    assert!(started);
}
