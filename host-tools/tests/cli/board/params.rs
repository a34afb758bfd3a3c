//! `backseat params`.

use super::bench::Bench;
use backseat_app::parameters::PARAMETERS;
use backseat_lab::experiment::{Experiment, wrong_prior};
use backseat_logs::{BoardFile, LogWriter, VehicleFile};

fn vehicle(changes: &[(&str, f64)]) -> String {
    let mut file = VehicleFile::reference();
    file.apply(changes.iter().copied()).unwrap();
    file.to_toml("a test's")
}

#[test]
fn get_tells_all_there_is_to_know() {
    let bench = Bench::new();
    let table = bench.good(&["params", "get", "PORT"]);
    // the key of the acoustic payloads is in no list: one line says whether there is one
    let (table, key) = table.trim_end().rsplit_once('\n').unwrap();
    assert!(key.starts_with("app.acoustic_key  not set"), "{key}");
    assert_eq!(table.lines().count(), PARAMETERS.len() + 1);
    let row = table.lines().find(|line| line.starts_with("installation.sound_speed_mps ")).unwrap();
    for part in ["1500", "m/s", "1300 to 1700", "Sound speed", "at once"] {
        assert!(row.contains(part), "{row}");
    }
    // each of them has everything
    let (head, rows) = table.split_once('\n').unwrap();
    let [effect, meaning] = ["takes effect", "meaning"].map(|title| head.find(title).unwrap());
    for row in rows.lines() {
        assert!(row.len() > meaning && row.is_char_boundary(effect), "{row}");
        assert!(["at once", "restart"].contains(&row[effect..meaning].trim()), "{row}");
    }
    let drag = bench.json(&["params", "get", "PORT", "drag"]);
    assert_eq!(drag["parameters"].as_array().unwrap().len(), 13);
    let one = bench.json(&["params", "get", "PORT", "fins.cl[1]"]);
    assert_eq!(one["parameters"][0]["default"], -4.0);
    assert!(one["parameters"][0]["description"].as_str().unwrap().contains("Lift"));
    for parameter in bench.json(&["params", "get", "PORT"])["parameters"].as_array().unwrap() {
        for key in ["name", "unit", "description", "takes_effect"] {
            assert!(parameter[key].as_str().is_some_and(|text| !text.is_empty()), "{key}: {parameter}");
        }
        let [value, min, max, default] = ["value", "min", "max", "default"].map(|key| parameter[key].as_f64().unwrap());
        assert!(value == default && (min..=max).contains(&default), "{parameter}");
    }
    assert!(bench.complaint(&["params", "get", "PORT", "fins.c"]).contains("fins.c is no parameter"));
}

#[test]
fn set_is_all_or_nothing_and_tells_each_refusal() {
    let bench = Bench::new();
    let text = bench.good(&["params", "set", "PORT", "vehicle.mass_kg=38.5", "app.use_dvl=1", "app.use_range=1"]);
    assert!(
        text.contains("3 parameters set, 2 of them changed") && text.contains("vehicle.mass_kg: 38 -> 38.5"),
        "{text}"
    );
    assert!(text.contains("navigation starts again, as it does for vehicle.mass_kg"), "{text}");
    let text = bench.good(&["params", "set", "PORT", "installation.sound_speed_mps=1501"]);
    assert!(!text.contains("navigation") && !text.contains("start"), "{text}");
    let text = bench.good(&["params", "set", "PORT", "app.leak_detector=2", "app.use_dvl=0"]);
    assert!(text.contains("a board reads app.leak_detector when it starts: store"), "{text}");
    bench.good(&["params", "set", "PORT", "app.leak_detector=0", "app.use_dvl=1"]);
    let values = ["vehicle.mass_kg=40", "vehicle.weight_kg=40", "installation.sound_speed_mps=15", "app.use_dvl=0.5"];
    let line = bench.complaint(&[&["params", "set", "PORT"], &values[..]].concat());
    for part in [
        "keeps the old set",
        "vehicle.weight_kg: this board has no such parameter",
        "installation.sound_speed_mps = 15: expected within 1300 to 1700 m/s",
        "app.use_dvl = 0.5: expected a whole number within 0 to 1",
    ] {
        assert!(line.contains(part), "{line}");
    }
    assert_eq!(bench.value("vehicle.mass_kg"), 38.5);
    // in range one by one, but the vehicle does not reach the cruise speed
    let line = bench.complaint(&["params", "set", "PORT", "propeller.omega_max_radps=50", "app.cruise_speed_mps=3"]);
    for part in ["does not reach the cruise speed", "app.cruise_speed_mps = 3", "propeller.omega_max_radps = 50"] {
        assert!(line.contains(part), "{line}");
    }
    assert_eq!(bench.value("propeller.omega_max_radps"), 200.0);
}

