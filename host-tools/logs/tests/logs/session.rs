//! Session logs: everything comes back, and what a cut or a broken byte costs.

use backseat_app::parameters::{PARAMETER_SCHEMA, PARAMETERS};
use backseat_app::{App, STEP_US};
use backseat_app::{Recorder, record_start};
use backseat_logs::output::Existing;
use backseat_logs::session::{Attachment, Clock, Damage, Entry, Event, Meta, Reader, Writer};
use backseat_wire::boardlog::LogRecord;
use backseat_wire::hostlink::{ImageId, MAX_FRAME, Port, ResetCause, Restart, encode};
use std::path::Path;

const RESTART: Restart = Restart { cause: ResetCause::Watchdog, resets: 3, safe: false, crash: None };

fn meta() -> Meta {
    Meta::new("test 1.0", Clock::Board).with("seed", 7)
}

/// One of each, and awkward numbers.
fn every_event() -> Vec<Entry> {
    let values = vec![("a".to_owned(), 0.1 + 0.2), ("b[1]".to_owned(), -5e-324), ("c".to_owned(), 1.797e308)];
    let events = [
        Event::Start {
            firmware: "0.1.0".to_owned(),
            parameter_schema: 9,
            image: ImageId { build: 0xAB, crc: 1, commit: 2, parameters: 3 },
            restart: RESTART,
            record: vec![0, 255, 7],
        },
        Event::Parameters(values),
        Event::Received { port: Port::Dvl, bytes: (0..=255).collect() },
        Event::Received { port: Port::Host, bytes: vec![0] },
        Event::Edge,
        Event::Restart,
        Event::Step { digest: u64::MAX - 1 },
        Event::Sent { port: Port::Frontseat, bytes: b"$OSD*00\r\n".to_vec() },
        Event::Sent { port: Port::Host, bytes: vec![0; 100] },
        Event::Note("dvl: /dev/ttyUSB0 is gone".to_owned()),
        Event::Lost(3),
    ];
    (0..).map(|index| index * 1_000_003).zip(events).map(|(time_us, event)| Entry { time_us, event }).collect()
}

fn read(path: &Path) -> (Vec<Entry>, Damage) {
    let mut reader = Reader::open(path).unwrap();
    let entries = (&mut reader).map(Result::unwrap).collect();
    (entries, reader.damage())
}

/// A file of some chunks, what is in it, and its length after each chunk.
fn chunks(path: &Path) -> (Vec<Vec<Entry>>, Vec<usize>) {
    let mut writer = Writer::create(path, &meta(), Existing::Keep).unwrap();
    let (mut written, mut lengths) = (Vec::new(), Vec::new());
    for chunk in 0..4_u8 {
        let entries: Vec<Entry> = (0..12)
            .map(|i| Entry {
                time_us: 1_000_000 * u64::from(chunk) + i,
                event: Event::Received { port: Port::Ahrs, bytes: vec![chunk; 3 + i as usize] },
            })
            .collect();
        entries.iter().for_each(|entry| writer.write(entry).unwrap());
        writer.flush().unwrap();
        written.push(entries);
        lengths.push(std::fs::metadata(path).unwrap().len() as usize);
    }
    writer.finish().unwrap();
    (written, lengths)
}

#[test]
fn every_event_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let mut writer = Writer::create(&path, &meta(), Existing::Keep).unwrap();
    let vehicle = Attachment {
        name: "vehicle.toml".to_owned(),
        media_type: "application/toml".to_owned(),
        bytes: b"[vehicle]\n".to_vec(),
    };
    writer.attach(&vehicle).unwrap();
    let entries = every_event();
    entries.iter().for_each(|entry| writer.write(entry).unwrap());
    writer.finish().unwrap();

    let reader = Reader::open(&path).unwrap();
    assert_eq!(reader.meta(), &meta());
    assert_eq!(reader.attachments(), [vehicle]);
    assert_eq!(read(&path), (entries, Damage::default()));
    let refused = Writer::create(&path, &meta(), Existing::Keep).err().unwrap();
    assert!(refused.to_string().contains("exists already"), "{refused}");
}

