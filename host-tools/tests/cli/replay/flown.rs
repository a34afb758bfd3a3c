//! Sessions of the simulator: the same to the bit, or the difference is named.

use super::sim::{TapedFlight, backseat, difference, replay, rewrite};
use backseat_core::navigation::Sensor;
use backseat_logs::session::{Clock, Entry, Event, Reader};
use backseat_wire::hostlink::{Decoder, FromBoard, MAX_FRAME, Port, ToBoard, encode};
use std::path::Path;

/// A flight with acoustic fixes, and a parameter changed under way.
fn flown(path: &Path) -> TapedFlight {
    let mut flight = TapedFlight::begin(path);
    flight.fly(150);
    flight.client.request(&ToBoard::Unlock, String::new).unwrap();
    flight.client.set_parameters(&[("installation.sound_speed_mps".to_owned(), 1492.5)]).unwrap();
    flight.fly(60);
    flight.client.end_record().unwrap();
    let ranges = flight.fusions.iter().filter(|fusion| fusion.sensor == Sensor::Range && fusion.fused).count();
    assert!(ranges > 2, "{ranges} ranges");
    flight
}

#[test]
fn a_flight_is_the_same_to_the_bit_and_what_is_not_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.mcap");
    let flight = flown(&path);
    let digest = format!("{:016x}", flight.digest);

    let (code, said, stderr) = replay(&path, &[]);
    assert_eq!((code, &said["exact"], &said["digest"]), (0, &true.into(), &digest.clone().into()), "{said}{stderr}");
    assert_eq!((&said["steps"], &said["clock"]), (&2101.into(), &"board".into()), "{said}");
    assert!(said["compared"]["messages"].as_u64().unwrap() > 4000, "{said}");
    assert!(said["compared"]["bytes"].as_u64().unwrap() > 10_000, "{said}");
    let (code, text, _) = backseat(&["replay", path.to_str().unwrap()]);
    assert!(code == 0 && text.contains("the same to the bit") && text.contains(&digest), "{text}");

    the_parameter_counts(&path);
    an_input_changed(&path);
    the_boards_account_changed(&path);
    a_cut_session(&path);
}