#[test]
fn the_key_is_set_and_never_shown() {
    let bench = Bench::new();
    let secret = "915f0e33d477a2681ce94b86f02d53ba";
    let refused = bench.run(&["params", "set", "PORT", &format!("app.acoustic_key={secret}")]);
    assert!(refused.code == Some(2) && refused.stderr.contains("can be seen by every user"), "{}", refused.stderr);
    bench.write("ship.key", &format!("{secret}\n"));
    let printed = bench.good(&["params", "set", "PORT", "app.acoustic_key=@ship.key"]);
    assert!(printed.contains("app.acoustic_key: set"), "{printed}");
    let get = bench.good(&["params", "get", "PORT"]);
    assert!(get.contains("app.acoustic_key  set"), "{get}");
    assert_eq!(bench.json(&["params", "get", "PORT", "app.acoustic_key"])["app.acoustic_key"], "set");
    bench.good(&["params", "export", "PORT", "x.toml"]);
    let exported = bench.read("x.toml");
    for text in [&printed, &get, &exported] {
        assert!(!text.contains("915f") && !text.contains("53ba"), "{text}");
    }
    assert!(!exported.contains("acoustic_key"), "nothing that an import could take for one");
    bench.good(&["params", "import", "PORT", "x.toml", "--key", "ship.key"]);
    assert_eq!(bench.json(&["params", "get", "PORT", "app"])["app.acoustic_key"], "set");
    bench.good(&["params", "set", "PORT", "app.acoustic_key=none", "--key", "ship.key"]);
    assert_eq!(bench.json(&["params", "get", "PORT", "app.acoustic_key"])["app.acoustic_key"], "not set");
}

/// A board with a key: without it, and with another, nothing changes, and the command says what to do.
#[test]
fn what_changes_a_flight_is_signed_by_the_key() {
    let bench = Bench::new();
    bench.write("ship.key", "915f0e33d477a2681ce94b86f02d53ba\n");
    bench.write("new.key", "000102030405060708090a0b0c0d0e0f\n");
    bench.write("m.toml", "[[mission.waypoints]]\nx_m = 9.0\ny_m = 0.0\ndepth_m = 2.0\nspeed_mps = 1.0\n");
    bench.good(&["params", "set", "PORT", "app.acoustic_key=@ship.key"]);
    let demands: [&[&str]; 7] = [
        &["params", "set", "PORT", "vehicle.mass_kg=38.5"],
        &["params", "set", "PORT", "app.acoustic_key=@new.key"],
        &["params", "set", "PORT", "app.acoustic_key=none"],
        &["params", "store", "PORT"],
        &["mission", "put", "PORT", "m.toml"],
        &["mission", "start", "PORT"],
        &["mission", "stop", "PORT"],
    ];
    for demand in demands {
        let line = bench.complaint(demand);
        assert!(line.contains("--key FILE"), "{demand:?}: {line}");
        let line = bench.complaint(&[demand, &["--key", "new.key"]].concat());
        assert!(line.contains("its key is another than the one given"), "{demand:?}: {line}");
    }
    assert_eq!(bench.value("vehicle.mass_kg"), 38.0);
    let check = bench.run(&["check", "PORT"]).stdout;
    assert!(check.contains("14 requests refused that were not signed"), "{check}");
    bench.good(&["params", "set", "PORT", "vehicle.mass_kg=38.5", "--key", "ship.key"]);
    bench.good(&["mission", "put", "PORT", "m.toml", "--key", "ship.key"]);
    bench.good(&["params", "set", "PORT", "app.acoustic_key=@new.key", "--key", "ship.key"]);
    bench.good(&["mission", "stop", "PORT", "--key", "new.key"]);
    assert!(bench.complaint(&["mission", "stop", "PORT", "--key", "ship.key"]).contains("another than the one given"));
    assert!(bench.complaint(&["mission", "stop", "PORT", "--key", "m.toml"]).contains("32 hexadecimal digits"));
}

