//! Broken input of every kind, as a user meets it: one line with file, line and field, exit code 1, nothing
//! overwritten. Byte-order marks and CR LF are no defects: such files are read as the others.

use crate::harness::backseat;
use hil_sim::scenario::Scenario;
use std::fs;
use std::path::Path;
use std::process::Output;

/// What is there before and must be there after.
const KEPT: &str = "a result of before\n";

/// A format: a good file, and what breaks it.
struct Kind {
    /// Name of the file under test.
    file: &'static str,
    /// Its content.
    good: String,
    /// The command; `result.toml` exists and may be replaced by a success.
    command: &'static [&'static str],
    /// (what, broken content, parts of the complaint)
    broken: Vec<(&'static str, Vec<u8>, Vec<String>)>,
}

/// A table of numbers with a good header and rows, and the columns to break.
struct Table {
    file: &'static str,
    separator: char,
    header: &'static str,
    row: fn(u32) -> String,
    /// Needed columns: that of the time, and one of numbers.
    time: &'static str,
    number: &'static str,
    /// How the number's column would be called in another unit.
    other_unit: &'static str,
    command: &'static [&'static str],
}

const DIAGNOSE: &[&str] = &["diagnose", "FILE", "--out", "result.toml", "--force"];

const TABLES: [Table; 8] = [
    Table {
        file: "vehicle.csv",
        separator: ',',
        header: "t_s,depth_m,roll_rad,pitch_rad,heading_rad",
        row: |k| format!("{k},1.5,0.01,0.02,0.5"),
        time: "t_s",
        number: "depth_m",
        other_unit: "depth_ft",
        command: DIAGNOSE,
    },
    Table {
        file: "truth.csv",
        separator: ',',
        header: "t_s,x_m,y_m,heading_rad",
        row: |k| format!("{k},1,2,0.5"),
        time: "t_s",
        number: "x_m",
        other_unit: "x_ft",
        command: &["navigate", "log.csv", "--truth", "FILE", "--out", "result.toml", "--force"],
    },
    Table {
        file: "uvc.log",
        separator: ';',
        header: "Latitude;Longitude;Time;Date;C True Heading;DFS Depth (m);Vehicle Speed (kn);",
        row: |k| format!("25.9;-80.1;12:00:{:02}.00;10/7/2022;90;0.1;2;", k % 60),
        time: "Time",
        number: "Vehicle Speed (kn)",
        other_unit: "Vehicle Speed (mph)",
        command: DIAGNOSE,
    },
    Table {
        file: "renamed.csv",
        separator: ',',
        header: "t_s,north_m,east_m,heading_true_deg,speed_log_mps",
        row: |k| format!("{k},0,{k},90,1"),
        time: "t_s",
        number: "speed_log_mps",
        other_unit: "speed_log_kn",
        command: DIAGNOSE,
    },
    Table {
        file: "pings.csv",
        separator: ',',
        header: "t_rx_s,north_m,east_m,speed_mps,heading_true_deg",
        row: |k| format!("{k},3,4,1,90"),
        time: "t_rx_s",
        number: "north_m",
        other_unit: "north_ft",
        command: DIAGNOSE,
    },
    Table {
        file: "lake.csv",
        separator: ',',
        header: "t_s,north_m,east_m,yaw_enu_rad,dvl_fwd_mps,dvl_left_mps,dvl_up_mps",
        row: |k| format!("{k},3,4,1,1,0,0"),
        time: "t_s",
        number: "dvl_fwd_mps",
        other_unit: "dvl_fwd_kn",
        command: DIAGNOSE,
    },
    Table {
        file: "glider.csv",
        separator: ',',
        header: "t_s,pitch_rad,battpos_in,ballast_cc,depth_m",
        row: |k| format!("{k},-0.4,0.3,-230,10"),
        time: "t_s",
        number: "pitch_rad",
        other_unit: "pitch_deg",
        command: DIAGNOSE,
    },
    Table {
        file: "mapped.csv",
        separator: ';',
        header: "clock;Tiefe;Kurs",
        row: |k| format!("{};-3;270", 1000 * k),
        time: "clock",
        number: "Tiefe",
        other_unit: "Tiefe [ft]",
        command: &["diagnose", "FILE", "--columns", "map.toml", "--out", "result.toml", "--force"],
    },
];

