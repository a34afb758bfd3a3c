//! `backseat info`, and the same examination at the start of the commands that read a log: what a wrong unit ends in.

use crate::harness::{backseat, text};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;

/// Two minutes of a simulated survey, with attitude and rates times `angle` and times times `time`.
fn survey(folder: &Path, name: &str, angle: f64, time: f64) {
    if !folder.join("flight/log.csv").exists() {
        let output = backseat(folder, &["sim", "run", "--minutes", "4", "--seed", "3", "--out", "flight", "--json"]);
        assert!(output.status.success(), "{}", text(&output.stderr));
    }
    let log = std::fs::read_to_string(folder.join("flight/log.csv")).unwrap();
    let mut lines = log.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let attitude = ["roll_rad", "pitch_rad", "heading_rad"];
    let scaled = |line: &str| {
        let cells = line.split(',').zip(&header).map(|(cell, name)| {
            let factor = if attitude.contains(name) {
                angle
            } else if *name == "t_s" {
                time
            } else {
                1.0
            };
            match cell.parse::<f64>() {
                Ok(value) if factor != 1.0 => (value * factor).to_string(),
                _ => cell.to_owned(),
            }
        });
        cells.collect::<Vec<_>>().join(",")
    };
    let rows: Vec<String> = std::iter::once(header.join(",")).chain(lines.map(scaled)).collect();
    std::fs::write(folder.join(name), rows.join("\n") + "\n").unwrap();
}

#[test]
fn the_lines_that_mend_are_a_mapping_by_themselves() {
    let folder = tempfile::tempdir().unwrap();
    survey(folder.path(), "deg.csv", 180.0 / std::f64::consts::PI, 1.0);
    let output = backseat(folder.path(), &["info", "deg.csv", "--json"]);
    assert_eq!(output.status.code(), Some(3), "{}", text(&output.stdout));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let lines: Vec<&str> = json["findings"].as_array().unwrap().iter().filter_map(|f| f["mend"].as_str()).collect();
    std::fs::write(folder.path().join("mend.toml"), lines.join("\n")).unwrap();
    let output = backseat(folder.path(), &["info", "deg.csv", "--columns", "mend.toml"]);
    assert_eq!(output.status.code(), Some(0), "{lines:?} {}{}", text(&output.stdout), text(&output.stderr));
}

/// Of a column that a mapping turned, the line turns it back.
#[test]
fn lines_that_mend_a_mapping_are_those_of_the_table() {
    let folder = tempfile::tempdir().unwrap();
    let dive = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/guide/samples/dive.csv.gz");
    let map = folder.path().join("map.toml");
    std::fs::write(&map, "columns.pitch_rad = { column = \"pitch_rad\", sign = -1 }\n").unwrap();
    let info = || backseat(folder.path(), &["info", dive, "--columns", "map.toml", "--json"]);
    let json: Value = serde_json::from_slice(&info().stdout).unwrap();
    let mends: Vec<&str> = json["findings"].as_array().unwrap().iter().filter_map(|f| f["mend"].as_str()).collect();
    assert_eq!(mends, ["columns.pitch_rad = { column = \"pitch_rad\" }"]);
    std::fs::write(&map, mends[0]).unwrap();
    let output = info();
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stdout));
}

#[test]
fn a_good_log_is_usable_and_trusted() {
    let folder = tempfile::tempdir().unwrap();
    survey(folder.path(), "log.csv", 1.0, 1.0);
    let output = backseat(folder.path(), &["info", "log.csv", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stdout));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (json["verdict"].as_str(), json["uses"]["navigate"]["possible"].as_bool()),
        (Some("usable"), Some(true))
    );
    let depth = json["columns"].as_array().unwrap().iter().find(|column| column["name"] == "depth_m").unwrap();
    // the scenario's depth sensor gives seven samples a second, at whole hundredths of one
    assert!((depth["rate_hz"].as_f64().unwrap() - 7.0).abs() < 0.2, "{depth}");
    let printed = text(&backseat(folder.path(), &["info", "log.csv"]).stdout);
    assert!(printed.starts_with("log.csv: usable\n") && printed.lines().all(|line| line.len() <= 120), "{printed}");
    let output = backseat(folder.path(), &["navigate", "log.csv", "--no-dvl", "--json"]);
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((output.status.code(), json["trust"].as_str()), (Some(0), Some("ok")), "{json}");
    assert_eq!(text(&output.stderr), "");
}

