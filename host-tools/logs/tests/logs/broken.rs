//! Broken vehicle files and logs: one line that names file, line, column and what was expected.

use crate::random::Random;
use backseat_logs::{Log, Truth, VehicleFile};
use std::io::Write;
use std::path::Path;

const REFERENCE: &str = include_str!("../../vehicles/iver3.toml");

/// The complaint about the reference file with `from` replaced by `to`.
fn vehicle(from: &str, to: &str) -> String {
    assert!(REFERENCE.contains(from), "{from}");
    complaint(VehicleFile::parse(&REFERENCE.replacen(from, to, 1), Path::new("v.toml")))
}

fn complaint<T>(result: Result<T, backseat_logs::DataError>) -> String {
    let text = result.err().expect("the input is broken").to_string();
    assert_eq!(text.lines().count(), 1, "{text}");
    text
}

fn log(bytes: &[u8]) -> Result<Log, backseat_logs::DataError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, bytes).unwrap();
    Log::read(&path)
}

#[test]
fn vehicle_files() {
    let line_of = |part: &str| REFERENCE.lines().position(|line| line.contains(part)).unwrap() + 1;
    let at = |part: &str, column: usize| format!("v.toml:{}:{column}: ", line_of(part));
    let cases = [
        ("mass_kg = 38.0", "mas_kg = 38.0", at("\nmass_kg".trim(), 1), "unknown key mas_kg in [vehicle]"),
        ("mass_kg = 38.0", "mass_kg = \"38\"", at("mass_kg = 38.0", 11), "expected a number, found a text"),
        ("mass_kg = 38.0", "mass_kg = -38.0", at("mass_kg = 38.0", 11), "vehicle.mass_kg: -38 is outside"),
        ("mass_kg = 38.0", "mass_kg = nan", at("mass_kg = 38.0", 11), "vehicle.mass_kg: NaN is outside"),
        ("mass_kg = 38.0", "mass_kg = ", at("mass_kg = 38.0", 0), ""),
        ("mass_kg = 38.0 ", "#", at("[vehicle]", 2), "[vehicle] lacks mass_kg (kg)"),
        ("[drag]", "[drags]", at("[drag]", 2), "unknown key drags; expected [vehicle], [inertia]"),
        ("0.2, 20.0, 20.0]", "0.2, 20.0]", at("m_diag =", 10), "inertia.m_diag: expected an array of 6, found 5"),
        ("0.2, 20.0, 20.0]", "-0.2, 20.0, 20.0]", at("m_diag =", 29), "inertia.m_diag[3]: -0.2 is outside"),
        ("-0.85, 0.0, -0.13]", "-0.85, 0.0]", at("cp_m", 9), "fins.cp_m: expected an array of 3, found 2"),
        ("\"top\", \"bottom\"", "\"bottom\", \"top\"", at("names", 10), "in this order"),
        ("depth_m = 0.06", "depth_m = 0.0", at("depth_m = 0.06", 11), "sensors.depth_m: 0 is outside"),
        ("d26 = 0.0", "d26 = 1.0e9", at("d26", 7), "drag.d26: 1000000000 is outside"),
        ("name = \"iver3-ref\"", "name = 3", at("name = \"iver3", 8), "expected a text, found a number"),
    ];
    for (from, to, place, message) in cases {
        let text = vehicle(from, to);
        // Column 0: wherever the TOML parser puts it.
        let place = place.strip_suffix("0: ").unwrap_or(&place);
        assert!(text.starts_with(place), "{to}: expected {place}, got {text}");
        assert!(text.contains(message), "{to}: expected {message}, got {text}");
    }
    assert!(complaint(VehicleFile::parse("", Path::new("v.toml"))).contains("section [vehicle] is missing"));
    assert!(complaint(VehicleFile::parse("vehicle = 3", Path::new("v.toml"))).contains("expected a table"));
    assert!(complaint(VehicleFile::read(Path::new("no such file.toml"))).contains("No such file"));
}

#[test]
fn logs() {
    let cases: [(&str, &str); 17] = [
        ("", "the file is empty"),
        ("t_s,depth_m\n", "no rows after the header"),
        ("depth_m\n1\n", ":1:1: no column t_s"),
        ("t_s;depth_m\n0;1\n", "separated by ;"),
        ("t_s,salinity\n0,1\n", "no known column beside t_s"),
        ("t_s,depth_m,depth_m\n0,1,1\n", ":1:3: column depth_m appears twice"),
        ("t_s,depth_m\n0,deep\n", ":2:2: depth_m: \"deep\" is not a number"),
        ("t_s,depth_m\n0,inf\n", ":2:2: depth_m: \"inf\" is not a finite number; leave the cell empty"),
        ("t_s,depth_m\n0,1\n1,inf\n", ":3:2: depth_m: \"inf\" is not a finite"),
        ("t_s,depth_m\n0,1\n,1\n", ":3:1: t_s: is empty"),
        ("t_s,depth_m\n0,1\n-1,1\n", ":3:1: t_s: -1 is outside"),
        ("t_s,depth_m\n1e300,1\n", ":2:1: t_s:"),
        ("t_s,depth_m\n2,1\n1.5,1\n", ":3:1: t_s: 1.5 is before the 2"),
        ("t_s,depth_m\n0,1\n1\n2,1\n", ":3: 1 cells where the header has 2"),
        ("t_s,depth_m\n0,1,2\n1,1\n", ":2: 3 cells where the header has 2"),
        ("t_s,range_m,tol_s\n1,10,-5\n", "tol_s at t_s 1: -5 is outside"),
        ("t_s,depth_m\n0,\"1\n1,2\n", ":2"),
    ];
    for (content, message) in cases {
        let text = complaint(log(content.as_bytes()));
        assert!(text.contains(message), "{content:?}: expected {message}, got {text}");
    }
    assert!(complaint(log(b"t_s,depth_m\n0,\xff\xfe\n")).contains(":2:2: depth_m: not text"));
    assert!(complaint(log(b"time,\"depth\nm\"\n0,1\n")).contains("found: time, depth\\nm"));
    assert!(complaint(log(b"t_s,depth_m\r\n0,\0\r\n")).contains(":2:2: depth_m"));
    assert!(complaint(Log::read(Path::new("no such log.csv"))).contains("No such file"));
    assert!(!complaint(Log::read(Path::new("."))).is_empty());
}

