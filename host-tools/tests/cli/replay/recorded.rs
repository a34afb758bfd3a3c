//! A session with a PC's times.

use super::sim::{TapedFlight, backseat, replay, rewrite};
use backseat_logs::session::{Clock, Event};
use backseat_wire::hostlink::Port;

/// What a PC beside the board would have recorded: everything later, by cable and buffers, and neither steps nor edges.
#[test]
fn a_recording_is_replayed_closely_and_says_that_it_is_not_exact() {
    let folder = tempfile::tempdir().unwrap();
    let (flown, recorded) = (folder.path().join("flown.mcap"), folder.path().join("recorded.mcap"));
    let mut flight = TapedFlight::begin(&flown);
    flight.fly(120);
    flight.client.end_record().unwrap();
    let mut count = 0;
    let mut previous_us = 0;
    rewrite(&flown, &recorded, Clock::Host, |mut entry| {
        if !matches!(entry.event, Event::Parameters(_) | Event::Received { .. } | Event::Sent { port: Port::Host, .. })
        {
            return None;
        }
        // 1 to 9 ms late, in a clock of its own
        count += 1;
        entry.time_us += 1_600_000_000_000_000 + 1000 + (count * 7919) % 8000;
        previous_us = entry.time_us.max(previous_us);
        entry.time_us = previous_us;
        Some(entry)
    });
    let (code, said, stderr) = replay(&recorded, &[]);
    assert_eq!((code, &said["exact"], &said["clock"]), (0, &false.into(), &"host".into()), "{said}{stderr}");
    assert!(said["why"].as_str().unwrap().contains("times of a PC"), "{said}");
    assert!(said["pulse_edges"].as_u64().unwrap() > 100, "{said}");
    // bytes a few milliseconds late move a vehicle of 1 m/s by millimetres, its fixes by centimetres
    let max_m = said["distance_m"]["max"].as_f64().unwrap();
    assert!(max_m > 0.0 && max_m < 0.5, "{said}");
    assert!(said["steps"].as_u64().unwrap() > 1190 && said["steps_unmatched"].as_u64().unwrap() < 5, "{said}");

    let mute = folder.path().join("mute.mcap");
    rewrite(&recorded, &mute, Clock::Host, |entry| {
        matches!(entry.event, Event::Received { port: Port::Frontseat | Port::Ahrs, .. }).then_some(entry)
    });
    let (code, text, _) = backseat(&["replay", mute.to_str().unwrap()]);
    assert_eq!(code, 0, "{text}");
    for expected in ["no telemetry", "no parameters", "not to the bit"] {
        assert!(text.contains(expected), "{expected}: {text}");
    }
}