#[test]
fn a_file_cut_at_any_byte_gives_all_chunks_before_the_cut() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let (written, lengths) = chunks(&path);
    let bytes = std::fs::read(&path).unwrap();
    let cut_path = folder.path().join("cut.mcap");
    // from the first byte of the last chunk to the whole file, index and all
    let [.., before, after] = lengths[..] else { unreachable!() };
    for cut in before..=bytes.len() {
        std::fs::write(&cut_path, &bytes[..cut]).unwrap();
        let (entries, damage) = read(&cut_path);
        let earlier: Vec<Entry> = written[..written.len() - 1].concat();
        assert!(entries.starts_with(&earlier), "{cut} of {}", bytes.len());
        assert!(entries.len() == earlier.len() || entries == written.concat(), "{cut}: a chunk in pieces");
        if cut >= after {
            assert_eq!(entries, written.concat(), "{cut}");
        }
        assert!(damage.unfinished == (cut < bytes.len()) && damage.broken_records == 0, "{cut}: {damage:?}");
    }
    // further in front a cut costs what is behind it
    for cut in (0..before).step_by(7) {
        std::fs::write(&cut_path, &bytes[..cut]).unwrap();
        let whole = lengths.iter().filter(|length| **length <= cut).count();
        let Ok(reader) = Reader::open(&cut_path) else {
            assert_eq!(whole, 0, "{cut}");
            continue;
        };
        let entries: Vec<Entry> = reader.map(Result::unwrap).collect();
        assert!(entries.starts_with(&written[..whole].concat()), "{cut}");
    }
}

#[test]
fn a_broken_byte_costs_its_chunk_and_invents_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let (written, lengths) = chunks(&path);
    let bytes = std::fs::read(&path).unwrap();
    let broken_path = folder.path().join("broken.mcap");
    for at in lengths[0]..lengths[1] {
        for bit in [0x01, 0x80] {
            let mut broken = bytes.clone();
            broken[at] ^= bit;
            std::fs::write(&broken_path, &broken).unwrap();
            let (entries, damage) = read(&broken_path);
            assert!(entries.starts_with(&written[0]), "{at}");
            assert!(entries.iter().all(|entry| written.iter().flatten().any(|one| one == entry)), "{at}: invented");
            // Wrong index records cost nothing; else the chunk is lost alone, by a wrong length too: the index at the end
            // says where the next one begins.
            let alone = [&written[..1], &written[2..]].concat().concat();
            assert!(entries == written.concat() || entries == alone, "{at}: {damage:?}");
            assert!(!damage.unfinished, "{at}: {damage:?}");
        }
    }
}

/// Both ended in a panic of the `mcap` crate (0.26), the second one with overflow checks.
#[test]
fn records_that_end_too_early_are_broken_ones() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let (written, _) = chunks(&path);
    let bytes = std::fs::read(&path).unwrap();
    // behind the record that holds the description
    let mut at = mcap::MAGIC.len();
    while bytes[at] != mcap::records::op::METADATA {
        at += 9 + usize::from(bytes[at + 1]);
    }
    at += 9 + usize::from(bytes[at + 1]);
    let record = |opcode: u8, body: &[u8]| [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat();
    // two times, two empty texts, no data, and no CRC
    let attachment = record(mcap::records::op::ATTACHMENT, &[0; 32]);
    // no compression, ten bytes, and in them a record of a hundred
    let mut body = vec![0; 32];
    body.extend(10_u64.to_le_bytes());
    body.extend([0x0F, 100, 0, 0, 0, 0, 0, 0, 0, 0]);
    let chunk = record(mcap::records::op::CHUNK, &body);
    for broken in [attachment, chunk] {
        std::fs::write(&path, [&bytes[..at], &broken, &bytes[at..]].concat()).unwrap();
        let (entries, damage) = read(&path);
        assert_eq!((entries, damage.broken_records), (written.concat(), 1));
    }
}

