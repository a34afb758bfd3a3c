//! A vehicle whose sensors sit off its centre of gravity, are turned and late, end to end: simulator, bytes, app,
//! export, navigate, identify, diagnose, and the ARM image in QEMU. With the installation declared nothing is found
//! missing and the errors are those of a vehicle whose sensors sit at its centre; each number that is not declared is
//! seen.
//!
//! `cargo test -p host-tools installation -- --ignored --nocapture` prints the figures.

use crate::harness::{is_qemu_there, program};
use backseat_core::navigation::{ProcessModel, Sensor};
use backseat_core::parameters::Installation;
use backseat_core::state::{PHI, PSI, THETA, X, Y, Z, wrap_angle};
use backseat_estimation::filter::{self, FilterOptions};
use backseat_logs::output::Existing;
use backseat_logs::{Log, Truth, VehicleFile};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use tempfile::TempDir;

/// Larger than on any vehicle of 2 m where that is what it takes to be seen in half an hour: the antenna and the
/// transducer against a fix of 1 m and a range of 1 m.
const INSTALLED: Installation = Installation {
    dvl_arm_m: [0.6, 0.05, 0.2],
    dvl_turn_rad: [0.02, -0.03, 0.1],
    dvl_delay_s: 0.35,
    ahrs_turn_rad: [0.06, -0.05, 0.08],
    ahrs_delay_s: 0.25,
    depth_arm_m: [-0.8, 0.0, -0.15],
    depth_delay_s: 0.4,
    gnss_arm_m: [4.0, 0.0, -0.3],
    transducer_arm_m: [3.0, 0.0, -0.2],
    ..Installation::DEFAULT
};

/// Takes one number out.
type Forget = fn(&mut Installation);

const EACH: [(&str, Forget); 9] = [
    ("dvl_arm_m", |i| i.dvl_arm_m = [0.0; 3]),
    ("dvl_turn_rad", |i| i.dvl_turn_rad = [0.0; 3]),
    ("dvl_delay_s", |i| i.dvl_delay_s = 0.0),
    ("ahrs_turn_rad", |i| i.ahrs_turn_rad = [0.0; 3]),
    ("ahrs_delay_s", |i| i.ahrs_delay_s = 0.0),
    ("depth_arm_m", |i| i.depth_arm_m = [0.0; 3]),
    ("depth_delay_s", |i| i.depth_delay_s = 0.0),
    ("gnss_arm_m", |i| i.gnss_arm_m = [0.0; 3]),
    ("transducer_arm_m", |i| i.transducer_arm_m = [0.0; 3]),
];

fn backseat(arguments: &[&str]) -> Value {
    let outcome = program(Path::new("."), [arguments, &["--json"]].concat());
    // 3: nothing better than the vehicle file, which is the vehicle's.
    assert!(outcome.code == Some(0) || arguments[0] == "identify", "{arguments:?}: {}", outcome.stderr);
    outcome.json()
}

fn vehicle(installation: &Installation) -> VehicleFile {
    VehicleFile { installation: *installation, ..VehicleFile::reference() }
}

/// A survey of six short lines with a DVL, flown by the app as a process of its own.
struct InstalledFlight {
    folder: TempDir,
    is_finished: bool,
    /// Of the board, m.
    board_median_m: f64,
}

impl InstalledFlight {
    fn fly(truth: Option<&Installation>, declared: &Installation, minutes: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut text = include_str!("../../../hil-sim/scenarios/survey.toml").to_owned();
        for (from, to) in [
            ("lines = 10", "lines = 6"),
            ("length_m = 1000.0", "length_m = 300.0"),
            ("dvl = false", "dvl = true"),
            ("vehicle = \"iver3.toml\"", "vehicle = \"vehicle.toml\""),
        ] {
            assert!(text.contains(from), "{from}");
            text = text.replacen(from, to, 1);
        }
        if let Some(i) = truth {
            text += "\n[installation]\n";
            for (name, values) in [
                ("dvl_arm_m", i.dvl_arm_m),
                ("dvl_turn_rad", i.dvl_turn_rad),
                ("ahrs_turn_rad", i.ahrs_turn_rad),
                ("depth_arm_m", i.depth_arm_m),
                ("gnss_arm_m", i.gnss_arm_m),
                ("transducer_arm_m", i.transducer_arm_m),
            ] {
                text += &format!("{name} = {values:?}\n");
            }
            for (name, value) in
                [("dvl_delay_s", i.dvl_delay_s), ("ahrs_delay_s", i.ahrs_delay_s), ("depth_delay_s", i.depth_delay_s)]
            {
                text += &format!("{name} = {value:?}\n");
            }
        }
        let scenario = folder.path().join("scenario.toml");
        std::fs::write(&scenario, text).unwrap();
        vehicle(declared).write(&folder.path().join("vehicle.toml"), "declared", Existing::Replace).unwrap();
        let out = folder.path().join("out");
        let [scenario, to] = [&scenario, &out].map(|path| path.to_str().unwrap());
        let run = backseat(&["sim", "run", scenario, "--minutes", minutes, "--out", to]);
        let board_median_m = run["configurations"][0]["median_m"].as_f64().unwrap();
        let csv = folder.path().join("csv");
        backseat(&["export", out.join("session.mcap").to_str().unwrap(), "--csv", csv.to_str().unwrap()]);
        Self { folder, is_finished: run["finished"] == true, board_median_m }
    }