#[test]
fn attitude_in_degrees_and_time_in_milliseconds_are_not_trusted() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    survey(at, "degrees.csv", 180.0 / std::f64::consts::PI, 1.0);
    survey(at, "ms.csv", 1.0, 1000.0);
    for (log, part) in [("degrees.csv", "is it in degrees?"), ("ms.csv", "is the time in milliseconds?")] {
        let output = backseat(at, &["info", log]);
        let printed = text(&output.stdout);
        assert_eq!(output.status.code(), Some(3), "{printed}");
        // lines are no wider than a terminal
        let words = printed.split_whitespace().collect::<Vec<_>>().join(" ");
        let (reasons, _) = words.split_once(&format!("{log}: suspicious ")).unwrap_or_default();
        assert!(reasons.starts_with("DO NOT TRUST: ") && reasons.contains(part), "{printed}");
    }
    for command in ["navigate", "identify", "diagnose"] {
        let output = backseat(at, &[command, "degrees.csv", "--json", "--report", "refused"]);
        let json: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!((output.status.code(), json["refused"].as_bool()), (Some(3), Some(true)), "{command}: {json}");
        let mend = json["findings"][0]["mend"].as_str().unwrap();
        assert!(mend.contains("unit = \"deg\""), "{mend}");
    }
    assert!(!at.join("refused").exists());
    let output = backseat(at, &["navigate", "degrees.csv", "--no-dvl", "--json", "--report", "out", "--force"]);
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((output.status.code(), json["trust"].as_str()), (Some(3), Some("suspicious")), "{json}");
    assert!(text(&output.stderr).contains("warning: degrees.csv: heading_rad"), "{}", text(&output.stderr));
    assert!(std::fs::read_to_string(at.join("out/report.html")).unwrap().contains("Do not trust this result"));
}

/// What is no log at all is told by every command, in one line.
#[test]
fn what_is_no_log_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::create_dir(at.join("dive")).unwrap();
    std::fs::write(at.join("dive/metadata.yaml"), "rosbag2_bagfile_information:\n").unwrap();
    std::fs::write(at.join("chart.png"), b"\x89PNG\r\n\x1a\n\0\0").unwrap();
    std::fs::write(at.join("report.pdf"), "%PDF-1.7\n").unwrap();
    std::fs::write(at.join("logs.zip"), b"PK\x03\x04\x14\0").unwrap();
    std::fs::write(at.join("survey.toml"), include_str!("../../../hil-sim/scenarios/survey.toml")).unwrap();
    for (file, what) in [
        ("dive", "folder"),
        ("chart.png", "a picture"),
        ("report.pdf", "a document"),
        ("logs.zip", "an archive"),
        ("survey.toml", "a scenario, not a log (`backseat sim run FILE` flies it"),
    ] {
        for command in ["info", "map", "navigate", "identify", "diagnose"] {
            if file == "survey.toml" && ["info", "map"].contains(&command) {
                continue; // of use to the first; the second takes tables only
            }
            let output = backseat(at, &[command, file]);
            let said = text(&output.stderr);
            assert_eq!(output.status.code(), Some(1), "{command} {file}: {said}");
            assert!(said.contains(what) && said.lines().count() == 1, "{command} {file}: {said}");
        }
    }
}

#[test]
fn other_files_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    survey(at, "log.csv", 1.0, 1.0);
    std::fs::write(at.join("v.toml"), include_str!("../../logs/vehicles/iver3.toml")).unwrap();
    std::fs::write(at.join("m.toml"), "[time]\ncolumn = \"t\"\n[columns.depth_m]\ncolumn = \"z\"\n").unwrap();
    std::fs::write(at.join("iver3.toml"), include_str!("../../logs/vehicles/iver3.toml")).unwrap();
    std::fs::write(at.join("s.toml"), include_str!("../../../hil-sim/scenarios/survey.toml")).unwrap();
    std::fs::write(at.join("ship.toml"), include_str!("../../logs/examples/topside.toml")).unwrap();
    let waypoint = "[[mission.waypoints]]\nx_m = 10.0\ny_m = 0.0\ndepth_m = 3.0\nspeed_mps = 1.0\n";
    std::fs::write(at.join("mission.toml"), waypoint).unwrap();
    for (file, what, next) in [
        ("flight/session.mcap", "session or board log", "backseat export"),
        ("flight/truth.csv", "truth", "backseat navigate LOG --truth"),
        ("v.toml", "vehicle file", "backseat vehicle check"),
        ("m.toml", "column mapping", "backseat info LOG --columns"),
        ("s.toml", "scenario", "backseat sim run"),
        ("mission.toml", "mission", "backseat mission put"),
        ("ship.toml", "configuration of topside", "backseat topside"),
    ] {
        let output = backseat(at, &["info", file]);
        let printed = text(&output.stdout);
        assert!(
            output.status.success() && printed.starts_with(&format!("{file}: {what}\n")) && printed.contains(next),
            "{printed}{}",
            text(&output.stderr)
        );
    }
    // broken, each is told by its own reader; what is none of them by name
    for (file, from, to, complaint) in [
        ("s.toml", "duration_s = 12_000.0", "duration_min = 200.0", "duration_min"),
        ("mission.toml", "depth_m", "depth_ft", "mission.toml:4:1: "),
        ("ship.toml", "[ports]", "[port]", "ship.toml:"),
        ("v.toml", "mass_kg", "mass_lb", "mass_lb"),
        ("m.toml", "", "[package]\nname = \"x\"\n", "none of the files that a command takes: vehicle file, scenario"),
    ] {
        let good = std::fs::read_to_string(at.join(file)).unwrap();
        assert!(good.contains(from), "{file}: {from}");
        std::fs::write(at.join(file), if from.is_empty() { to.to_owned() } else { good.replacen(from, to, 1) })
            .unwrap();
        let output = backseat(at, &["info", file]);
        let printed = text(&output.stderr);
        assert!(
            output.status.code() == Some(1) && printed.contains(complaint) && printed.lines().count() == 1,
            "{printed}"
        );
    }
    assert_eq!(backseat(at, &["info", "nothing.csv"]).status.code(), Some(1));
}

