//! `backseat export`: what a flight's bytes say, against what was measured before any device rounded it.

use crate::harness::program;
use backseat_app::App;
use backseat_app::{Recorder, record_start};
use backseat_link::Client;
use backseat_logs::output::Existing;
use backseat_logs::session::{Clock, Entry, Event, Meta, Reader, Writer};
use backseat_logs::{Column, Log, LogRow};
use backseat_wire::boardlog::LogRecord;
use backseat_wire::hostlink::{MAX_FRAME, ResetCause, Restart, encode};
use hil_sim::backseat::InProcess;
use hil_sim::flight::fly;
use hil_sim::scenario::Scenario;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::sync::atomic::AtomicBool;
use tempfile::TempDir;

/// Four minutes of the survey: some fixes at the surface, a dive, some packets.
struct ExportedFlight {
    folder: TempDir,
    steps: usize,
}

static FLIGHT: LazyLock<ExportedFlight> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let mut scenario = Scenario::built_in("survey").unwrap();
    scenario.settings.duration_s = 240.0;
    let mut client = Client::new(InProcess::new());
    let meta = Meta::new("test", Clock::Board);
    client.record(Writer::create(&folder.path().join("session.mcap"), &meta, Existing::Keep).unwrap()).unwrap();
    fly(&scenario, &mut client, Some(folder.path()), &AtomicBool::new(false), |_| {}).unwrap();
    client.end_record().unwrap();
    ExportedFlight { folder, steps: 2401 }
});

impl ExportedFlight {
    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn entries(&self) -> Vec<Entry> {
        Reader::open(&self.path("session.mcap")).unwrap().map(Result::unwrap).collect()
    }
}

fn export(folder: &Path, arguments: &[&str]) -> Value {
    program(folder, [&["export"], arguments, &["--json"]].concat()).json()
}

fn complaint(folder: &Path, arguments: &[&str]) -> String {
    program(folder, [&["export"], arguments].concat()).complaint(&format!("{arguments:?}"))
}

fn samples(log: &Log, column: Column) -> Vec<(u64, f64)> {
    log.column(column).collect()
}

/// The reference's sample at the same moment, or the nearest of it.
fn nearest(reference: &[(u64, f64)], time_us: u64) -> (u64, f64) {
    let after = reference.partition_point(|(us, _)| *us < time_us).min(reference.len() - 1);
    let before = after.saturating_sub(1);
    if reference[after].0.abs_diff(time_us) < reference[before].0.abs_diff(time_us) {
        reference[after]
    } else {
        reference[before]
    }
}