#[test]
fn import_of_export_is_the_same_set() {
    let bench = Bench::new();
    bench.good(&[
        "params",
        "set",
        "PORT",
        "installation.transducer_arm_m[1]=-0.3333333333333333",
        "drag.quadratic_diag[0]=3.4",
        "app.use_dvl=1",
    ]);
    let printed = bench.good(&["params", "export", "PORT", "x.toml", "--name", "iver3-218"]);
    assert!(printed.contains(&format!("{} parameters", PARAMETERS.len())), "{printed}");
    let text = bench.read("x.toml");
    assert!(
        text.contains("transducer_arm_m = [0.0, -0.3333333333333333, 0.0]  # m; -20 to 20; Acoustic transducer"),
        "{text}"
    );
    let file = BoardFile::read(&bench.path("x.toml")).unwrap();
    assert_eq!(file.flatten().len(), PARAMETERS.len());
    assert_eq!(VehicleFile::read(&bench.path("x.toml")).unwrap().name, "iver3-218");
    // another set in between, then everything back
    bench.good(&[
        "params",
        "set",
        "PORT",
        "installation.transducer_arm_m[1]=1",
        "drag.quadratic_diag[0]=9",
        "noise.linear_mps2_per_sqrt_hz[0]=0.5",
    ]);
    let back = bench.json(&["params", "import", "PORT", "x.toml"]);
    assert_eq!(back["changed"].as_array().unwrap().len(), 3, "{back}");
    bench.good(&["params", "export", "PORT", "y.toml", "--name", "iver3-218"]);
    assert_eq!(bench.read("y.toml"), text);
    assert!(bench.complaint(&["params", "export", "PORT", "y.toml"]).contains("exists already"));
}

#[test]
fn a_vehicle_file_or_the_app_alone() {
    let bench = Bench::new();
    bench.write("v.toml", &vehicle(&[("vehicle.mass_kg", 39.5), ("fins.cl[0]", 2.9)]));
    let printed = bench.json(&["params", "import", "PORT", "v.toml"]);
    assert_eq!(printed["set"], VehicleFile::reference().flatten().len());
    assert_eq!((bench.value("vehicle.mass_kg"), bench.value("fins.cl[0]")), (39.5, 2.9));
    bench.write("site.toml", "[app]\norigin_lat_deg = 47.7\nuse_dvl = 1\n");
    bench.good(&["params", "import", "PORT", "site.toml"]);
    assert_eq!((bench.value("app.origin_lat_deg"), bench.value("vehicle.mass_kg")), (47.7, 39.5));
}

#[test]
fn what_identify_writes_is_imported() {
    let bench = Bench::new();
    let run = Experiment { duration_s: 240.0, ..Experiment::identification(0.012) }.run(6000);
    let mut log = LogWriter::create(&bench.path("log.csv")).unwrap();
    run.log.rows.iter().for_each(|row| log.write(row).unwrap());
    log.finish().unwrap();
    let prior = VehicleFile { parameters: wrong_prior(0.3, 6000), ..VehicleFile::reference() };
    bench.write("prior.toml", &prior.to_toml("wrong by up to 30 %"));
    bench.good(&["params", "import", "PORT", "prior.toml"]);
    let arguments = ["identify", "log.csv", "--vehicle", "prior.toml", "--method", "aid", "--report", "out"];
    let identified = bench.json(&arguments);
    let file = identified["vehicle_file"].as_str().unwrap();
    let printed = bench.json(&["params", "import", "PORT", file]);
    // m11 is the scale; the others moved
    assert!(printed["changed"].as_array().unwrap().len() >= 15, "{printed}");
    let d22 = VehicleFile::read(&bench.path(file)).unwrap().parameters.quadratic_diag[1];
    assert_eq!(bench.value("drag.quadratic_diag[1]"), d22);
}

