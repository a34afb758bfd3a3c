//! `backseat identify` as a user runs it.

use crate::harness::{self, text};
use backseat_core::dynamics::Attitude;
use backseat_lab::experiment::{Experiment, wrong_prior};
use backseat_logs::{Column, LogWriter, VehicleFile};
use nalgebra::Vector3;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Output;
use tempfile::TempDir;

const COLUMNS: [&str; 8] = ["roll_deg", "pitch_deg", "p_degps", "q_degps", "r_degps", "u_mps", "v_mps", "w_mps"];

fn backseat(folder: &Path, arguments: &[&str]) -> Output {
    harness::backseat(folder, &[&["identify"], arguments].concat())
}

/// Eight minutes of the experiment, and a prior that is 30 % wrong.
fn experiment() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let run = Experiment { duration_s: 480.0, ..Experiment::identification(0.012) }.run(6000);
    let mut log = LogWriter::create(&folder.path().join("log.csv")).expect("a log");
    run.log.rows.iter().for_each(|row| log.write(row).expect("written"));
    log.finish().expect("written");
    let prior = VehicleFile { parameters: wrong_prior(0.3, 6000), ..VehicleFile::reference() };
    let path = folder.path().join("prior.toml");
    prior.write(&path, "wrong by up to 30 %", backseat_logs::output::Existing::Keep).expect("written");
    (folder, path)
}

#[test]
fn json_vehicle_file_and_report_are_as_promised() {
    let (folder, prior) = experiment();
    let arguments = ["log.csv", "--vehicle", "prior.toml", "--method", "aid", "--json", "--report", "out"];
    let output = backseat(folder.path(), &arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(json["method"], "aid");
    // JSON's numbers may lose the last bit when read.
    let is = |name: &str, value: f64| {
        let found = json["parameters"][name]["value"].as_f64().expect("a number");
        assert!((found / value - 1.0).abs() < 1.0e-12, "{name}: {found} instead of {value}");
    };
    is("m11", 38.8);
    for column in COLUMNS {
        let [before, after] =
            ["validation_before", "validation"].map(|key| json[key][column].as_f64().expect("a number"));
        // Noise of the log is in both; the prior's error is in one.
        assert!(after < before, "{column}: {before} {after}");
    }
    // What was written loads, and is the vehicle of the JSON.
    let file = folder.path().join(json["vehicle_file"].as_str().expect("a path"));
    let identified = VehicleFile::read(&file).expect("loads");
    is("d22", identified.parameters.quadratic_diag[1]);
    assert_ne!(identified.parameters, VehicleFile::read(&prior).expect("loads").parameters);
    let page = std::fs::read_to_string(folder.path().join("out/report.html")).expect("a page");
    assert!(page.contains("Identification from log.csv") && page.contains("beta3"));
    // A second run does not replace the first one's results.
    let again = backseat(folder.path(), &arguments);
    assert_eq!(again.status.code(), Some(1));
    assert!(text(&again.stderr).contains("--force"), "{}", text(&again.stderr));
}

#[test]
fn the_covariance_is_the_prior_of_the_robust_filter() {
    let (folder, _) = experiment();
    for (method, has_covariance) in [("iv", true), ("aid", false)] {
        let arguments = ["log.csv", "--vehicle", "prior.toml", "--method", method, "--out", &format!("{method}.toml")];
        let output = backseat(folder.path(), &arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
        let identified = VehicleFile::read(&folder.path().join(format!("{method}.toml"))).expect("loads");
        assert_eq!(!identified.learnt.is_none(), has_covariance, "{method}");
        if has_covariance {
            let learnt = &identified.learnt;
            // The scale is as uncertain as it was declared; thrust and drag are tied to it, and to each other.
            assert_eq!((learnt.dives, learnt.mean, learnt.sigma[0]), (0, [0.0; 16], 0.1));
            assert!(learnt.sigma[3] <= 0.1 && learnt.sigma[7] <= 0.1 && learnt.correlation(7, 3) > 0.9, "{learnt:?}");
        }
    }
}

#[test]
fn declared_effects_are_heeded() {
    let folder = tempfile::tempdir().expect("a folder");
    let current = [0.2, -0.15];
    let run = Experiment { duration_s: 480.0, ..Experiment::identification(0.012) }.run(6001);
    let mut log = LogWriter::create(&folder.path().join("log.csv")).expect("a log");
    for (row, truth) in run.log.rows.iter().zip(&run.truth.rows) {
        let mut row = row.clone();
        let attitude = Attitude::new(&Vector3::new(truth.state[3], truth.state[4], truth.state[5]));
        let water = attitude.rotation().transpose() * Vector3::new(current[0], current[1], 0.0);
        for (column, water) in [Column::DvlU, Column::DvlV, Column::DvlW].into_iter().zip(water.iter()) {
            row.set(column, row.get(column).expect("a sample") + water);
        }
        log.write(&row).expect("written");
    }
    log.finish().expect("written");
    let mut file = VehicleFile { parameters: wrong_prior(0.3, 6001), ..VehicleFile::reference() };
    file.write(&folder.path().join("plain.toml"), "no current", backseat_logs::output::Existing::Keep)
        .expect("written");
    file.effects.set = file.effects.set.with("water_current", &current).expect("an effect");
    file.effects.set = file.effects.set.with("thrust_loss", &[1.0e-3]).expect("an effect");
    file.write(&folder.path().join("drift.toml"), "a current", backseat_logs::output::Existing::Keep).expect("written");
    let surge = |vehicle: &str| {
        let arguments =
            ["log.csv", "--method", "aid", "--json", "--vehicle", vehicle, "--out", &format!("new-{vehicle}")];
        let output = backseat(folder.path(), &arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
        let json: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        // a simulation that leaves the finite has no error
        json["validation"]["u_mps"].as_f64().unwrap_or(f64::INFINITY)
    };
    let (plain, declared) = (surge("plain.toml"), surge("drift.toml"));
    // The DVL's noise is 0.01 in the mean; the current is 0.25.
    assert!(declared < 0.02 && plain > 0.08, "{declared} with the current declared, {plain} without");
    // The plant's effect is in the parameters now, the water's is where it was.
    let identified = VehicleFile::read(&folder.path().join("new-drift.toml")).expect("loads");
    let effects: Vec<_> =
        identified.effects.set.active().map(|(_, info, values)| (info.name, values.to_vec())).collect();
    assert_eq!(effects, [("water_current", current.to_vec())]);
    assert_eq!(identified.parameters.advance_n_s2_per_rad_m, file.parameters.advance_n_s2_per_rad_m + 1.0e-3);
}

#[test]
fn what_a_log_lacks_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("log.csv"), "t_s,depth_m\n0,1\n1,1\n").expect("written");
    let output = backseat(folder.path(), &["log.csv"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("roll_rad"), "{}", text(&output.stderr));
    assert_eq!(backseat(folder.path(), &[]).status.code(), Some(2));
}