#[test]
fn val_the_vehicle_log_is_what_was_measured() {
    let folder = tempfile::tempdir().unwrap();
    let session = FLIGHT.path("session.mcap");
    let summary = export(folder.path(), &[session.to_str().unwrap(), "--csv", "out"]);
    assert_eq!(summary["notes"], Value::Array(Vec::new()), "{summary}");
    assert_eq!(summary["csv"]["telemetry"]["rows"], FLIGHT.steps);
    let log = Log::read(&folder.path().join("out/vehicle_log.csv")).unwrap();
    let reference = Log::read(&FLIGHT.path("log.csv")).unwrap();
    assert!(log.rows.windows(2).all(|pair| pair[0].time_us <= pair[1].time_us));
    // What the devices' frames resolve, and no more: half a tenth of a foot of depth, single precision of the GX3,
    // millimetres per second of PD0, five decimals of a minute (19 mm) of $GPRMC.
    let tolerances = [
        (Column::Depth, 0.0153),
        (Column::Roll, 2e-6),
        (Column::Pitch, 2e-6),
        (Column::Heading, 2e-6),
        (Column::P, 2e-6),
        (Column::R, 2e-6),
        (Column::DvlU, 1e-3),
        (Column::DvlV, 1e-3),
        (Column::DvlW, 1e-3),
        (Column::GpsX, 0.02),
        (Column::GpsY, 0.02),
    ];
    for (column, tolerance) in tolerances {
        let (found, truth) = (samples(&log, column), samples(&reference, column));
        let name = column.name();
        // all but the last, which is still on the line, and what came before the board listened
        assert!(found.len() + 10 > truth.len() && found.len() > 40, "{name}: {} of {}", found.len(), truth.len());
        for (time_us, value) in found {
            let (us, expected) = nearest(&truth, time_us);
            // a frame is some milliseconds on its line; the first fix is placed before UTC is known
            let slack_us = if column == Column::GpsX || column == Column::GpsY { 300_000 } else { 100_000 };
            assert!(us.abs_diff(time_us) < slack_us, "{name} at {time_us}: {us}");
            assert!((value - expected).abs() < tolerance, "{name} at {time_us}: {value} {expected}");
        }
    }
    let packets = |log: &Log| -> Vec<LogRow> {
        log.rows.iter().filter(|row| row.get(Column::Range).is_some()).cloned().collect()
    };
    let (found, truth) = (packets(&log), packets(&reference));
    assert!(found.len() >= 5 && truth.len() - found.len() <= 1, "{} of {}", found.len(), truth.len());
    for (row, expected) in found.iter().zip(&truth) {
        let difference = |column| (row.get(column).unwrap() - expected.get(column).unwrap()).abs();
        assert!(difference(Column::Tol) < 1e-6 && difference(Column::Toa) < 2e-6, "{}", row.time_us);
        // a microsecond of sound is 1.5 mm; the payload resolves 1e-7 degrees, the Doppler hundredths
        assert!(difference(Column::Range) < 3e-3 && difference(Column::RangeRate) < 0.01);
        assert!(difference(Column::ShipX) < 0.02 && difference(Column::ShipY) < 0.02);
        assert_eq!(row.arrival_us(), Some(row.time_us));
        // the ship's track, as far as the packets tell it
        let launched =
            log.rows.iter().find(|ship| Some(ship.time_us) == row.launch_us() && ship.ship_gnss_m().is_some());
        assert_eq!(launched.and_then(LogRow::ship_gnss_m), row.ship_at_launch_m());
    }
    let actuated = log.rows.iter().filter_map(LogRow::actuators).filter(|input| input.propeller_radps > 10.0).count();
    assert!(actuated > 100, "{actuated}");
}

#[test]
fn telemetry_and_events_have_a_row_each() {
    let folder = tempfile::tempdir().unwrap();
    export(folder.path(), &[FLIGHT.path("session.mcap").to_str().unwrap(), "--csv", "out"]);
    let mut telemetry = csv::Reader::from_path(folder.path().join("out/telemetry.csv")).unwrap();
    let rows: Vec<BTreeMap<String, String>> = telemetry.deserialize().map(Result::unwrap).collect();
    assert_eq!(rows.len(), FLIGHT.steps);
    let last = rows.last().unwrap();
    assert_eq!(
        (last["t_s"].as_str(), last["board_t_s"].as_str(), last["mode"].as_str()),
        ("240.0", "240.0", "Navigating")
    );
    let utc_s: f64 = last["utc_s"].parse().unwrap();
    assert!((utc_s - 1_748_952_240.0).abs() < 1e-3, "{utc_s}");
    assert_eq!(rows[0]["utc_s"], "");
    let mut events = csv::Reader::from_path(folder.path().join("out/events.csv")).unwrap();
    let events: Vec<[String; 3]> = events.deserialize().map(Result::unwrap).collect();
    assert!(events.iter().any(|[_, kind, text]| kind == "mode" && text == "Navigating (Nominal)"), "{events:?}");
    let fusion = std::fs::read_to_string(folder.path().join("out/fusion.csv")).unwrap();
    assert!(fusion.lines().filter(|line| line.contains(",range,0,fused,")).count() >= 5);
}

