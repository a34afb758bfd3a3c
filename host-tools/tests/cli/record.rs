//! `backseat record`: what it writes, and what it survives.

use crate::board::bench::Bench;
use crate::harness::{PROGRAM, command, program, signal, text, wait_for};
use backseat_app::parameters::PARAMETERS;
use backseat_link::Pty;
use backseat_logs::session::{Clock, Entry, Event, Reader};
use backseat_wire::hostlink::{Decoder, FromBoard, Port};
use hil_sim::rng::{Source, Stream};
use serde_json::Value;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use tempfile::TempDir;

const SENTENCE: &[u8] = b"$C82.8P-3.89R-2.21T20.6D3.28*48\r\n";

fn entries(path: &Path) -> Vec<Entry> {
    Reader::open(path).unwrap().map(Result::unwrap).collect()
}

/// All bytes that the device of a port sent.
fn received(entries: &[Entry], wanted: Port) -> Vec<u8> {
    let bytes = |entry: &Entry| match &entry.event {
        Event::Received { port, bytes } if *port == wanted => bytes.clone(),
        _ => Vec::new(),
    };
    entries.iter().flat_map(bytes).collect()
}

fn notes(entries: &[Entry]) -> Vec<String> {
    let note = |entry: &Entry| if let Event::Note(note) = &entry.event { Some(note.clone()) } else { None };
    entries.iter().filter_map(note).collect()
}

/// Records of telemetry that a board sent.
fn telemetry(entries: &[Entry]) -> usize {
    let (mut decoder, mut count) = (Decoder::new(), 0);
    for entry in entries {
        let Event::Sent { port: Port::Host, bytes } = &entry.event else { continue };
        let mut rest = bytes.as_slice();
        while let Some(frame) = decoder.feed(&mut rest) {
            count += usize::from(matches!(frame.unwrap().message(), Ok(FromBoard::Telemetry(_))));
        }
    }
    count
}

/// A recording under way, in a folder of its own.
struct Recording {
    folder: TempDir,
    child: Child,
}

impl Recording {
    fn start(arguments: &[String]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut command = command(folder.path());
        command.arg("record").args(arguments).args(["-o", "log.mcap"]);
        Self::spawn(command, folder)
    }

    fn spawn(mut command: Command, folder: TempDir) -> Self {
        command.current_dir(folder.path()).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        Self { child: command.spawn().unwrap(), folder }
    }

    fn path(&self) -> PathBuf {
        self.folder.path().join("log.mcap")
    }

    /// Waits until the log holds what is looked for.
    fn wait_for(&self, what: &str, mut found: impl FnMut(&[Entry]) -> bool) {
        wait_for(what, || {
            // at first there is no file, or none with a description
            let read: Vec<_> =
                Reader::open(&self.path()).map_or(Vec::new(), |reader| reader.map(Result::unwrap).collect());
            if found(&read) { Ok(()) } else { Err(format!("{:?}", read.iter().rev().take(5).collect::<Vec<_>>())) }
        });
    }

    fn interrupt(self) -> (Output, TempDir) {
        signal("INT", self.child.id());
        (self.child.wait_with_output().unwrap(), self.folder)
    }
}

#[test]
fn a_boards_telemetry_and_parameters_are_in_the_log() {
    let bench = Bench::new();
    // the board keeps still for two seconds; then ten records a second, as far as a busy machine lets it
    let summary = wait_for("telemetry", || {
        let _ = std::fs::remove_file(bench.path("log.mcap"));
        let summary = bench.json(&["record", "host=PORT", "-o", "log.mcap", "--for", "4"]);
        if telemetry(&entries(&bench.path("log.mcap"))) > 5 { Ok(summary) } else { Err(summary.to_string()) }
    });
    assert_eq!((&summary["ended_by"], &summary["parameters"]), (&Value::from("time"), &PARAMETERS.len().into()));
    let host = &summary["ports"]["host"];
    assert_eq!((&host["interruptions"], &host["open_at_end"]), (&0.into(), &true.into()));

    let path = bench.path("log.mcap");
    assert_eq!(Reader::open(&path).unwrap().meta().clock, Clock::Host);
    let entries = entries(&path);
    let set = entries.iter().find_map(|entry| if let Event::Parameters(set) = &entry.event { Some(set) } else { None });
    let defaults: Vec<_> = PARAMETERS.iter().map(|one| (one.name.to_owned(), one.default())).collect();
    assert_eq!(set, Some(&defaults));
    let sent = entries.iter().map(|entry| if let Event::Sent { bytes, .. } = &entry.event { bytes.len() } else { 0 });
    assert_eq!(host["bytes"], sent.sum::<usize>());
    let steps = telemetry(&entries);
    let raw = std::fs::read(&path).unwrap();
    let decoded = mcap::MessageStream::new(&raw).unwrap().map(Result::unwrap);
    let decoded: Vec<Value> = decoded
        .filter(|message| message.channel.topic == "telemetry")
        .map(|message| serde_json::from_slice(&message.data).unwrap())
        .collect();
    assert_eq!(decoded.len(), steps);
    assert_eq!(decoded[0]["mode"], "Initialising");
    assert!(decoded[0]["heading_rad"].is_number() && decoded[0]["utc_s"].is_null());
    // and it is not written over
    let line = bench.complaint(&["record", "host=PORT", "-o", "log.mcap", "--for", "1"]);
    assert!(line.contains("log.mcap: exists already"), "{line}");
    assert_eq!(std::fs::read(&path).unwrap(), raw);
}