const MAP: &str = "separator = \";\"\n[time]\ncolumn = \"clock\"\nunit = \"ms\"\n\
    [columns.depth_m]\ncolumn = \"Tiefe\"\nunit = \"m\"\nsign = -1\n\
    [columns.heading_rad]\ncolumn = \"Kurs\"\nunit = \"deg\"\nscale = 1.0\n";
const MISSION: &str = "[mission]\n[[mission.waypoints]]\nx_m = 10.0\ny_m = 0.0\ndepth_m = 3.0\nspeed_mps = 1.0\n";
const LOG: &str = "t_s,gps_x_m,gps_y_m,heading_rad,speed_log_mps\n0,0,0,0,1\n1,1,0,0,1\n2,2,0,0,1\n";

impl Table {
    fn cells(&self, line: &str) -> Vec<String> {
        line.split(self.separator).map(str::to_owned).collect()
    }

    fn place(&self, column: &str) -> usize {
        self.cells(self.header).iter().position(|name| name == column).unwrap()
    }

    fn lines(&self) -> Vec<String> {
        std::iter::once(self.header.to_owned()).chain((0..5).map(self.row)).collect()
    }

    /// The file with the cell of `column` in `line` (from 1) replaced.
    fn with(&self, line: usize, column: &str, cell: &str) -> Vec<u8> {
        let mut lines = self.lines();
        let mut cells = self.cells(&lines[line - 1]);
        cells[self.place(column)] = cell.to_owned();
        lines[line - 1] = cells.join(&self.separator.to_string());
        text(&lines)
    }

    fn kind(&self) -> Kind {
        let (number, time, file) = (self.number, self.time, self.file);
        let (lines, separator) = (self.lines(), self.separator);
        let at = |line: usize, column: &str| format!("{file}:{line}:{}: ", self.place(column) + 1);
        let in_cell = |line: usize, column: &str| vec![at(line, column), column.to_owned()];
        let mut swapped = lines.clone();
        swapped.swap(2, 5);
        let mut short = lines.clone();
        short[3] = self.cells(&lines[3])[0].clone();
        let mut long = lines.clone();
        long[3] += &format!("{separator}1{separator}2");
        let mut repeated = lines.clone();
        for line in &mut repeated {
            let cell = self.cells(line)[self.place(number)].clone();
            line.push_str(&format!("{separator}{cell}"));
        }
        let first_half = &self.header[..self.header.find(number).unwrap_or(5).min(self.header.len() / 2)];
        let mut bytes = self.with(4, number, "#");
        let place = bytes.iter().position(|byte| *byte == b'#').unwrap();
        bytes[place] = 0xff;
        let renamed_time = self.with(1, time, "zeit");
        let broken = vec![
            ("column missing", self.with(1, number, "other"), vec![format!("{file}:"), String::new()]),
            ("time missing", renamed_time, vec![format!("{file}:1:")]),
            ("text in a number", self.with(3, number, "deep"), in_cell(3, number)),
            ("time going back", text(&swapped), vec![at(4, time), time.to_owned(), "before".to_owned()]),
            ("not a number", self.with(4, number, "inf"), in_cell(4, number)),
            ("beyond any number", self.with(4, number, "1e999"), in_cell(4, number)),
            ("text in the time", self.with(4, time, "noon"), in_cell(4, time)),
            ("no time", self.with(4, time, ""), in_cell(4, time)),
            ("another unit", self.with(1, number, self.other_unit), vec![format!("{file}:1:")]),
            ("cut off in the header", first_half.as_bytes().to_vec(), vec![format!("{file}:")]),
            ("empty", Vec::new(), vec![format!("{file}:")]),
            ("a header alone", text(&lines[..1]), vec![format!("{file}: no rows")]),
            ("a row too short", text(&short), vec![format!("{file}:4: "), "cells where the header has".to_owned()]),
            ("a row too long", text(&long), vec![format!("{file}:4: "), "cells where the header has".to_owned()]),
            ("the same name twice", text(&repeated), vec![format!("{file}:1:"), format!("{number} appears twice")]),
            ("no text", bytes, in_cell(4, number)),
            ("a cell of half a megabyte", self.with(3, number, &"9".repeat(1 << 19)), in_cell(3, number)),
            (
                "a line of a megabyte",
                self.with(3, number, &"9".repeat(1 << 20)),
                vec![file.to_owned(), "a line is longer than 1024 KiB".to_owned()],
            ),
        ];
        // A vehicle log needs no column but the time: without its depth it is one without depth.
        let is_free = |what: &&str| matches!(file, "vehicle.csv") && *what == "column missing";
        let broken = broken.into_iter().filter(|(what, ..)| !is_free(what)).collect();
        Kind { file, good: String::from_utf8(text(&lines)).unwrap(), command: self.command, broken }
    }
}