/// Without the change of the parameter the ranges after it are other ones.
fn the_parameter_counts(path: &Path) {
    let changed = path.with_file_name("no_parameter.mcap");
    rewrite(path, &changed, Clock::Board, |entry| {
        let mut keep = true;
        if let Event::Received { port: Port::Host, bytes } = &entry.event
            && entry.time_us >= 100_000_000
        {
            let mut decoder = Decoder::new();
            let frame = decoder.feed(&mut bytes.as_slice()).unwrap().unwrap();
            keep = !matches!(frame.message().unwrap(), ToBoard::ParameterSet { .. });
        }
        keep.then_some(entry)
    });
    let (code, said, stderr) = replay(&changed, &[]);
    assert_eq!((code, &said["exact"]), (1, &false.into()), "{said}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    // first the board's "done" that is one too many
    let [t_s, record, field, _] = difference(&said, "record");
    assert_eq!((&*t_s, &*record, &*field), ("150.100000", "done", "kind"), "{said}");
    let [t_s, ..] = difference(&said, "step");
    let t_s: f64 = t_s.parse().unwrap();
    assert!(t_s > 150.0 && t_s < 200.0, "{said}");
}

/// A byte of the AHRS is another: its frame is refused, and the state is another from then on.
fn an_input_changed(path: &Path) {
    let changed = path.with_file_name("input.mcap");
    let mut at_us = None;
    rewrite(path, &changed, Clock::Board, |mut entry| {
        if let Event::Received { port: Port::Ahrs, bytes } = &mut entry.event
            && at_us.is_none()
            && entry.time_us > 60_000_000
        {
            bytes[4] ^= 1;
            at_us = Some(entry.time_us);
        }
        Some(entry)
    });
    let (code, said, stderr) = replay(&changed, &[]);
    assert_eq!(code, 1);
    let at_s = at_us.unwrap() as f64 * 1e-6;
    let [t_s, _, field, _] = difference(&said, "step");
    let step_s: f64 = t_s.parse().unwrap();
    assert!(step_s > at_s && step_s < at_s + 0.3, "{at_s} s: {said}");
    assert!(field.contains("digest"));
    assert!(said["differing_steps"].as_u64().unwrap() > 1000, "{said}");
    assert!(stderr.contains(&t_s), "{stderr}");
}

/// What the board is said to have computed or sent is another: the replay names record and field, and nothing else differs.
fn the_boards_account_changed(path: &Path) {
    let telemetry = path.with_file_name("telemetry.mcap");
    rewrite(path, &telemetry, Clock::Board, |mut entry| {
        if let Event::Sent { port: Port::Host, bytes } = &mut entry.event
            && entry.time_us == 80_000_000
        {
            *bytes = shifted(bytes);
        }
        Some(entry)
    });
    let (code, said, stderr) = replay(&telemetry, &[]);
    assert_eq!((code, &said["differing_steps"]), (1, &0.into()), "{said}");
    let [t_s, record, field, _] = difference(&said, "record");
    assert_eq!((&*t_s, &*record, &*field), ("80.000000", "telemetry", "y_m"), "{said}");
    assert!(stderr.contains("80.000000 s, telemetry, y_m"), "{stderr}");

    let sentence = path.with_file_name("sentence.mcap");
    let mut done = false;
    rewrite(path, &sentence, Clock::Board, |mut entry| {
        if let Event::Sent { port: Port::Frontseat, bytes } = &mut entry.event
            && entry.time_us > 90_000_000
            && !done
        {
            let comma = bytes.iter().position(|byte| *byte == b',').unwrap();
            bytes[comma + 1] ^= 1;
            done = true;
        }
        Some(entry)
    });
    let (code, said, _) = replay(&sentence, &[]);
    let [_, record, field, replayed] = difference(&said, "record");
    assert_eq!((code, &*record, &*field), (1, "sentence to frontseat", "field 1"), "{said}");
    assert!(replayed.starts_with("$OM"), "{said}");

    let digest = path.with_file_name("digest.mcap");
    rewrite(path, &digest, Clock::Board, |mut entry| {
        if let Event::Step { digest } = &mut entry.event
            && entry.time_us == 70_000_000
        {
            *digest ^= 1;
        }
        Some(entry)
    });
    let (code, said, _) = replay(&digest, &[]);
    assert_eq!((code, &said["differing_steps"]), (1, &1.into()), "{said}");
    assert_eq!(difference(&said, "step")[0], "70.000000");
}

/// The frames of a step, y of its telemetry moved by the last bit.
fn shifted(bytes: &[u8]) -> Vec<u8> {
    let (mut decoder, mut rest, mut out) = (Decoder::new(), bytes, Vec::new());
    while let Some(frame) = decoder.feed(&mut rest) {
        let mut message = frame.unwrap().message().unwrap();
        if let FromBoard::Telemetry(record) = &mut message {
            record.state[1] = record.state[1].next_up();
        }
        out.extend_from_slice(encode(&message, &mut [0; MAX_FRAME]).unwrap());
    }
    out
}

/// A file that the power cut off is the same up to the cut.
fn a_cut_session(path: &Path) {
    let bytes = std::fs::read(path).unwrap();
    let cut = path.with_file_name("cut.mcap");
    std::fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let (code, said, stderr) = replay(&cut, &[]);
    assert_eq!((code, &said["exact"]), (0, &true.into()), "{said}{stderr}");
    let steps = said["steps"].as_u64().unwrap();
    assert!(steps > 500 && steps < 2000, "{said}");
    assert!(said["notes"][0].as_str().unwrap().contains("cut off"), "{said}");
    // and one with a hole: nothing is held against the board after it
    let hole = path.with_file_name("hole.mcap");
    // Some bytes belong to an index that no reader needs: the first one from the middle on that it does.
    let noticed = (0..20).any(|k| {
        let mut broken = bytes.clone();
        broken[bytes.len() / 2 + 3000 * k] ^= 0xFF;
        std::fs::write(&hole, &broken).unwrap();
        let (code, said, _) = replay(&hole, &[]);
        code == 0 && said["notes"].to_string().contains("compared up to")
    });
    assert!(noticed, "no damaged byte is noticed");
    let entries: Vec<Entry> = Reader::open(&hole).unwrap().map(Result::unwrap).collect();
    assert!(entries.len() > 1000);
}