#[test]
fn foxglove_gets_its_own_schemas_and_a_layout_that_fits() {
    let folder = tempfile::tempdir().unwrap();
    let summary = export(folder.path(), &[FLIGHT.path("session.mcap").to_str().unwrap(), "--foxglove", "fox.mcap"]);
    let bytes = std::fs::read(folder.path().join("fox.mcap")).unwrap();
    let index = mcap::Summary::read(&bytes).unwrap().unwrap();
    let schema = |topic: &str| {
        let channel =
            index.channels.values().find(|channel| channel.topic == topic).unwrap_or_else(|| panic!("{topic}"));
        let schema = channel.schema.as_ref().unwrap();
        assert_eq!((channel.message_encoding.as_str(), schema.encoding.as_str()), ("json", "jsonschema"));
        (schema.name.clone(), serde_json::from_slice::<Value>(&schema.data).unwrap())
    };
    for (topic, name) in [
        ("/vehicle/fix", "foxglove.LocationFix"),
        ("/ship/fix", "foxglove.LocationFix"),
        ("/gps/fix", "foxglove.LocationFix"),
        ("/vehicle/pose", "foxglove.PoseInFrame"),
        ("/vehicle/track", "foxglove.PosesInFrame"),
        ("/tf", "foxglove.FrameTransform"),
        ("/events", "foxglove.Log"),
        ("/telemetry", "backseat.Telemetry"),
    ] {
        assert_eq!(schema(topic).0, name);
    }
    let messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    assert_eq!(summary["foxglove"]["messages"], messages.len());
    for message in &messages {
        let json: Value = serde_json::from_slice(&message.data).unwrap();
        let fields = &schema_fields(&serde_json::from_slice(&message.channel.schema.as_ref().unwrap().data).unwrap());
        assert!(json.as_object().unwrap().iter().all(|(name, value)| fields.contains(name) && !value.is_null()));
        // 2025-06-03 12:00 UTC and four minutes
        assert!((1_748_952_000..=1_748_952_240).contains(&(message.log_time / 1_000_000_000)), "{}", message.log_time);
        if json["latitude"].is_number() {
            let [lat, lon] = ["latitude", "longitude"].map(|name| json[name].as_f64().unwrap());
            assert!((lat - 41.5).abs() < 0.02 && (lon + 70.7).abs() < 0.02, "{lat} {lon}");
        }
    }
    // the layout: every panel is placed, every series is there to be drawn
    let layout: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("fox.layout.json")).unwrap()).unwrap();
    let panels = layout["configById"].as_object().unwrap();
    let mut placed = Vec::new();
    place(&layout["layout"], &mut placed);
    placed.sort_unstable();
    assert_eq!(placed, panels.keys().map(String::as_str).collect::<Vec<_>>());
    for path in panels.values().filter_map(|panel| panel["paths"].as_array()).flatten() {
        let (topic, field) = path["value"].as_str().unwrap().rsplit_once('.').unwrap();
        assert!(schema_fields(&schema(topic).1).iter().any(|name| name == field), "{path}");
    }
    for name in ["followTopic", "topicToRender"] {
        let topics: Vec<&str> = panels.values().filter_map(|panel| panel[name].as_str()).collect();
        assert!(topics.len() == 1 && topics.iter().all(|topic| !schema(topic).0.is_empty()));
    }
}

fn schema_fields(schema: &Value) -> Vec<String> {
    schema["properties"].as_object().unwrap().keys().cloned().collect()
}

/// Panels of a layout, from left to right and top to bottom.
fn place<'a>(node: &'a Value, placed: &mut Vec<&'a str>) {
    match node {
        Value::String(panel) => placed.push(panel),
        _ => ["first", "second"].iter().for_each(|side| place(&node[side], placed)),
    }
}

/// The board's own writer, into memory.
#[derive(Default)]
struct Card(Vec<u8>);

impl Recorder for Card {
    fn record(&mut self, record: &LogRecord<'_>) {
        self.0.extend_from_slice(encode(record, &mut [0; MAX_FRAME]).unwrap());
    }
}

#[test]
fn a_boards_log_gives_the_same_tables() {
    let folder = tempfile::tempdir().unwrap();
    let mut card = Card::default();
    let restart = Restart { cause: ResetCause::PowerOn, resets: 0, safe: false, crash: None };
    record_start(&mut card, &App::new(), restart, &[]);
    for Entry { time_us, event } in FLIGHT.entries() {
        match event {
            Event::Received { port, bytes } => {
                card.record(&LogRecord::Received { port, time_us, bytes: &bytes });
            }
            // the pump reads and writes in pieces of this size
            Event::Sent { port, bytes } => {
                bytes.chunks(256).for_each(|bytes| card.record(&LogRecord::Sent { port, time_us, bytes }));
            }
            Event::Edge => card.record(&LogRecord::Edge { time_us }),
            Event::Step { digest } => card.record(&LogRecord::Step { time_us, digest }),
            _ => {}
        }
    }
    std::fs::write(folder.path().join("LOG00007.BSL"), &card.0).unwrap();
    let session = FLIGHT.path("session.mcap");
    export(folder.path(), &[session.to_str().unwrap(), "--csv", "session"]);
    let summary = export(folder.path(), &["LOG00007.BSL", "--csv", "board"]);
    assert_eq!(summary["notes"], Value::Array(Vec::new()), "{summary}");
    for name in ["vehicle_log.csv", "telemetry.csv", "fusion.csv"] {
        let read = |of: &str| std::fs::read_to_string(folder.path().join(of).join(name)).unwrap();
        assert!(read("session") == read("board"), "{name}");
    }
    let events = std::fs::read_to_string(folder.path().join("board/events.csv")).unwrap();
    let started = "board started, firmware 0.1.0 (no image of a chip, no release, parameter list ";
    assert!(events.contains(started) && events.contains("), PowerOn"), "{events}");
    // power lost in the middle: what there is, and a note
    std::fs::write(folder.path().join("LOG00008.BSL"), &card.0[..card.0.len() / 2]).unwrap();
    let summary = export(folder.path(), &["LOG00008.BSL", "--csv", "half"]);
    assert!(summary["csv"]["telemetry"]["rows"].as_u64().is_some_and(|rows| rows > 1000), "{summary}");
}

