//! `backseat navigate` as a user runs it.

use crate::harness::{backseat, program};
use backseat_app::LocalFrame;
use backseat_logs::{Column, Log, LogRow, LogWriter, Truth, TruthRow, TruthWriter, VehicleFile};
use hil_sim::rng::{Source, Stream};
use std::path::PathBuf;
use std::process::Output;
use tempfile::TempDir;

/// Three minutes north at 1 m/s and 3 m depth beside a ship that goes east, with plausible noise.
struct Mission {
    folder: TempDir,
}

impl Mission {
    fn new() -> Self {
        let mission = Self { folder: tempfile::tempdir().unwrap() };
        let mut random = Stream::new(1, Source::Study);
        // uniform, within so much of 0
        let mut noise = |most: f64| most * (2.0 * random.uniform() - 1.0);
        let mut log = LogWriter::create(&mission.path("log.csv")).unwrap();
        let mut truth = TruthWriter::create(&mission.path("truth.csv")).unwrap();
        for k in 0..=900_u64 {
            let (time_us, t) = (k * 200_000, k as f64 * 0.2);
            let mut row = LogRow::new(time_us);
            row.set(Column::Depth, 3.0 + noise(0.06));
            row.set_all(Column::DvlU, &[1.0 + noise(0.01), noise(0.01), noise(0.01)]);
            row.set_all(Column::Roll, &[noise(0.01), noise(0.01), noise(0.01)]);
            row.set_all(Column::P, &[noise(0.005), noise(0.005), noise(0.005)]);
            row.set(Column::PropRpm, 1005.0).set_all(Column::FinTop, &[0.0; 4]);
            if k % 5 == 0 {
                row.set_all(Column::ShipGpsX, &[200.0 + noise(0.5), t + noise(0.5)]);
                if t <= 10.0 {
                    row.set_all(Column::GpsX, &[t + noise(1.0), noise(1.0)]);
                }
            }
            if k % 150 == 0 && k > 0 {
                let range = (200.0 - t).hypot(t).hypot(3.0) + noise(0.5);
                let rate = ((t - 200.0) + t) / range;
                let launch = t - range / 1500.0;
                row.set_all(Column::Range, &[range, rate, launch, t, 200.0, launch]);
            }
            log.write(&row).unwrap();
            let mut row = TruthRow { time_us, state: Default::default(), current_mps: [0.0; 2] };
            (row.state[0], row.state[2], row.state[6]) = (t, 3.0, 1.0);
            truth.write(&row).unwrap();
        }
        log.finish().unwrap();
        truth.finish().unwrap();
        mission
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn run(&self, args: &[&str]) -> Output {
        backseat(self.folder.path(), args)
    }

    /// Runs, expects success (3 where the result says that it is not to be trusted), returns the JSON object.
    fn json(&self, args: &[&str]) -> serde_json::Value {
        let output = self.run(&[&["navigate", "log.csv", "--json"], args].concat());
        assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
        let result: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let code = if result["trust"] == "ok" { 0 } else { 3 };
        assert_eq!(output.status.code(), Some(code), "{result}");
        result
    }

    /// Runs, expects failure, returns the one line on stderr that is neither a note nor a warning.
    fn failure(&self, args: &[&str]) -> String {
        let output = self.run(&[&["navigate"], args].concat());
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{text}");
        // these are wrapped, an error is not
        let is_aside = |line: &&str| ["note: ", "warning: ", "  "].iter().any(|start| line.starts_with(start));
        let lines = text.lines().filter(|line| !is_aside(line));
        let [error] = lines.collect::<Vec<_>>()[..] else { panic!("{text}") };
        assert!(error.starts_with("error: "), "{text}");
        error.to_owned()
    }
}

#[test]
fn every_configuration_finds_its_way() {
    let mission = Mission::new();
    let configurations: [&[&str]; 6] = [
        &["--model", "kinematic"],
        &["--model", "dynamic"],
        &["--model", "dynamic", "--no-dvl"],
        &["--no-dvl", "--no-range-rate"],
        &["--no-dvl", "--current"],
        &["--no-dvl", "--packet"],
    ];
    for args in configurations {
        let result = mission.json(&[args, &["--truth", "truth.csv"]].concat());
        // Fixes of 1 m (uniform) for 10 s, then 170 s of 1 m/s: no configuration may lose ten metres.
        let p95_m = result["error"]["p95_m"].as_f64().unwrap();
        assert!(p95_m < 10.0, "{args:?}: {result}");
        assert!((result["final"]["x_m"].as_f64().unwrap() - 180.0).abs() < 10.0, "{args:?}: {result}");
        for key in ["nis", "rejected", "wall_s", "digest"] {
            assert!(!result[key].is_null(), "{key}");
        }
        assert!(result["nis"]["depth"].is_f64());
        assert_eq!(result["nis"].get("dvl").is_some(), !args.contains(&"--no-dvl"));
    }
    assert!(mission.json(&[])["error"].is_null());
    assert_eq!(mission.json(&[])["digest"], mission.json(&[])["digest"]);
}

#[test]
fn results_are_written_once() {
    let mission = Mission::new();
    let args = ["navigate", "log.csv", "--truth", "truth.csv", "--out", "track.csv", "--report", "report"];
    let output = mission.run(&args);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    for part in ["Horizontal error", "x real time", "digest", "report.html", "range_rate"] {
        assert!(text.contains(part), "{part} in {text}");
    }
    let track = Truth::read(&mission.path("track.csv")).unwrap();
    assert!(track.rows.len() > 170);
    let page = std::fs::read_to_string(mission.path("report/report.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("Innovations"));
    assert!(mission.failure(&args[1..]).contains("exists already"));
    assert!(mission.run(&[&args[..], &["--force"]].concat()).status.success());
}

#[test]
fn estimates_have_their_sigma_and_a_short_log_separates_none() {
    let mission = Mission::new();
    let log = ["navigate", "log.csv", "--no-dvl", "--report", "report", "--learn", "next.toml"];
    let output = mission.run(&log);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let row = text.lines().find(|line| line.starts_with("m11 ")).unwrap();
    assert!(row.contains("10.0 %") && row.ends_with("not separable yet"), "{row}");
    // Three minutes on one line at one speed show a trim or two.
    assert!(text.contains(" of 20 estimates") && text.contains("min after the start"), "{text}");
    let page = std::fs::read_to_string(mission.path("report/report.html")).unwrap();
    assert!(page.contains(" of 20 estimates") && page.contains("not separable yet"));
    let log = std::fs::read_to_string(mission.path("log.csv")).unwrap();
    std::fs::write(mission.path("short.csv"), log.lines().take(6).collect::<Vec<_>>().join("\n") + "\n").unwrap();
    let output = mission.run(&["navigate", "short.csv", "--no-dvl"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("too short, or its motion too uniform, to separate any estimate"), "{text}");
    let estimates = mission.json(&["--no-dvl"])["estimates"].clone();
    assert_eq!(estimates["beta5"]["separable"], false);
    assert!(estimates["current_north"]["sigma"].as_f64().unwrap() > 0.0);
    assert!(mission.json(&["--model", "nominal"])["estimates"].is_null());

    // The next dive starts from it.
    let next = VehicleFile::read(&mission.path("next.toml")).unwrap();
    assert_eq!((next.learnt.dives, next.parameters), (1, VehicleFile::reference().parameters));
    let first = mission.json(&["--no-dvl"]);
    let second = mission.json(&["--no-dvl", "--vehicle", "next.toml"]);
    let sigma = |run: &serde_json::Value, name: &str| run["estimates"][name]["sigma"].as_f64().unwrap();
    assert!(sigma(&second, "beta5") < sigma(&first, "beta5"));
    assert_ne!(first["digest"], second["digest"]);
    assert!(
        mission.failure(&["log.csv", "--model", "nominal", "--learn", "no.toml"]).contains("--learn: only the robust")
    );
}

#[test]
fn a_prior_that_makes_no_sense_is_refused_where_it_stands() {
    let mission = Mission::new();
    let file = VehicleFile::reference().to_toml("");
    for (from, to, words) in [
        ("current_mps = 0.3", "current_mps = -0.3", "prior.current_mps: -0.3 is outside 0 to 5 (m/s)"),
        ("fin_lag_s = 0.15", "fin_lag_s = nan", "prior.fin_lag_s: NaN is outside 0 to 2 (s)"),
        ("fin_lag_s = 0.15", "", "[prior] lacks fin_lag_s (s): Sigma of the lag of the fins."),
    ] {
        std::fs::write(mission.path("v.toml"), file.replacen(from, to, 1)).unwrap();
        let error = mission.failure(&["log.csv", "--vehicle", "v.toml"]);
        assert!(error.contains("v.toml:") && error.contains(words), "{error}");
    }
    std::fs::write(mission.path("v.toml"), file.replacen("fin_lag_s = 0.15", "fin_lag_s = 0", 1)).unwrap();
    assert!(mission.json(&["--vehicle", "v.toml"])["estimates"].get("fin_lag").is_none(), "known");
}

#[test]
fn a_mapped_table_is_the_same_log() {
    let mission = Mission::new();
    let log = std::fs::read_to_string(mission.path("log.csv")).unwrap();
    let (header, rows) = log.split_once('\n').unwrap();
    let names: Vec<&str> = header.trim_end().split(',').collect();
    let theirs: Vec<String> = (0..names.len()).map(|k| format!("channel {k}")).collect();
    std::fs::write(mission.path("table.csv"), format!("{}\n{rows}", theirs.join(","))).unwrap();
    let mut map = format!("[time]\ncolumn = \"{}\"\nunit = \"s\"\nbase = \"start\"\n", theirs[0]);
    for (name, theirs) in names.iter().zip(&theirs).skip(1) {
        map += &format!("[columns.{name}]\ncolumn = \"{theirs}\"\n");
    }
    std::fs::write(mission.path("map.toml"), map).unwrap();
    let output = mission.run(&["navigate", "table.csv", "--columns", "map.toml", "--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mapped: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(mapped["digest"], mission.json(&[])["digest"]);
    assert!(mission.failure(&["table.csv"]).contains("table.csv"));
}

#[test]
fn a_log_without_actuators_or_dvl_is_dead_reckoned() {
    let mission = Mission::new();
    let rows: String = (0..100).map(|t| format!("{t},{t},0,0.0,1.0\n")).collect();
    std::fs::write(mission.path("uvc.csv"), format!("t_s,north_m,east_m,heading_true_deg,speed_log_mps\n{rows}"))
        .unwrap();
    let output = mission.run(&["navigate", "uvc.csv"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("dead reckoning") && text.contains("GNSS withheld"), "{text}");
    assert!(text.contains("median 0.00 m"), "{text}");
    assert!(mission.failure(&["uvc.csv", "--model", "dynamic"]).contains("needs prop_rpm"));
}

#[test]
fn broken_input_ends_in_one_line() {
    let mission = Mission::new();
    let write = |name: &str, text: &str| std::fs::write(mission.path(name), text).unwrap();
    write("text.csv", "t_s,depth_m\n0,deep\n");
    write("back.csv", "t_s,depth_m\n1,1\n0,1\n");
    write("twice.csv", "t_s,depth_m,depth_m\n1,1,1\n");
    write("empty.csv", "");
    write("nofix.csv", "t_s,roll_rad,pitch_rad,heading_rad\n0,0,0,0\n");
    write("unknown.toml", "[vehicle]\nmass = 3\n");
    write("type.toml", "[vehicle]\nmass_kg = true\n");
    write("syntax.toml", "[vehicle\n");
    write("elsewhere.csv", "t_s,x_m,y_m\n100000,0,0\n");
    std::fs::write(mission.path("cut.csv.gz"), [0x1f, 0x8b, 8, 0, 0]).unwrap();
    let cases: [(&[&str], &str); 13] = [
        (&["none.csv"], "none.csv: No such file"),
        (&["text.csv"], "text.csv:2:2: depth_m"),
        (&["back.csv"], "back.csv:3:1: t_s"),
        (&["twice.csv"], "twice.csv:1:3"),
        (&["empty.csv"], "empty.csv: an empty file"),
        (&["nofix.csv"], "no fix of the vehicle"),
        (&["cut.csv.gz"], "cut.csv.gz"),
        (&["log.csv", "--vehicle", "none.toml"], "none.toml: No such file"),
        (&["log.csv", "--vehicle", "unknown.toml"], "unknown.toml:2:1: unknown key mass"),
        (&["log.csv", "--vehicle", "type.toml"], "type.toml:"),
        (&["log.csv", "--vehicle", "syntax.toml"], "syntax.toml:"),
        (&["log.csv", "--truth", "text.csv"], "no column x_m"),
        (&["log.csv", "--truth", "elsewhere.csv"], "no time in common"),
    ];
    for (args, message) in cases {
        let text = mission.failure(args);
        assert!(text.contains(message), "{args:?}: {text}");
    }
    assert!(
        mission.failure(&["log.csv", "--out", "log.csv/track.csv"]).contains("log.csv: is a file; expected a folder")
    );
    // a folder that lacks is made, as that of a report is
    let output = mission.run(&["navigate", "log.csv", "--out", "new folder/track.csv"]);
    assert!(output.status.code() != Some(1) && mission.path("new folder/track.csv").is_file(), "{output:?}");
}

#[test]
fn usage() {
    let mission = Mission::new();
    for args in [&["navigate"][..], &["navigate", "log.csv", "--model", "magic"], &["fly"]] {
        assert_eq!(mission.run(args).status.code(), Some(2), "{args:?}");
    }
    let help = mission.run(&["navigate", "--help"]);
    assert_eq!(help.status.code(), Some(0));
    assert!(String::from_utf8(help.stdout).unwrap().contains("Examples:"));
    let script = mission.run(&["completions", "bash"]);
    assert!(String::from_utf8(script.stdout).unwrap().contains("navigate"));
}

#[test]
fn the_smoothed_track_is_judged_beside_the_filtered_one() {
    let mission = Mission::new();
    let kinematic = ["--model", "kinematic", "--truth", "truth.csv"];
    let plain = mission.json(&kinematic);
    assert!(plain["smoothed_error"].is_null());
    let smoothed = mission.json(&[&kinematic[..], &["--smooth", "--report", "out"]].concat());
    assert_eq!(smoothed["error"], plain["error"]);
    assert_eq!(smoothed["digest"], plain["digest"]);
    let rms = |error: &serde_json::Value| error["rms_m"].as_f64().unwrap();
    assert!(rms(&smoothed["smoothed_error"]) < rms(&smoothed["error"]), "{smoothed}");
    let page = std::fs::read_to_string(mission.path("out/report.html")).unwrap();
    assert!(page.contains("smoothed"), "the report has a line of the smoothed track");
}

/// A sentence with its checksum.
fn sentence(body: &str) -> String {
    let checksum = body.bytes().fold(0, |sum, byte| sum ^ byte);
    format!("${body}*{checksum:02X}\r\n")
}

/// The ship's log as its receiver and its USBL write it, beside the vehicle's, in place of columns: the same answers.
#[test]
fn val_a_ships_log_with_its_usbl_is_what_columns_are() {
    const START_US: u64 = 1_748_952_000_000_000; // 3 June 2025, 12:00:00 (date -u -d ... +%s)
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let run = |line: &str| program(folder.path(), line.split(' '));
    run("sim dataset --effect none --seed 8 --hours 0.25 --usbl --no-ranges --no-dvl --out set").good("the data set");
    let log = Log::read(&path("set/log.csv")).unwrap();
    let frame = LocalFrame::new(41.5, -70.7);
    let mut vehicle = LogWriter::create(&path("vehicle.csv")).unwrap();
    let mut ship = String::new();
    for row in &log.rows {
        let s = row.time_us as f64 * 1e-6;
        let clock = format!("12{:02}{:07.4}", (s / 60.0) as u32, s % 60.0);
        if let Some(place_m) = row.ship_gnss_m() {
            let (latitude, longitude) = frame.to_geodetic(place_m);
            let minutes = |degrees: f64| (degrees.abs().trunc(), degrees.abs().fract() * 60.0);
            let ((north, north_min), (west, west_min)) = (minutes(latitude), minutes(longitude));
            let place = format!("{north:02}{north_min:010.7},N,{west:03}{west_min:010.7},W");
            ship += &sentence(&format!("GPRMC,{clock},A,{place},0.0,0.0,030625,,,A"));
            ship += &sentence(&format!("GPGGA,{clock},{place},1,11,0.9,2.0,M,-30.0,M,,"));
        }
        if let Some(usbl) = row.usbl() {
            let [north_m, east_m, down_m] = usbl.vector_m();
            let accuracy_m = usbl.angle_sigma_rad * usbl.range_m * 2.0_f64.sqrt();
            let travel_s = (row.arrival_us().unwrap() - row.launch_us().unwrap()) as f64 * 1e-6;
            ship += &sentence(&format!(
                "PSIMSSB,{clock},B01,A,,C,E,M,{east_m:.4},{north_m:.4},{down_m:.4},{accuracy_m:.4},T,{travel_s:.6},"
            ));
        }
        let mut own = LogRow::new(START_US + row.time_us);
        for column in Column::STANDARD.iter().filter(|column| !column.name().starts_with("ship")) {
            if let Some(value) = row.get(*column).filter(|_| row.usbl().is_none()) {
                own.set(*column, value);
            }
        }
        vehicle.write(&own).unwrap();
    }
    vehicle.finish().unwrap();
    std::fs::write(path("ship.nmea"), ship).unwrap();
    let info = run("info ship.nmea").good("info");
    assert!(info.contains("--ship") && info.contains("fixes by USBL of B01"), "{info}");
    let beside = "vehicle.csv --ship ship.nmea --origin 41.5,-70.7 --vehicle set/vehicle.toml --json";
    let [columns, sentences] = ["set/log.csv --vehicle set/vehicle.toml --json", beside].map(|options| {
        let result = run(&format!("navigate {options}")).json();
        let end = [&result["final"]["x_m"], &result["final"]["y_m"]].map(|metres| metres.as_f64().unwrap());
        (result["fused"]["usbl"].as_u64().unwrap(), end)
    });
    assert!(columns.0 > 200 && columns.0 == sentences.0, "{columns:?} {sentences:?}");
    for axis in 0..2 {
        // the range's sigma is not in the sentence
        assert!((columns.1[axis] - sentences.1[axis]).abs() < 1.0, "{columns:?} {sentences:?}");
    }
    let verdict = &run(&format!("diagnose {beside}")).json()["verdict"];
    assert_eq!(verdict, &run("diagnose set/log.csv --vehicle set/vehicle.toml --json").json()["verdict"]);
}