#[test]
fn compressed_logs() {
    let mut text = String::from("t_s,depth_m\n");
    for second in 0..20_000 {
        text.push_str(&format!("{second},{}\n", f64::from(second).sin()));
    }
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(text.as_bytes()).unwrap();
    let whole = encoder.finish().unwrap();
    assert_eq!(log(&whole).unwrap().rows.len(), 20_000);
    let cut = complaint(log(&whole[..whole.len() / 2]));
    assert!(cut.contains("it was cut off"), "{cut}");
    let mut corrupt = whole.clone();
    corrupt[whole.len() / 2] ^= 0xff;
    assert!(log(&corrupt).is_err());
    assert!(log(&whole[..4]).is_err());
}

/// A file that decompresses to one endless line, or has columns without end, is refused in bounded memory, and says
/// why.
#[test]
fn what_has_no_end_is_refused() {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(b"t_s,depth_m\n0,1\n").unwrap();
    for _ in 0..64 {
        encoder.write_all(&[b'1'; 1 << 16]).unwrap();
    }
    let small = encoder.finish().unwrap();
    assert!(small.len() < 1 << 16);
    let text = complaint(log(&small));
    assert!(text.contains(":3:") && text.contains("a line is longer than 1024 KiB"), "{text}");
    let unclosed = format!("t_s,depth_m\n0,\"1\n{}", "0,1\n".repeat(300_000));
    let text = complaint(log(unclosed.as_bytes()));
    assert!(text.contains("a quotation mark is not closed"), "{text}");
    // quoted line ends, doubled marks and marks in the middle of a cell are none of that
    let quoted = format!("t_s,depth_m,note\n{}", "0,1,\"a \"\"b\"\"\nc\"\n0,1,5\" pipe\n".repeat(100_000));
    assert_eq!(log(quoted.as_bytes()).unwrap().rows.len(), 200_000);
    let wide = format!("t_s{}\n0\n", ",x".repeat(5000));
    let text = complaint(log(wide.as_bytes()));
    assert!(text.contains("5001 columns; at most 4096 are read"), "{text}");
}

#[test]
fn truths() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("truth.csv");
    std::fs::write(&path, "t_s,x_m\n0,1\n").unwrap();
    assert!(complaint(Truth::read(&path)).contains("no column y_m"));
}

#[test]
fn unusual_but_right() {
    let log_of = |text: &str| log(text.as_bytes()).unwrap();
    // Byte-order mark, CRLF, columns in another order, blanks, an unknown column, quotes, a blank line, no last line
    // end.
    let read = log_of("\u{feff}weather,t_s, depth_m \r\nfine,0, 1.5 \r\n\"a, b\",1,\"2.5\"\r\n\r\n,2,");
    assert_eq!(read.rows.len(), 3);
    assert_eq!(read.rows[0].get(backseat_logs::Column::Depth), Some(1.5));
    assert_eq!(read.rows[1].get(backseat_logs::Column::Depth), Some(2.5));
    assert!(read.rows[2].is_empty());
    assert_eq!(read.notes, ["columns not used: weather"]);
    // A run that was interrupted in the middle of a line.
    let read = log_of("t_s,depth_m,roll_rad\n0,1,0\n1,1,0\n2,");
    assert_eq!(read.rows.len(), 2);
    assert!(read.notes[0].contains("line 4, the last, was cut off"), "{:?}", read.notes);
}

#[test]
fn no_damage_ends_in_a_panic() {
    const DAMAGE: &[u8] = b"[]{}=\"'#,.;-+0eExN\n\r\t \0\xc3\xff_";
    let csv = b"t_s,prop_rpm,depth_m,tol_s,range_m\n0,1000,1.5,,\n0.5,,,0.25,100\n1.25,1001,\"2\",,\n".to_vec();
    let mut random = Random(1);
    for _ in 0..400 {
        let mut damaged = [REFERENCE.as_bytes().to_vec(), csv.clone()];
        for text in &mut damaged {
            for _ in 0..=random.below(3) {
                let at = random.below(text.len());
                match random.below(3) {
                    0 => text[at] = DAMAGE[random.below(DAMAGE.len())],
                    1 => text.insert(at, DAMAGE[random.below(DAMAGE.len())]),
                    _ => text.truncate(at.max(1)),
                }
            }
        }
        let text = String::from_utf8_lossy(&damaged[0]);
        if let Err(error) = VehicleFile::parse(&text, Path::new("v.toml")) {
            assert_eq!(error.to_string().lines().count(), 1, "{error}\n{text}");
        }
        if let Err(error) = log(&damaged[1]) {
            assert_eq!(error.to_string().lines().count(), 1, "{error}\n{:?}", damaged[1]);
        }
    }
}