#[test]
fn other_files_are_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x");
    let refused = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        let error = Reader::open(&path).err().unwrap().to_string();
        assert!(error.starts_with(path.to_str().unwrap()) && error.lines().count() == 1, "{error}");
        error
    };
    assert!(refused(b"").contains("is empty"));
    assert!(refused(b"t_s,depth_m\n0,1\n").contains("neither a session"));
    assert!(refused(&[0; 5000]).contains("neither a session"));
    assert!(refused(b"\x89MCAP0\r\n").contains("description is missing"));
    assert!(Reader::open(&folder.path().join("missing")).is_err());
    let huge = [b"\x89MCAP0\r\n\x06".as_slice(), &u64::MAX.to_le_bytes(), b"rest"].concat();
    assert!(refused(&huge).contains("description is missing"));
    // somebody else's MCAP
    let mut other = mcap::Writer::new(std::io::Cursor::new(Vec::new())).unwrap();
    other.finish().unwrap();
    assert!(refused(&other.into_inner().into_inner()).contains("description is missing"));
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
fn a_boards_log_is_read_to_its_cut() {
    let mut app = Box::new(App::new());
    let mut card = Card::default();
    record_start(&mut card, &app, RESTART, &[1, 2, 3]);
    let mut expected = vec![
        Event::Start {
            firmware: env!("CARGO_PKG_VERSION").to_owned(),
            parameter_schema: backseat_app::parameters::PARAMETER_SCHEMA,
            image: ImageId { parameters: backseat_app::store::FINGERPRINT, ..ImageId::default() },
            restart: RESTART,
            record: vec![1, 2, 3],
        },
        Event::Parameters(
            PARAMETERS.iter().map(|parameter| (parameter.name.to_owned(), parameter.default())).collect(),
        ),
    ];
    for step in 1..=40_u64 {
        let time_us = step * STEP_US;
        card.record(&LogRecord::Received { port: Port::Ahrs, time_us: time_us - 5, bytes: b"$C1.0" });
        expected.push(Event::Received { port: Port::Ahrs, bytes: b"$C1.0".to_vec() });
        app.step(time_us);
        card.record(&LogRecord::Step { time_us, digest: step });
        expected.push(Event::Step { digest: step });
    }
    card.record(&LogRecord::Lost { records: 2 });
    expected.push(Event::Lost(2));
    card.record(&LogRecord::Edge { time_us: 5_000_000 });
    expected.push(Event::Edge);

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("LOG00001.BSL");
    std::fs::write(&path, &card.0).unwrap();
    let reader = Reader::open(&path).unwrap();
    assert_eq!(reader.meta().clock, Clock::Board);
    assert_eq!(reader.meta().program, format!("backseat {}", env!("CARGO_PKG_VERSION")));
    let (entries, damage) = read(&path);
    assert_eq!(damage, Damage::default());
    assert_eq!(entries.iter().map(|entry| &entry.event).collect::<Vec<_>>(), expected.iter().collect::<Vec<_>>());
    assert_eq!(entries.last().map(|entry| entry.time_us), Some(5_000_000));
    for cut in card.0.len() - 300..card.0.len() {
        std::fs::write(&path, &card.0[..cut]).unwrap();
        let (cut_entries, damage) = read(&path);
        assert!(entries.starts_with(&cut_entries) && cut_entries.len() + 24 > entries.len(), "{cut}");
        assert!(damage.cut_bytes < MAX_FRAME as u64 && damage.broken_records == 0, "{cut} {damage:?}");
    }
}

/// The values of a board's log have no names: those of another version of the list are not read at all.
#[test]
fn a_boards_log_of_an_older_list_is_refused_with_both_versions() {
    struct Older(Card);
    impl Recorder for Older {
        fn record(&mut self, record: &LogRecord<'_>) {
            match *record {
                LogRecord::Start { firmware, restart, record, .. } => {
                    self.0.record(&LogRecord::Start {
                        firmware,
                        parameter_schema: PARAMETER_SCHEMA - 1,
                        image: ImageId::default(),
                        restart,
                        record,
                    });
                }
                ref other => self.0.record(other),
            }
        }
    }
    let mut card = Older(Card::default());
    record_start(&mut card, &App::new(), RESTART, &[1, 2, 3]);
    card.record(&LogRecord::Edge { time_us: 1 });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("LOG00001.BSL");
    std::fs::write(&path, &card.0.0).unwrap();
    let cause = match Reader::open(&path) {
        Ok(reader) => reader.filter_map(Result::err).next().map(|error| error.to_string()),
        Err(error) => Some(error.to_string()),
    };
    let cause = cause.expect("it is refused");
    let [written, known] = [PARAMETER_SCHEMA - 1, PARAMETER_SCHEMA].map(|version| format!("version {version}"));
    assert!(cause.contains(&format!("written with {written}")) && cause.contains(&format!("knows {known}")), "{cause}");
}