#[test]
fn a_recording_counts_from_its_first_byte() {
    const BEGAN_US: u64 = 1_780_000_000_000_000;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recorded.mcap");
    let mut writer = Writer::create(&path, &Meta::new("test", Clock::Host), Existing::Keep).unwrap();
    for entry in FLIGHT.entries() {
        if matches!(entry.event, Event::Parameters(_) | Event::Received { .. } | Event::Sent { .. }) {
            writer.write(&Entry { time_us: BEGAN_US + entry.time_us, ..entry }).unwrap();
        }
    }
    writer.finish().unwrap();
    export(folder.path(), &["recorded.mcap", "--csv", "recorded"]);
    export(folder.path(), &[FLIGHT.path("session.mcap").to_str().unwrap(), "--csv", "session"]);
    let read = |of: &str| std::fs::read_to_string(folder.path().join(of).join("vehicle_log.csv")).unwrap();
    assert!(read("recorded") == read("session"));
    // cut off as a power loss does
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(folder.path().join("cut.mcap"), &bytes[..bytes.len() * 2 / 3]).unwrap();
    let summary = export(folder.path(), &["cut.mcap", "--csv", "cut"]);
    assert!(summary["notes"][0].as_str().is_some_and(|note| note.contains("cut.mcap: cut off")), "{summary}");
    assert!(read("recorded").starts_with(read("cut").trim_end().rsplit_once("\n").unwrap().0.split_at(5000).0));
}

#[test]
fn nothing_is_written_over_and_bad_files_are_told_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let session = FLIGHT.path("session.mcap");
    let session = session.to_str().unwrap();
    export(folder.path(), &[session, "--csv", "out", "--foxglove", "fox.mcap"]);
    let written = std::fs::read(folder.path().join("out/telemetry.csv")).unwrap();
    assert!(complaint(folder.path(), &[session, "--csv", "out"]).contains("vehicle_log.csv: exists already"));
    assert!(complaint(folder.path(), &[session, "--foxglove", "fox.mcap"]).contains("fox.mcap: exists already"));
    assert_eq!(std::fs::read(folder.path().join("out/telemetry.csv")).unwrap(), written);
    export(folder.path(), &[session, "--csv", "out", "--foxglove", "fox.mcap", "--force"]);
    assert_eq!(std::fs::read(folder.path().join("out/telemetry.csv")).unwrap(), written);
    std::fs::copy(session, folder.path().join("own.mcap")).unwrap();
    let own = complaint(folder.path(), &["own.mcap", "--foxglove", "own.mcap", "--force"]);
    assert!(own.contains("is the log itself"), "{own}");

    for (name, bytes, expected) in [
        ("empty.mcap", b"".as_slice(), "is empty"),
        ("table.csv", b"t_s,depth_m\n0,1\n", "neither a session"),
        ("magic.mcap", b"\x89MCAP0\r\n", "its description is missing"),
    ] {
        std::fs::write(folder.path().join(name), bytes).unwrap();
        let line = complaint(folder.path(), &[name, "--csv", name.trim_end_matches(".csv")]);
        assert!(line.contains(name) && line.contains(expected), "{line}");
    }
    assert!(complaint(folder.path(), &["missing.mcap", "--csv", "x"]).contains("missing.mcap"));
    assert_eq!(program(folder.path(), ["export", session]).code, Some(2), "nothing asked for");
}
