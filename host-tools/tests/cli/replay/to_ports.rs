//! `--to`: recorded bytes to ports, and bad usage.

use super::sim::{TapedFlight, backseat, replay};
use crate::harness::wait_for;
use backseat_link::Pty;
use backseat_logs::session::{Event, Reader};
use backseat_wire::hostlink::Port;
use serde_json::Value;
use std::path::Path;
use std::thread::{JoinHandle, spawn};
use std::time::{Duration, Instant};

fn received(path: &Path, port: Port) -> Vec<u8> {
    let bytes = |event| match event {
        Event::Received { port: at, bytes } if at == port => bytes,
        _ => Vec::new(),
    };
    Reader::open(path).unwrap().flat_map(|entry| bytes(entry.unwrap().event)).collect()
}

/// What comes out of a line until `count` bytes have come; the line is still there then.
fn listen(line: Pty, count: usize) -> JoinHandle<(Vec<u8>, Pty)> {
    spawn(move || {
        let mut heard = Vec::new();
        wait_for("what was recorded", || {
            let mut buffer = [0; 4096];
            let read = line.read(&mut buffer, 200).unwrap();
            heard.extend_from_slice(&buffer[..read]);
            if heard.len() < count { Err(format!("{} of {count} bytes", heard.len())) } else { Ok(()) }
        });
        (heard, line)
    })
}

/// `backseat bridge` with a session in the port's place.
#[test]
fn a_session_is_bridged_as_fast_as_it_was_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.mcap");
    let mut flight = TapedFlight::begin(&path);
    flight.fly(3);
    flight.client.end_record().unwrap();
    let begun = Instant::now();
    let arguments = ["bridge", path.to_str().unwrap(), "--imc", "127.0.0.1:9", "--json"];
    let (_, counts, _) = backseat(&arguments);
    let counts: Value = serde_json::from_str(&counts).unwrap();
    assert_eq!(counts["telemetry_records"], 31, "one of each step: {counts}");
    assert!(begun.elapsed() > Duration::from_secs(2), "{:?}", begun.elapsed());
    let (code, _, stderr) = backseat(&[&arguments[..], &["--accept", "--moos", "127.0.0.1:9"]].concat());
    assert!(code != 0 && stderr.contains("takes no missions"), "{stderr}");
}

#[test]
fn ports_get_what_the_board_got() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.mcap");
    let mut flight = TapedFlight::begin(&path);
    flight.fly(4);
    flight.client.end_record().unwrap();
    for realtime in [false, true] {
        let wanted = [Port::Frontseat, Port::Ahrs].map(|port| received(&path, port));
        let lengths = wanted.each_ref().map(Vec::len);
        assert!(lengths.iter().all(|length| *length > 100), "{lengths:?}");
        let lines = [(); 2].map(|()| Pty::open().unwrap());
        let to = lines.each_ref().map(|line| line.path().to_owned());
        let (frontseat, ahrs) = (format!("frontseat={}", to[0]), format!("ahrs={}:57600", to[1]));
        let mut arguments = vec!["--to", &frontseat, &ahrs];
        arguments.extend(realtime.then_some("--realtime"));
        let mut counts = wanted.iter().map(Vec::len);
        let listeners = lines.map(|line| listen(line, counts.next().unwrap()));
        let begun = Instant::now();
        let (code, said, stderr) = replay(&path, &arguments);
        assert_eq!(code, 0, "{stderr}");
        for ((listener, wanted), port) in listeners.into_iter().zip(&wanted).zip(said["ports"].as_array().unwrap()) {
            assert!(listener.join().unwrap().0 == *wanted, "{port}");
            assert_eq!(port["bytes"], wanted.len(), "{port}");
            assert_eq!(port["late_ms"]["max"].is_number(), realtime, "{port}");
        }
        assert!(!realtime || begun.elapsed() > Duration::from_secs(3), "four seconds of bytes came sooner");
    }
}

#[test]
fn bad_usage_and_bad_files_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let session = path("session.mcap");
    let mut flight = TapedFlight::begin(Path::new(&session));
    flight.fly(1);
    flight.client.end_record().unwrap();
    for arguments in [
        &["replay"][..],
        &["replay", &session, "--realtime"],
        &["replay", &session, "--to", "/dev/null"],
        &["replay", &session, "--to", "sonar=/dev/null"],
        &["replay", &session, "--to", "dvl=/dev/null:fast"],
    ] {
        assert_eq!(backseat(arguments).0, 2, "{arguments:?}");
    }
    std::fs::write(path("empty"), "").unwrap();
    std::fs::write(path("text.mcap"), "t_s,depth_m\n0,1\n").unwrap();
    let line = Pty::open().unwrap();
    let host = format!("dvl={}", line.path());
    for (arguments, expected) in [
        (&["replay", &path("none.mcap")][..], "none.mcap"),
        (&["replay", &path("empty")], "empty"),
        (&["replay", &path("text.mcap")], "neither a session"),
        (&["replay", &session, "--to", "dvl=/dev/null"], "/dev/null: cannot be opened as a serial port"),
        (&["replay", &session, "--to", &host, &host], "given twice"),
    ] {
        let (code, stdout, stderr) = backseat(arguments);
        assert_eq!((code, stdout.as_str(), stderr.lines().count()), (1, "", 1), "{arguments:?}: {stderr}");
        assert!(stderr.starts_with("error: ") && stderr.contains(expected), "{stderr}");
    }
}