#[test]
fn what_the_board_has_learnt_is_shown_and_forgotten() {
    let bench = Bench::new();
    assert!(bench.good(&["params", "learnt", "PORT"]).contains("nothing learnt"));
    assert_eq!(bench.json(&["params", "forget", "PORT"])["forgotten"], false);
    let mut file = VehicleFile::reference();
    file.learnt.dives = 2;
    (file.learnt.mean[7], file.learnt.sigma[7], file.learnt.sigma[3]) = (-0.08, 0.02, 0.03);
    file.learnt.set_correlation(7, 3, 0.9);
    std::fs::write(bench.path("learnt.toml"), file.to_toml("a test's")).unwrap();
    bench.good(&["params", "import", "PORT", "learnt.toml"]);
    let shown = bench.json(&["params", "learnt", "PORT"]);
    assert_eq!((shown["dives"].as_u64(), &shown["learnt"]["beta5"]["value"]), (Some(2), &(-0.08).into()));
    assert_eq!(shown["learnt"]["beta5"]["largest_correlation"]["with"], "d11");
    assert!(shown["learnt"].get("m11").is_none(), "{shown}");
    assert!(bench.good(&["params", "learnt", "PORT"]).contains("+0.90 with d11"));
    // This board has no memory: what is forgotten comes back with the next start.
    assert!(bench.complaint(&["params", "forget", "PORT"]).contains("only until power-off"));
    assert!(bench.good(&["params", "learnt", "PORT"]).contains("nothing learnt"));
}

#[test]
fn a_transfer_that_breaks_off_leaves_the_old_set_active() {
    let bench = Bench::new();
    bench.good(&["params", "set", "PORT", "vehicle.mass_kg=38.5"]);
    bench.write("v.toml", &vehicle(&[("vehicle.mass_kg", 39.5), ("vehicle.length_m", 2.1)]));
    // A request for each of the parameters takes some ten bytes of the line; then the values follow, mass third.
    let whole = 11 * PARAMETERS.len();
    for cut in [20, whole / 2, whole + 200, whole + 1000, whole + 2000] {
        let line = bench.run_until(&["params", "import", "PORT", "v.toml"], cut).complaint("a broken cable");
        assert!(line.contains("connection lost") || line.contains("no data received"), "{cut}: {line}");
        assert_eq!(bench.value("vehicle.mass_kg"), 38.5, "{cut}");
    }
    // and the next transfer is none the worse for it
    bench.good(&["params", "import", "PORT", "v.toml"]);
    assert_eq!((bench.value("vehicle.mass_kg"), bench.value("vehicle.length_m")), (39.5, 2.1));
}

#[test]
fn bad_files_are_told_before_the_board_hears_of_them() {
    let bench = Bench::new();
    let good = vehicle(&[]);
    let cases = [
        ("", "b.toml: no parameters"),
        ("\u{feff}[app\n", "b.toml:1:"),
        (&good.replace("mass_kg = 38.0", "mass_kg = heavy"), "b.toml:"),
        (&good.replace("mass_kg = 38.0", "mass_kg = -38.0"), "vehicle.mass_kg: -38 is outside"),
        (&good.replace("mass_kg = 38.0", "mass_lb = 38.0"), "unknown key mass_lb in [vehicle]"),
        (&good.replace("mass_kg = 38.0", "mass_kg = nan"), "vehicle.mass_kg: NaN is outside"),
        (&good.replace("length_m = 2.0", ""), "[vehicle] lacks length_m"),
        (&good.replace("[drag]", "[drags]"), "unknown key drags"),
        (&good[..good.find("mass_kg").unwrap()], "b.toml:"),
        ("[app]\nuse_dvl = true\n", "b.toml:2:11: app.use_dvl: expected a number"),
        ("[app]\nuse_dvl = inf\n", "app.use_dvl: inf is no whole number"),
        ("[app]\nuse_dvl = 1\nuse_dvl = 0\n", "b.toml:3:1:"),
        ("[app]\nuse_dvl = 2\n", "b.toml:2:11: app.use_dvl: 2 is no whole number, or outside 0 to 1"),
        ("[app]\nuse_dvl = 1\nno_such = 1\n", "b.toml:3:1: unknown key no_such in [app]"),
    ];
    for (text, message) in cases {
        bench.write("b.toml", text);
        let line = bench.complaint(&["params", "import", "PORT", "b.toml"]);
        assert!(line.contains(message), "{message}: {line}");
    }
    assert!(bench.complaint(&["params", "import", "PORT", "none.toml"]).contains("none.toml: No such file"));
    assert_eq!(bench.value("app.use_dvl"), 0.0);
}

#[test]
fn a_board_without_a_memory_says_so() {
    let bench = Bench::new();
    let line = bench.complaint(&["params", "store", "PORT"]);
    assert!(line.contains("stored nothing: it has no flash"), "{line}");
}