/// What `info` says of a log is what the commands do with it.
#[test]
fn uses_are_those_of_the_commands() {
    let folder = tempfile::tempdir().unwrap();
    let uses = |table: &str| {
        std::fs::write(folder.path().join("log.csv"), table).unwrap();
        let output = backseat(folder.path(), &["info", "log.csv", "--json"]);
        let json: Value = serde_json::from_slice(&output.stdout).unwrap();
        ["identify", "diagnose"].map(|command| json["uses"][command]["how"].as_str().unwrap_or_default().to_owned())
    };
    let [_, diagnose] = uses("t_s,vx_mps,vy_mps,cmd_left,cmd_right\n0,0,0,1,1\n1,0.5,0,1,1\n");
    assert!(diagnose.contains("cargo lab single-log"), "{diagnose}");
    let printed = text(&backseat(folder.path(), &["info", "log.csv"]).stdout);
    assert!(printed.ends_with("In a clone of the repository:\n  cargo lab single-log log.csv\n"), "{printed}");
    let found = backseat(folder.path(), &["diagnose", "log.csv", "--force"]);
    assert!(text(&found.stderr).contains("cargo lab single-log"), "{}", text(&found.stderr));
    // a ship with fixes is dead reckoning too, its rudder left out; with too few of them its model alone is left
    let ship = |seconds: usize| {
        let header = "t [s],x_position_mid [m],y_position_mid [m],u_velo [m/s],vm_velo [m/s],psi_hat [rad],\
                      r_angvelo [rad/s],n_prop [rps],delta_rudder [rad],wind_velo_true [m/s],wind_dir_true [rad]\n";
        let row = |t: usize| format!("{t},{t},{},1,0,0.1,0,5,0.1,2,0\n", 0.1 * t as f64);
        header.to_owned() + &(0..seconds).map(row).collect::<String>()
    };
    assert_eq!(uses(&ship(80))[1], "against dead reckoning from fix to fix");
    assert!(uses(&ship(40))[1].contains("cargo lab single-log"));
    // a whole vehicle that lacks its DVL is no vessel on the surface
    let [identify, _] = uses(
        "t_s,prop_rpm,fin_top_rad,fin_bottom_rad,fin_port_rad,fin_starboard_rad,roll_rad,pitch_rad,heading_rad,\
         p_radps,q_radps,r_radps,gps_x_m,gps_y_m\n0,900,0,0,0,0,0,0,0,0,0,0,0,0\n1,900,0,0,0,0,0,0,0,0,0,0,1,0\n",
    );
    assert!(identify.contains("lacks dvl_u_mps"), "{identify}");
    // heading and speed for ten minutes: with fixes at both ends alone there is nothing to compare with
    let reckoned = |fix_every: u32| {
        let row = |t: u32| {
            let fix = if t.is_multiple_of(fix_every) { format!("{t},0") } else { ",".to_owned() };
            format!("{t},0.{},1.{},{fix}\n", t % 7, t % 5)
        };
        format!("t_s,heading_rad,speed_log_mps,gps_x_m,gps_y_m\n{}", (0..=600).map(row).collect::<String>())
    };
    for (fix_every, is_possible) in [(10, true), (600, false)] {
        let [_, diagnose] = uses(&reckoned(fix_every));
        assert_eq!(diagnose.contains("against dead reckoning"), is_possible, "{diagnose}");
        let printed = text(&backseat(folder.path(), &["info", "log.csv"]).stdout);
        let next = "\nNext\n  backseat navigate log.csv\n";
        let next = if is_possible { format!("{next}  backseat diagnose log.csv\n") } else { next.to_owned() };
        assert!(printed.ends_with(&next), "{printed}");
        let found = backseat(folder.path(), &["diagnose", "log.csv"]);
        assert_eq!(found.status.code() != Some(1), is_possible, "{}", text(&found.stderr));
    }
}