    fn exported(&self) -> PathBuf {
        self.folder.path().join("csv/vehicle_log.csv")
    }

    fn truth(&self) -> PathBuf {
        self.folder.path().join("out/truth.csv")
    }

    /// Navigates the exported log with this installation declared.
    fn navigate(&self, installation: &Installation) -> Quality {
        let log = Log::read(&self.exported()).unwrap();
        let truth = Truth::read(&self.truth()).unwrap();
        let vehicle = vehicle(installation);
        let options =
            FilterOptions { ship: filter::ShipSource::Packet, ..FilterOptions::new(&vehicle, ProcessModel::Dynamic) };
        let run = filter::run(&log, &vehicle, &options).unwrap();
        let surprise = run.fusions.iter().filter(|record| record.variance > 0.0);
        let surprise = surprise.map(|record| record.innovation.powi(2) / record.variance + record.variance.ln()).sum();
        let mut quality = Quality { surprise, nis: Vec::new(), errors: [0.0; 4] };
        for sensor in &run.sensors {
            // a rejected scalar is at least at the gate
            let rejected = 9.0 * sensor.rejected as f64;
            let all = (sensor.fused + sensor.rejected) as f64;
            quality.nis.push((sensor.sensor, (sensor.nis.unwrap_or(0.0) * sensor.fused as f64 + rejected) / all));
        }
        let mut count = 0.0;
        for sample in &run.track {
            let Some(at) = truth.at(sample.time_us) else { continue };
            let error = |i: usize| sample.state[i] - at.state[i];
            let squares = [
                error(X).powi(2) + error(Y).powi(2),
                error(Z).powi(2),
                wrap_angle(error(PHI)).powi(2) + wrap_angle(error(THETA)).powi(2),
                wrap_angle(error(PSI)).powi(2),
            ];
            quality.errors.iter_mut().zip(squares).for_each(|(sum, square)| *sum += square);
            count += 1.0;
        }
        quality.errors = quality.errors.map(|sum| (sum / count).sqrt());
        quality
    }

    fn diagnose(&self, installation: &Installation) -> Value {
        self.over_the_log("diagnose", installation, &[])
    }

    /// RMSE of the identified vehicle's motion over the log, by column; by the default method, which leaves parameters that
    /// the log does not show where they are declared.
    fn identify(&self, installation: &Installation) -> Value {
        self.over_the_log("identify", installation, &[])["validation"].take()
    }

    fn over_the_log(&self, command: &str, installation: &Installation, more: &[&str]) -> Value {
        let file = tempfile::Builder::new().suffix(".toml").tempfile_in(self.folder.path()).unwrap();
        vehicle(installation).write(file.path(), "declared", Existing::Replace).unwrap();
        let log = self.exported();
        let arguments = [command, log.to_str().unwrap(), "--vehicle", file.path().to_str().unwrap()];
        backseat(&[&arguments[..], more].concat())
    }

    /// Its first minutes once more, by a backseat.
    fn again(&self, by: &str) -> Value {
        let [scenario, out] = ["scenario.toml", by].map(|name| self.folder.path().join(name));
        let [scenario, out] = [scenario.to_str().unwrap(), out.to_str().unwrap()];
        backseat(&["sim", "run", scenario, "--minutes", "4", "--backseat", by, "--out", out])
    }
}

/// How well a filter does on a log.
struct Quality {
    /// Minus twice the log-likelihood of all innovations.
    surprise: f64,
    nis: Vec<(Sensor, f64)>,
    /// RMS: horizontal, m; depth, m; roll and pitch, rad; heading, rad.
    errors: [f64; 4],
}

impl Quality {
    /// The largest ratio of innovations or errors to those of another.
    fn worse_than(&self, other: &Self) -> f64 {
        let nis = self.nis.iter().filter_map(|(sensor, nis)| {
            let (_, before) = other.nis.iter().find(|(same, _)| same == sensor)?;
            Some((nis / before).sqrt())
        });
        let errors = self.errors.iter().zip(&other.errors).map(|(error, before)| error / before);
        nis.chain(errors).fold(0.0, f64::max)
    }

    fn print(&self, name: &str) {
        let nis: Vec<String> = self.nis.iter().map(|(sensor, nis)| format!("{} {nis:.2}", sensor.name())).collect();
        let [xy, z, tilt, heading] = self.errors;
        println!("{name:17} {xy:6.3} m {z:6.3} m {tilt:7.4} rad {heading:7.4} rad   {}", nis.join(" "));
    }
}