fn text(lines: &[String]) -> Vec<u8> {
    (lines.join("\n") + "\n").into_bytes()
}

/// A text file broken by replacements: (what, from, to, parts of the complaint).
fn replaced(
    good: &str,
    file: &str,
    cases: &[(&'static str, &str, &str, &[&str])],
) -> Vec<(&'static str, Vec<u8>, Vec<String>)> {
    cases
        .iter()
        .map(|(what, from, to, parts)| {
            assert!(good.contains(from), "{file}: {what}: {from}");
            let parts = parts.iter().map(|part| part.replace("FILE", file)).collect();
            (*what, good.replacen(from, to, 1).into_bytes(), parts)
        })
        .collect()
}

fn texts() -> Vec<Kind> {
    let vehicle = include_str!("../../logs/vehicles/iver3.toml");
    let line = |part: &str| vehicle.lines().position(|line| line.starts_with(part)).unwrap() + 1;
    let [mass, drag, cp] = ["mass_kg", "quadratic_diag", "cp_m"].map(|part| format!("FILE:{}:", line(part)));
    let mut kinds = vec![
        Kind {
            file: "map.toml",
            good: MAP.to_owned(),
            command: &["diagnose", "mapped.csv", "--columns", "FILE", "--out", "result.toml", "--force"],
            broken: replaced(
                MAP,
                "map.toml",
                &[
                    ("unknown unit", "unit = \"m\"", "unit = \"furlong\"", &["FILE:7:8: ", "columns.depth_m.unit"]),
                    (
                        "unit of another quantity",
                        "unit = \"deg\"",
                        "unit = \"kn\"",
                        &["FILE:11:8: ", "columns.heading_rad.unit"],
                    ),
                    ("unknown column of the log", "depth_m", "depth", &["FILE:5:", "columns.depth"]),
                    ("unknown key", "sign = -1", "sine = -1", &["FILE:8:1: ", "sine"]),
                    ("sign of two", "sign = -1", "sign = -2", &["FILE:8:8: ", "columns.depth_m.sign"]),
                    ("text in a number", "sign = -1", "sign = \"minus\"", &["FILE:8:8: "]),
                    ("not a number", "scale = 1.0", "scale = nan", &["FILE:12:9: ", "columns.heading_rad.scale"]),
                    ("a scale of nothing", "scale = 1.0", "scale = 0.0", &["FILE:12:9: ", "columns.heading_rad.scale"]),
                    ("beyond any number", "scale = 1.0", "scale = 1e999", &["FILE:12:9: "]),
                    ("no time", "[time]\ncolumn = \"clock\"\nunit = \"ms\"\n", "", &["FILE:", "time"]),
                    ("no column name", "column = \"Kurs\"\n", "", &["FILE:9:1: ", "column"]),
                    ("the same key twice", "sign = -1", "sign = -1\nsign = 1", &["FILE:9:1: "]),
                    ("cut off", "unit = \"deg\"\nscale = 1.0\n", "unit = \"de", &["FILE:11:"]),
                    ("unknown time base", "unit = \"ms\"", "base = \"noon\"", &["FILE:4:8: ", "time.base"]),
                ],
            ),
        },
        Kind {
            file: "v.toml",
            good: vehicle.to_owned(),
            command: &["navigate", "log.csv", "--vehicle", "FILE", "--out", "result.toml", "--force"],
            broken: replaced(
                vehicle,
                "v.toml",
                &[
                    ("key missing", "mass_kg = 38.0", "# none", &["FILE:5:", "lacks mass_kg"]),
                    ("unknown key", "mass_kg = 38.0", "mass_lb = 83.8", &["FILE:", "mass_lb"]),
                    ("text in a number", "mass_kg = 38.0", "mass_kg = \"heavy\"", &[&mass, "mass_kg"]),
                    ("not a number", "mass_kg = 38.0", "mass_kg = nan", &[&mass, "vehicle.mass_kg"]),
                    ("beyond any number", "mass_kg = 38.0", "mass_kg = 1e999", &[&mass, "vehicle.mass_kg"]),
                    ("out of range", "mass_kg = 38.0", "mass_kg = -1.0", &[&mass, "vehicle.mass_kg: -1 is outside"]),
                    ("the same key twice", "mass_kg = 38.0", "mass_kg = 38.0\nmass_kg = 38.0", &["FILE:"]),
                    ("section missing", "[drag]", "[drugs]", &["FILE:", "drugs"]),
                    ("too few values", "[3.0, 170.0, 170.0,", "[3.0, 170.0,", &[&drag, "drag.quadratic_diag"]),
                    ("a table for a number", "[[-0.85, 0.0, -0.13],", "[[-0.85, true, -0.13],", &[&cp, "fins.cp_m"]),
                    ("cut off", "names = [\"top\"", "names = [\"to", &["FILE:"]),
                ],
            ),
        },
        Kind {
            file: "mission.toml",
            good: MISSION.to_owned(),
            command: &["mission", "put", "no-such-port", "FILE"],
            broken: replaced(
                MISSION,
                "mission.toml",
                &[
                    ("key missing", "depth_m = 3.0\n", "", &["FILE:2:1: ", "depth_m"]),
                    ("another unit", "depth_m = 3.0", "depth_ft = 9.8", &["FILE:5:1: ", "depth_ft"]),
                    ("text in a number", "x_m = 10.0", "x_m = \"far\"", &["FILE:3:7: ", "x_m"]),
                    ("not a number", "x_m = 10.0", "x_m = nan", &["FILE:"]),
                    ("beyond any number", "x_m = 10.0", "x_m = 1e999", &["FILE:"]),
                    (
                        "no waypoint",
                        "[[mission.waypoints]]\nx_m = 10.0\ny_m = 0.0\ndepth_m = 3.0\nspeed_mps = 1.0\n",
                        "",
                        &["FILE"],
                    ),
                    ("the same key twice", "y_m = 0.0", "x_m = 0.0", &["FILE:4:1: "]),
                    ("no mission", "[mission]\n[[mission.waypoints]]", "[[waypoints]]", &["FILE:"]),
                    ("cut off", "speed_mps = 1.0\n", "speed_mps = ", &["FILE:6:"]),
                    ("no table", "[[mission.waypoints]]", "[[mission.waypoints]", &["FILE:2:"]),
                    ("backwards", "speed_mps = 1.0", "speed_mps = -1.0", &["FILE:"]),
                ],
            ),
        },
    ];
    for kind in &mut kinds {
        let file = kind.file;
        kind.broken.push(("empty", Vec::new(), vec![format!("{file}:")]));
        kind.broken.push(("no text", b"[time]\nx = \"\xff\"\n".to_vec(), vec![format!("{file}:")]));
    }
    kinds
}

fn run(folder: &Path, kind: &Kind, content: Option<&[u8]>) -> Output {
    match content {
        Some(content) => fs::write(folder.join(kind.file), content).unwrap(),
        None => drop(fs::remove_file(folder.join(kind.file))),
    }
    let args: Vec<_> = kind.command.iter().map(|arg| if *arg == "FILE" { kind.file } else { arg }).collect();
    backseat(folder, &args)
}

/// A folder with all that the commands need beside the file under test.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, content: &str| fs::write(folder.path().join(name), content).unwrap();
    write("result.toml", KEPT);
    write("log.csv", LOG);
    write("map.toml", MAP);
    let mapped = TABLES.iter().find(|table| table.file == "mapped.csv").unwrap();
    write("mapped.csv", &mapped.kind().good);
    folder
}

#[test]
fn every_broken_file_ends_in_one_line() {
    let kinds: Vec<Kind> = TABLES.iter().map(Table::kind).chain(texts()).collect();
    let mut failures = Vec::new();
    for kind in &kinds {
        let folder = folder();
        assert!(kind.broken.len() >= 10, "{}: {} variants", kind.file, kind.broken.len());
        let missing = ("no file", None, vec![format!("{}: No such file", kind.file)]);
        let broken = kind.broken.iter().map(|(what, content, parts)| (*what, Some(content.as_slice()), parts.clone()));
        for (what, content, parts) in broken.chain([missing]) {
            let output = run(folder.path(), kind, content);
            let printed = String::from_utf8_lossy(&output.stderr).into_owned();
            // What the reader left out, and what it doubts, may stand before the one line.
            let is_aside = |line: &&str| line.starts_with("note: ") || line.starts_with("warning: ");
            let is_one_line = printed.lines().filter(|line| !is_aside(line)).count() == 1 && printed.len() < 1200;
            let is_right = output.status.code() == Some(1)
                && output.stdout.is_empty()
                && is_one_line
                && parts.iter().all(|part| printed.contains(part.as_str()))
                && fs::read_to_string(folder.path().join("result.toml")).unwrap() == KEPT;
            if !is_right {
                let printed: String = printed.chars().take(400).collect();
                failures.push(format!("{}, {what}: {parts:?}\n  {:?} {printed}", kind.file, output.status.code()));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn a_byte_order_mark_and_crlf_are_read_as_nothing() {
    for kind in TABLES.iter().map(Table::kind).chain(texts()) {
        let folder = folder();
        let good = run(folder.path(), &kind, Some(kind.good.as_bytes()));
        let dressed = format!("\u{feff}{}", kind.good.replace('\n', "\r\n"));
        fs::write(folder.path().join("result.toml"), KEPT).unwrap();
        let output = run(folder.path(), &kind, Some(dressed.as_bytes()));
        assert_eq!(output.stderr, good.stderr, "{}: {}", kind.file, String::from_utf8_lossy(&output.stderr));
        assert_eq!(output.status.code(), good.status.code(), "{}", kind.file);
        // What the good file is short of is length, not form: no complaint names a line.
        let printed = String::from_utf8_lossy(&good.stderr).into_owned();
        assert!(!printed.contains(&format!("{}:1", kind.file)), "{}: {printed}", kind.file);
    }
}

/// Where a result cannot be written a command says so before its work: here before it looks for its log.
#[test]
fn a_place_that_takes_no_result_is_told_first() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("file"), KEPT).unwrap();
    for command in [
        "navigate none.csv --out file/track.csv",
        "navigate none.csv --learn file/next.toml",
        "navigate none.csv --report file",
        "identify none.csv --out file/found.toml",
        "identify --plan file/mission.toml --duration 600",
        "diagnose none.csv --out file/found.toml",
        "diagnose none.csv --picture file/picture.svg",
        "diagnose none.csv --report file/why",
        "bench none.csv --out file/noise.toml",
        "map none.csv --out file/map.toml",
        "sim run none.toml --picture file/picture.svg",
        "sim dataset --effect none --seed 1 --hours 20 --out file/set",
        "check none --report file/launch.html",
        "mission get none file/mission.toml",
        "params export none file/board.toml",
    ] {
        let words: Vec<&str> = command.split(' ').collect();
        let complaint = crate::harness::program(folder.path(), &words).complaint(command);
        assert!(complaint.contains("file: is a file; expected a folder"), "{command}: {complaint}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// What comes through a pipe can be read once only: it is refused in one line, and nothing waits.
#[test]
fn a_pipe_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let made = std::process::Command::new("mkfifo").arg(folder.path().join("pipe")).status().unwrap();
    assert!(made.success());
    fs::write(folder.path().join("log.csv"), "t_s,depth_m\n0,1\n1,1\n").unwrap();
    for command in [
        "info pipe",
        "map pipe",
        "navigate pipe",
        "diagnose pipe",
        "identify pipe",
        "bench pipe",
        "export pipe --csv tables",
        "replay pipe",
        "info log.csv --columns pipe",
        "navigate log.csv --vehicle pipe",
        "info /dev/null",
    ] {
        let words: Vec<&str> = command.split(' ').collect();
        let complaint = crate::harness::program(folder.path(), &words).complaint(command);
        assert!(complaint.contains("a pipe or a device, which cannot be read twice: write"), "{command}: {complaint}");
    }
}

#[test]
fn scenarios() {
    let good = include_str!("../../../hil-sim/scenarios/survey.toml");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.toml");
    fs::write(folder.path().join("iver3.toml"), include_str!("../../logs/vehicles/iver3.toml")).unwrap();
    let load = |text: &str| {
        fs::write(&path, text).unwrap();
        Scenario::load(&path)
    };
    assert!(load(good).is_ok(), "{:?}", load(good).err());
    let at = |part: &str| format!("s.toml:{}:", good.lines().position(|line| line.starts_with(part)).unwrap() + 1);
    let cases = [
        ("unknown key", "duration_s = 12_000.0", "duration_min = 200.0", at("duration_s"), "duration_min"),
        ("text in a number", "seed = 1", "seed = \"one\"", at("seed"), "seed"),
        ("not a number", "duration_s = 12_000.0", "duration_s = nan", at("duration_s"), "duration_s"),
        ("beyond any number", "duration_s = 12_000.0", "duration_s = 1e999", at("duration_s"), "duration_s"),
        ("negative", "duration_s = 12_000.0", "duration_s = -1.0", at("duration_s"), "duration_s"),
        ("another unit", "length_m = 1000.0", "length_km = 1.0", at("length_m"), "length_km"),
        ("unknown law", "control_law = \"lqr\"", "control_law = \"magic\"", at("control_law"), "control_law"),
        ("unknown section", "[environment]", "[weather]", at("[environment]"), "weather"),
        ("the same key twice", "seed = 1", "seed = 1\nseed = 2", "s.toml:".to_owned(), "duplicate"),
        ("cut off", "name = \"survey\"", "name = \"surv", at("name"), ""),
        ("no mission", "[mission.lawnmower]", "[lawnmower]", "s.toml:".to_owned(), ""),
    ];
    for (what, from, to, place, part) in cases {
        assert!(good.contains(from), "{what}");
        let error = load(&good.replacen(from, to, 1)).err();
        let printed = error.unwrap_or_else(|| panic!("{what}: accepted")).to_string();
        assert!(
            printed.contains(&place) && printed.contains(part) && printed.lines().count() == 1,
            "{what}: {place} {part}: {printed}"
        );
    }
}