#[test]
fn a_log_of_no_use_is_told() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("log.csv"), "t_s,depth_m\n0,1\n1,1.5\n").unwrap();
    let output = backseat(folder.path(), &["info", "log.csv"]);
    let printed = text(&output.stdout);
    assert_eq!(output.status.code(), Some(3), "{printed}");
    assert!(printed.starts_with("log.csv: of no use\n"), "{printed}");
    assert!(printed.contains("\nnavigate   no: lacks a fix to start from: gps_x_m"), "{printed}");
    let output = backseat(folder.path(), &["info", "log.csv", "--json"]);
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((json["verdict"].as_str(), output.status.code()), (Some("of no use"), Some(3)), "{json}");
    assert_eq!(json["reasons"].as_array().map(Vec::len), Some(3), "{json}");
    // what a trial leaves beside the vehicle's log has its use
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/guide/samples");
    for (sample, option) in [("trial_ship.nmea.gz", "--ship"), ("trial_modem.log", "--modem")] {
        let output = backseat(&samples, &["info", sample]);
        let printed = text(&output.stdout);
        assert!(output.status.success() && printed.contains(option) && printed.contains(": usable\n"), "{printed}");
    }
}

#[test]
fn quiet_leaves_out_how_the_log_was_read_and_nothing_else() {
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/guide/samples");
    let said =
        |options: &[&str]| text(&backseat(&samples, &[&["info", "iver_survey.csv.gz"], options].concat()).stdout);
    let (all, quiet) = (said(&[]), said(&["--quiet"]));
    assert!(all.contains("; recognised: Latitude") && !quiet.contains("; recognised: Latitude"), "{quiet}");
    assert!(quiet.contains("note: not tested: ") && all.starts_with(quiet.lines().next().unwrap()), "{quiet}");
}

/// A speed of one reading a second in a table of ten rows a second: a remark, which is one of `info`.
#[test]
fn a_remark_is_said_once_and_not_under_quiet() {
    let folder = tempfile::tempdir().unwrap();
    let mut table = "t_s,depth_m,roll_rad,pitch_rad,heading_rad,dvl_u_mps,gps_x_m,gps_y_m\n".to_owned();
    for k in 0..600 {
        let (t, angle) = (0.1 * f64::from(k), 0.01 * f64::from(k).sin());
        let speed = 1.0 + 0.01 * f64::from(k / 10 % 7);
        writeln!(table, "{t:.1},{},{angle},{angle},{angle},{speed},{t},0", 0.1 + angle).unwrap();
    }
    std::fs::write(folder.path().join("log.csv"), table).unwrap();
    for (options, times) in [(&[][..], 1), (&["--quiet"][..], 0)] {
        let output = backseat(folder.path(), &[&["navigate", "log.csv"], options].concat());
        let (printed, aside) = (text(&output.stdout), text(&output.stderr));
        assert_eq!((printed.matches("dvl_u_mps repeats").count(), &*aside), (times, ""), "{printed}");
    }
}

#[test]
fn what_the_reader_left_out_is_said_when_the_command_fails() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("log.csv"), "t_s,depth_m,salinity\n0,1,35\n1,1,35\n").unwrap();
    let output = backseat(folder.path(), &["navigate", "log.csv"]);
    assert_eq!(output.status.code(), Some(1));
    let printed = text(&output.stderr);
    assert!(printed.starts_with("note: columns not used: salinity\nerror: "), "{printed}");
    // a long note in lines of a terminal, the error in one
    let names = (1..20).map(|number| format!(",instrument_{number}")).collect::<String>();
    let cells = ",1".repeat(20);
    std::fs::write(folder.path().join("log.csv"), format!("t_s,depth_m{names}\n0{cells}\n1{cells}\n")).unwrap();
    let printed = text(&backseat(folder.path(), &["navigate", "log.csv", "--force"]).stderr);
    let (notes, _) = printed.split_once("error: ").unwrap();
    assert!(notes.contains("instrument_19") && notes.lines().all(|line| line.chars().count() <= 80), "{printed}");
}

#[test]
fn an_identification_that_changes_nothing_says_so_and_writes_no_vehicle() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let dataset = "sim dataset --effect none --seed 1 --hours 0.15 --excite --noise off --out set";
    assert!(backseat(at, &dataset.split(' ').collect::<Vec<_>>()).status.success());
    let arguments =
        ["identify", "set/log.csv", "--vehicle", "set/vehicle.toml", "--out", "new.toml", "--json", "--force"];
    // without noise sensors look frozen
    let output = backseat(at, &arguments);
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    // The declared vehicle is the true one: nothing predicts the held-out data better.
    assert_eq!((json["changed"].as_bool(), output.status.code()), (Some(false), Some(3)), "{json}");
    assert!(json["vehicle_file"].is_null() && !at.join("new.toml").exists());
}