/// Nothing installed off the centre, and everything installed and declared, flown to the end.
static FLIGHTS: LazyLock<[InstalledFlight; 2]> = LazyLock::new(|| {
    [(None, Installation::DEFAULT), (Some(&INSTALLED), INSTALLED)].map(|(truth, declared)| {
        let flight = InstalledFlight::fly(truth, &declared, WHOLE);
        assert!(flight.is_finished);
        flight
    })
});

/// Everything installed and declared, its first minutes.
static BEGUN: LazyLock<InstalledFlight> = LazyLock::new(|| InstalledFlight::fly(Some(&INSTALLED), &INSTALLED, "8"));

/// Minutes that are never needed.
const WHOLE: &str = "200";

/// A log that is navigated without one of the numbers is less likely.
fn is_seen(flight: &InstalledFlight, names: &[&str]) {
    let declared = flight.navigate(&INSTALLED);
    for (name, forget) in EACH.into_iter().filter(|(name, _)| names.contains(name)) {
        let mut installation = INSTALLED;
        forget(&mut installation);
        let quality = flight.navigate(&installation);
        let surprise = quality.surprise - declared.surprise;
        quality.print(name);
        println!("{name:17} {surprise:.0}");
        // that of three numbers at once is above 30 by chance once in a million logs
        assert!(surprise > 30.0, "{name}: twice the log-likelihood falls by {surprise:.1} only");
    }
}

/// What takes no half hour to be seen.
#[test]
fn turns_and_delays_are_seen_within_minutes_when_they_are_not_declared() {
    is_seen(&BEGUN, &["dvl_turn_rad", "dvl_delay_s", "ahrs_turn_rad", "ahrs_delay_s"]);
}

#[test]
#[ignore = "an ensemble: .ci/nightly"]
fn nothing_is_missing_when_the_installation_is_declared() {
    let [plain, installed] = &*FLIGHTS;
    println!("board: median {:.3} m at the centre, {:.3} m installed", plain.board_median_m, installed.board_median_m);
    let [at_centre, declared] = [plain.navigate(&Installation::DEFAULT), installed.navigate(&INSTALLED)];
    at_centre.print("at the centre");
    declared.print("declared");
    assert!(installed.board_median_m < 1.3 * plain.board_median_m, "the board's error");
    assert!(declared.worse_than(&at_centre) < 1.3, "errors and innovations over the log");
    let diagnosis = installed.diagnose(&INSTALLED);
    // Nothing but the serial line, which no [installation] holds: the frame of the fins takes 22 ms on it, and the export
    // bears the time of sending (docs/guide/record.md). A flight shows that late, or does not show it.
    for effect in diagnosis["effects"].as_array().unwrap() {
        assert_eq!(effect["name"], "input_delay", "{diagnosis}");
        let late_s = &effect["parameters"]["s"]["ci95"];
        assert!(late_s[0].as_f64().unwrap() < 0.03 && late_s[1].as_f64().unwrap() < 0.06, "{diagnosis}");
    }
}

#[test]
#[ignore = "an ensemble: .ci/nightly"]
fn each_number_is_seen_when_it_is_not_declared() {
    let [_, installed] = &*FLIGHTS;
    is_seen(installed, &EACH.map(|(name, _)| name));
    let diagnosis = installed.diagnose(&Installation::DEFAULT);
    assert_ne!(diagnosis["verdict"], "none", "{diagnosis}");
}

#[test]
#[ignore = "an ensemble: .ci/nightly"]
fn identification_finds_the_vehicle_behind_its_installation() {
    let [plain, installed] = &*FLIGHTS;
    let at_centre = plain.identify(&Installation::DEFAULT);
    let [declared, undeclared] = [&INSTALLED, &Installation::DEFAULT].map(|i| installed.identify(i));
    println!("at the centre {at_centre}\ndeclared {declared}\nundeclared {undeclared}");
    let ratio = |a: &Value, b: &Value, column: &str| a[column].as_f64().unwrap() / b[column].as_f64().unwrap();
    for column in ["roll_deg", "p_degps", "q_degps", "r_degps", "u_mps", "v_mps", "w_mps"] {
        assert!(ratio(&declared, &at_centre, column) < 1.3, "{column}");
    }
    // A turned DVL: 11 times as much sway. In surge, drag and thrust take the turn up.
    assert!(ratio(&undeclared, &declared, "v_mps") > 5.0);
}

#[test]
fn the_arm_image_flies_it_to_the_same_bit() {
    if !is_qemu_there() {
        return;
    }
    let [host, arm] = ["host", "qemu"].map(|by| BEGUN.again(by));
    assert_eq!(arm["digest"], host["digest"]);
    assert_eq!(arm["configurations"][0], host["configurations"][0], "error and NIS of the board");
    assert_ne!(host["configurations"][0]["nis"]["dvl"], Value::Null, "it was navigation that was compared");
}
