//! Files made to cost memory or time: each reader stops at a bound, and its complaint states the bound.

use backseat_logs::importers::{self, ColumnMap};
use backseat_logs::{BoardFile, Log, LogRow, VehicleFile};
use flate2::{Compression, write::GzEncoder};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

fn zipped(text: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(text).unwrap();
    encoder.finish().unwrap()
}

/// A bag whose only chunk says that it has `size` bytes, unpacked; without compression it ends within a record.
fn bag(size: u64, compression: Option<mcap::Compression>) -> Vec<u8> {
    let mut file = std::io::Cursor::new(Vec::new());
    let options = mcap::WriteOptions::new().profile("ros2").compression(compression);
    let mut writer = options.create(&mut file).unwrap();
    let schema = writer.add_schema("std_msgs/msg/Float64", "ros2msg", b"").unwrap();
    let channel_id = writer.add_channel(schema, "/rpm", "cdr", &BTreeMap::new()).unwrap();
    let header = mcap::records::MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
    writer.write_to_known_channel(&header, &[0; 12]).unwrap();
    writer.finish().unwrap();
    drop(writer);
    let mut bytes = file.into_inner();
    // magic, header record, chunk record: opcode and length, two times, size
    let header_length = u64::from_le_bytes(bytes[9..17].try_into().unwrap()) as usize;
    let chunk = 8 + 9 + header_length;
    assert_eq!(bytes[chunk], mcap::records::op::CHUNK);
    if size > 0 {
        bytes[chunk + 9 + 16..chunk + 9 + 24].copy_from_slice(&size.to_le_bytes());
    } else {
        // the first record in the chunk, behind the empty name and the length, claims more than there is
        bytes[chunk + 9 + 32 + 8 + 1] = 0xFF;
        bytes[chunk + 9 + 32 + 8 + 2] = 0xFF;
    }
    bytes
}

#[test]
fn every_reader_states_its_limit() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, content: &[u8]| -> PathBuf {
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        path
    };
    let line = [b"t_s,depth_m\n0,".to_vec(), vec![b'0'; 3 << 20]].concat();
    let quoted = [b"t_s,depth_m\n0,\"".to_vec(), b"0\n".repeat(1 << 20)].concat();
    let wide = [b"t_s,depth_m".to_vec(), b",x".repeat(5000), b"\n0,1\n".to_vec()].concat();
    // a megabyte a kilobyte: the bound is on what comes out
    let bomb = zipped(&line);
    assert!(bomb.len() < 10_000, "{}", bomb.len());
    let nested = format!("[vehicle]\nname = {}1{}\n", "[".repeat(100_000), "]".repeat(100_000));
    let long = "# a comment\n".repeat(2 << 20);
    let log = |path: &Path| Log::read(path).map(drop);
    let any = |path: &Path| importers::read(path).map(drop);
    let map =
        ColumnMap::parse("[time]\ncolumn = \"t_s\"\n[columns.depth_m]\ncolumn = \"depth_m\"\n", Path::new("m.toml"));
    let map = map.unwrap();
    let mapped = |path: &Path| importers::read_mapped(path, &map).map(drop);
    let vehicle = |path: &Path| VehicleFile::read(path).map(drop);
    let board = |path: &Path| BoardFile::read(path).map(drop);
    let mapping = |path: &Path| ColumnMap::read(path).map(drop);
    type Reader<'a> = &'a dyn Fn(&Path) -> Result<(), backseat_logs::DataError>;
    let cases: [(PathBuf, Reader, &str); 15] = [
        (write("line.csv", &line), &log, "a line is longer than 1024 KiB"),
        (write("line2.csv", &line), &mapped, "a line is longer than 1024 KiB"),
        (write("bomb.csv.gz", &bomb), &log, "a line is longer than 1024 KiB"),
        (write("quoted.csv", &quoted), &any, "longer than 1024 KiB; a quotation mark is not closed"),
        (write("wide.csv", &wide), &log, "5002 columns; at most 4096"),
        (write("wide2.csv", &wide), &mapped, "5002 columns; at most 4096"),
        (write("alog.alog", &[b"%%\n".to_vec(), vec![b'1'; 3 << 20]].concat()), &any, "longer than 1024 KiB"),
        (write("nmea.txt", &[b"$GPRMC,".to_vec(), vec![b'1'; 3 << 20]].concat()), &any, "longer than 1024 KiB"),
        (write("nested.toml", nested.as_bytes()), &vehicle, "max recursion depth"),
        (write("nested2.toml", nested.as_bytes()), &mapping, "max recursion depth"),
        (write("long.toml", long.as_bytes()), &vehicle, "more than 16 MiB"),
        (write("long2.toml", long.as_bytes()), &board, "more than 16 MiB"),
        (write("long3.toml", long.as_bytes()), &mapping, "more than 16 MiB"),
        (
            write("bag.mcap", &bag(1 << 40, Some(mcap::Compression::Lz4))),
            &any,
            "a chunk of 1099511627776 bytes; at most 268435456 are read",
        ),
        (write("bag2.mcap", &bag(0, None)), &any, "a broken chunk"),
    ];
    let mut failures = Vec::new();
    for (path, read, bound) in cases {
        let name = path.file_name().unwrap().to_str().unwrap();
        let error = read(&path).err().map_or_else(String::new, |error| error.to_string());
        let is_told = error.contains(name) && error.contains(bound) && error.lines().count() == 1 && error.len() < 600;
        if !is_told {
            failures.push(format!("{name}: {bound}: {}", error.chars().take(300).collect::<String>()));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// A command that keeps much of each row takes the first ones, and says which.
#[test]
fn the_first_rows_are_kept_and_the_others_told() {
    let mut log = Log { rows: (0..50).map(|k| LogRow::new(k * 100_000)).collect(), ..Log::default() };
    log.keep_first(50);
    assert!(log.notes.is_empty());
    log.keep_first(11);
    assert_eq!(log.rows.len(), 11);
    assert_eq!(log.notes, ["only the first 11 of 50 rows are used, 1 of 5 s: cut the file for another part"]);
}
