//! The reader and the filter over a log against an independent implementation: `nav_mini_run.csv`
//! with the states of `nav_vectors.json` (provenance: `firmware/core/tests/data/README.md`).

use backseat_core::navigation::{InitialShip, InitialState, ProcessModel, Sensor};
use backseat_core::state::{PSI, U, V, VehicleState, X, Y};
use backseat_estimation::filter::{self, FilterOptions, ShipSource, Start};
use backseat_logs::{Log, VehicleFile};
use serde_json::Value;
use std::path::{Path, PathBuf};

fn vectors(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware/core/tests/data").join(name)
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

fn log() -> Log {
    Log::read(&vectors("nav_mini_run.csv")).unwrap()
}

fn mini_run() -> Value {
    let text = std::fs::read_to_string(vectors("nav_vectors.json")).unwrap();
    serde_json::from_str::<Value>(&text).unwrap()["mini_run"].take()
}

/// The start that `init_note` of the vectors describes.
fn start(log: &Log, mini: &Value) -> Start {
    let fixes: Vec<[f64; 2]> = log.rows.iter().filter_map(|row| row.ship_gnss_m()).take(6).collect();
    let velocity = [0, 1].map(|axis: usize| (fixes[5][axis] - fixes[0][axis]) / 5.0);
    Start {
        vehicle: InitialState {
            state: VehicleState::from_column_slice(&numbers(&mini["init_x"])),
            sigma: VehicleState::from_column_slice(&numbers(&mini["init_sd"])),
        },
        ship: Some(InitialShip {
            state: [fixes[0][0], fixes[0][1], 0.0, velocity[0], velocity[1], 0.0],
            sigma: [0.5, 0.5, 0.1, 0.15, 0.15, 0.01],
        }),
    }
}

fn options(log: &Log, mini: &Value, model: ProcessModel) -> FilterOptions {
    let mut options = FilterOptions::new(&VehicleFile::reference(), model);
    options.start = Some(start(log, mini));
    options.use_dvl = false;
    options.use_range_rate = false;
    options.track_interval_us = 0;
    // The reference does not gate, and is of first order.
    options.navigation.gate_sigma = 1.0e3;
    options.navigation.range_curvature = 1.0e6;
    options
}

#[test]
fn val_four_configurations() {
    let (log, mini) = (log(), mini_run());
    let plain = options(&log, &mini, ProcessModel::Dynamic);
    let mut current = plain;
    current.use_range_rate = true;
    current.navigation.effect_states = FilterOptions::water_current();
    let mut kinematic = options(&log, &mini, ProcessModel::Kinematic);
    kinematic.use_dvl = true;
    let mut dvl = plain;
    dvl.use_dvl = true;
    let cases =
        [("dyn_range", plain), ("dyn_range_rr_current", current), ("kin_dvl_range", kinematic), ("dyn_dvl_gps", dvl)];
    for (name, options) in cases {
        let run = filter::run(&log, &VehicleFile::reference(), &options).unwrap();
        assert!(run.notes.is_empty(), "{:?}", run.notes);
        let expected = &mini["results"][name];
        let (mut worst_state, mut worst_covariance, mut worst_innovation) = (0.0_f64, 0.0_f64, 0.0_f64);
        for (k, t_s) in numbers(&expected["t"]).into_iter().enumerate() {
            let time_us = (t_s * 1e6).round() as u64;
            let sample = run.track.iter().find(|sample| sample.time_us == time_us).unwrap();
            let state = VehicleState::from_column_slice(&numbers(&expected["veh_state"][k]));
            worst_state = worst_state.max((sample.state - state).amax());
            for (ours, theirs) in sample.current_mps.iter().zip(numbers(&expected["current"][k])) {
                worst_state = worst_state.max((ours - theirs).abs());
            }
            let p = numbers(&expected["P_xx_xy_yy_psi_u_v"][k]);
            for (state, variance) in [(X, p[0]), (Y, p[2]), (PSI, p[3]), (U, p[4]), (V, p[5])] {
                worst_covariance = worst_covariance.max((sample.sigma[state].powi(2) / variance - 1.0).abs());
            }
            worst_covariance = worst_covariance.max((sample.cov_xy_m2 - p[1]).abs() / (p[0] * p[2]).sqrt());
        }
        let ranges: Vec<_> = run.fusions.iter().filter(|record| record.sensor == Sensor::Range).collect();
        let theirs = expected["range_innovation_S"].as_array().unwrap();
        assert_eq!(ranges.len(), theirs.len());
        for (ours, theirs) in ranges.iter().zip(theirs) {
            let theirs = numbers(theirs);
            assert_eq!(ours.time_us, (theirs[0] * 1e6).round() as u64);
            worst_innovation = worst_innovation.max((ours.innovation - theirs[1]).abs());
            worst_covariance = worst_covariance.max((ours.variance / theirs[2] - 1.0).abs());
        }
        // The reference discretises with matrix exponentials, the filter with series cut off at 1e-6 of
        // the process noise of a step; what that leaves in a variance moves the state far less.
        let worst = [worst_state, worst_innovation, worst_covariance];
        println!("{name}: {worst:?}");
        assert!(worst_state < 1e-6 && worst_innovation < 1e-6 && worst_covariance < 1e-5, "{name}: {worst:?}");
    }
}

#[test]
fn two_runs_give_the_same_bits() {
    let (log, mini) = (log(), mini_run());
    let options = options(&log, &mini, ProcessModel::Dynamic);
    let run = || filter::run(&log, &VehicleFile::reference(), &options).unwrap();
    let (a, b) = (run(), run());
    assert_eq!((a.digest, &a.track), (b.digest, &b.track));
    let mut other = options;
    other.navigation.sensors.range_m = 2.0;
    assert_ne!(filter::run(&log, &VehicleFile::reference(), &other).unwrap().digest, a.digest);
}

#[test]
fn packets_do_nearly_as_well_as_the_centralized_filter() {
    let (log, mini) = (log(), mini_run());
    let mut options = options(&log, &mini, ProcessModel::Dynamic);
    options.use_range_rate = true;
    let central = filter::run(&log, &VehicleFile::reference(), &options).unwrap();
    options.ship = ShipSource::Packet;
    let packet = filter::run(&log, &VehicleFile::reference(), &options).unwrap();
    assert!(packet.sensors.iter().all(|summary| summary.sensor != Sensor::ShipGnss));
    let range = |run: &filter::FilterRun| run.sensors.iter().find(|s| s.sensor == Sensor::Range).unwrap().fused;
    assert_eq!(range(&packet), range(&central));
    let last = |run: &filter::FilterRun| *run.track.last().unwrap();
    // Each packet's ship error (0.5 m) is below a range's (1 m): the two may differ by about one sigma.
    let apart = (last(&packet).state - last(&central).state).fixed_rows::<2>(0).norm();
    assert!(apart < last(&central).drms_m(), "{apart}");
    assert!(last(&packet).drms_m() < 1.5 * last(&central).drms_m());
}

#[test]
fn a_launch_between_rows_and_a_late_row_are_taken_at_their_own_times() {
    let (mut log, mini) = (log(), mini_run());
    let options = options(&log, &mini, ProcessModel::Dynamic);
    let before = filter::run(&log, &VehicleFile::reference(), &options).unwrap();
    // The first packet is reported two seconds late, in a row of its own time of arrival.
    use backseat_logs::Column;
    let at = log.rows.iter().position(|row| row.get(Column::Range).is_some()).unwrap();
    let (range_m, tol_s) = (log.rows[at].get(Column::Range).unwrap(), log.rows[at].get(Column::Tol).unwrap());
    let arrival_us = log.rows[at].time_us;
    for column in [Column::Range, Column::RangeRate, Column::Tol, Column::Toa] {
        log.rows[at].set(column, f64::NAN);
    }
    let late = log.rows.iter().position(|row| row.time_us >= arrival_us + 2_000_000).unwrap();
    let toa_s = arrival_us as f64 * 1e-6;
    log.rows[late].set(Column::Range, range_m).set(Column::Tol, tol_s).set(Column::Toa, toa_s);
    let after = filter::run(&log, &VehicleFile::reference(), &options).unwrap();
    assert_eq!(before.digest, after.digest);
}

/// Information only adds: no smoothed variance exceeds the filtered one, and at the end both are the same.
#[test]
fn val_smoothing_never_adds_uncertainty() {
    let (log, mini) = (log(), mini_run());
    let mut options = options(&log, &mini, ProcessModel::Dynamic);
    options.smooth = true;
    let run = filter::run(&log, &VehicleFile::reference(), &options).unwrap();
    let smoothed = run.smoothed.unwrap();
    assert_eq!(smoothed.len(), run.track.len());
    let mut gain = 0.0_f64;
    for (after, before) in smoothed.iter().zip(&run.track) {
        assert_eq!(after.time_us, before.time_us);
        for i in 0..12 {
            assert!(after.sigma[i] <= before.sigma[i] * (1.0 + 1.0e-9), "state {i} at {} µs", after.time_us);
            gain = gain.max(before.sigma[i] / after.sigma[i]);
        }
    }
    assert!(gain > 1.5, "the largest gain is {gain}");
    let (after, before) = (smoothed.last().unwrap(), run.track.last().unwrap());
    assert_eq!((after.state, after.sigma), (before.state, before.sigma));
}