#[test]
fn a_device_that_is_unplugged_is_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let dvl = folder.path().join("dvl");
    let (ahrs, first) = (Pty::open().unwrap(), Pty::open().unwrap());
    symlink(first.path(), &dvl).unwrap();
    let recording = Recording::start(&[format!("dvl={}", dvl.display()), format!("ahrs={}", ahrs.path())]);
    // what is on a line before it is opened is not for us
    recording.wait_for("the first bytes", |entries| {
        first.write_all(b"one").unwrap();
        !received(entries, Port::Dvl).is_empty()
    });
    drop(first);
    std::fs::remove_file(&dvl).unwrap();
    recording.wait_for("the note of the loss", |entries| notes(entries).len() == 1);
    ahrs.write_all(b"meanwhile").unwrap();
    let second = Pty::open().unwrap();
    symlink(second.path(), &dvl).unwrap();
    recording.wait_for("the note of the return", |entries| notes(entries).len() == 2);
    second.write_all(SENTENCE).unwrap();
    recording.wait_for("what came after", |entries| received(entries, Port::Dvl).ends_with(SENTENCE));

    let path = recording.path();
    let (output, folder) = recording.interrupt();
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let entries = entries(&path);
    let notes = notes(&entries);
    assert!(notes[0].starts_with("dvl: ") && notes[0].contains("disconnected"), "{notes:?}");
    assert!(notes[1].ends_with("dvl is back"), "{notes:?}");
    assert!(notes.iter().all(|note| text(&output.stderr).contains(note.as_str())), "{}", text(&output.stderr));
    assert_eq!(received(&entries, Port::Ahrs), b"meanwhile");
    let dvl = received(&entries, Port::Dvl);
    assert!(dvl.starts_with(b"one") && dvl.ends_with(SENTENCE), "{:?}", text(&dvl));
    assert!(text(&output.stdout).contains("interrupted 1 times"), "{}", text(&output.stdout));
    assert!(entries.windows(2).all(|pair| pair[0].time_us <= pair[1].time_us), "in order of time");
    drop(folder);
}

#[test]
fn what_was_written_before_kill_minus_nine_is_there() {
    let line = Pty::open().unwrap();
    let mut recording = Recording::start(&[format!("frontseat={}", line.path())]);
    let mut sent = Vec::new();
    recording.wait_for("the beginning", |entries| {
        line.write_all(SENTENCE).unwrap();
        sent.extend_from_slice(SENTENCE);
        received(entries, Port::Frontseat).len() > 10 * SENTENCE.len()
    });
    recording.child.kill().unwrap();
    recording.child.wait().unwrap();
    let mut reader = Reader::open(&recording.path()).unwrap();
    let entries: Vec<Entry> = (&mut reader).map(Result::unwrap).collect();
    assert!(reader.damage().unfinished && reader.damage().broken_records == 0);
    let bytes = received(&entries, Port::Frontseat);
    assert!(bytes.len() > 10 * SENTENCE.len() && sent.starts_with(&bytes));
}

#[test]
fn a_full_disk_is_told_and_what_is_written_can_be_read() {
    let line = Pty::open().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new("sh");
    // files of 32 blocks of 512 bytes at most; the signal that comes with it is ignored, so that writing fails
    let script = format!("trap '' XFSZ; ulimit -f 32; exec \"$0\" record frontseat={} -o log.mcap", line.path());
    command.args(["-c", &script, PROGRAM]);
    let mut recording = Recording::spawn(command, folder);
    // bytes that do not compress
    let mut random = Stream::new(1, Source::Study);
    let mut sent = Vec::new();
    wait_for("the end", || {
        let block: Vec<u8> = (0..256).map(|_| (256.0 * random.uniform()) as u8).collect();
        if line.write_all(&block).is_ok() {
            sent.extend_from_slice(&block);
        }
        recording.child.try_wait().unwrap().ok_or_else(|| format!("it goes on after {} bytes", sent.len()))
    });
    let path = recording.path();
    let output = recording.child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let stderr = text(&output.stderr);
    let errors: Vec<&str> = stderr.lines().filter(|line| line.starts_with("error: ")).collect();
    assert!(errors.len() == 1 && errors[0].contains("can be read up to there: log.mcap: File too large"), "{errors:?}");
    let bytes = received(&entries(&path), Port::Frontseat);
    let begins = sent.windows(bytes.len()).any(|window| window == bytes);
    assert!(bytes.len() > 4096 && begins, "{} of {} bytes", bytes.len(), sent.len());
}

#[test]
fn wrong_usage_and_missing_devices_are_told_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| program(folder.path(), [&["record", "-o", "x.mcap"], arguments].concat());
    for wrong in ["/dev/ttyUSB0", "sonar=/dev/ttyUSB0", "dvl=/dev/ttyUSB0:fast"] {
        assert_eq!(run(&[wrong]).code, Some(2), "{wrong}");
    }
    assert_eq!(program(folder.path(), ["record", "dvl=/dev/null"]).code, Some(2), "no output");
    let complaint = run(&["dvl=/dev/no-such-device"]).complaint("no device");
    assert!(complaint.contains("/dev/no-such-device: cannot be opened as a serial port"), "{complaint}");
    let complaint = run(&["dvl=/dev/a", "dvl=/dev/b"]).complaint("twice");
    assert!(complaint.contains("dvl: this port is named twice"), "{complaint}");
    assert!(!folder.path().join("x.mcap").exists());
}
