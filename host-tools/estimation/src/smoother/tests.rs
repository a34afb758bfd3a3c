//! Covariances of a flight whose ranges contradict the filter.

use super::adjoint::Adjoint;
use super::{Filtered, Recording, Step};
use crate::filter::FilterOptions;
use backseat_core::dynamics::{ActuatorInput, VehicleModel};
use backseat_core::navigation::{
    AcousticPath, InitialState, Measurement, NavigationConfig, Navigator, Sensor, ShipEnd, ShipReport, VehicleEnd,
};
use backseat_core::state::{PSI, U, VEHICLE_STATES, VehicleState, X, Y};
use backseat_logs::VehicleFile;
use nalgebra::SMatrix;

type Matrix = SMatrix<f64, VEHICLE_STATES, VEHICLE_STATES>;

/// Length of the flight, and when the fixes at its end begin, s.
const END_S: u64 = 560;
const FIXES_S: u64 = 545;
/// From here on the ship reports a place that is wrong.
const WRONG_S: u64 = 150;
/// By so much, north, m: more than any gate lets in.
const WRONG_M: f64 = 40.0;

fn navigator(config: &NavigationConfig) -> Box<Navigator> {
    let mut navigator = Box::new(Navigator::new());
    navigator.configure(config, &VehicleModel::new(&VehicleFile::reference().parameters).unwrap()).unwrap();
    let mut state = VehicleState::zeros();
    (state[2], state[PSI], state[U]) = (3.0, 0.4, 1.0);
    let sigma = VehicleState::from_column_slice(&[1.0, 1.0, 0.1, 0.02, 0.02, 0.02, 0.1, 0.05, 0.05, 0.02, 0.02, 0.02]);
    navigator.initialise(0, &InitialState { state, sigma }).unwrap();
    navigator
}

/// The bank over a flight with a range every 5 s. The ship reports its place wrong until `right_s`.
fn flight(right_s: u64) -> Recording {
    let robust = NavigationConfig { surface: None, ..FilterOptions::robust(&VehicleFile::reference()).navigation };
    // No measurement moves it.
    let mut truth = navigator(&NavigationConfig { surface: None, ..NavigationConfig::REFERENCE });
    let mut recording = Recording::new(navigator(&robust));
    recording.keep();
    let input = ActuatorInput { propeller_radps: 106.0, fins_rad: [0.0; 4] };
    for second in 1..=END_S {
        let time_us = second * 1_000_000;
        truth.predict(time_us, &input).unwrap();
        recording.predict(time_us, &input).unwrap();
        let (x, k) = (*truth.state(), second as f64);
        recording.fuse(&Measurement::Depth { z_m: x[2] + 0.06 * (1.3 * k).sin() });
        let error_rad = 0.02 * (0.9 * k).sin();
        recording.fuse(&Measurement::Attitude { euler_rad: [x[3] + error_rad, x[4] - error_rad, x[5] + error_rad] });
        if second % 5 == 0 {
            let (sin, cos) = (0.01 * k).sin_cos();
            let ship = [x[X] + 300.0 * cos, x[Y] + 300.0 * sin];
            let wrong_m = if (WRONG_S..right_s).contains(&second) { WRONG_M } else { 0.0 };
            let report = ShipReport {
                position_m: [ship[0] + wrong_m, ship[1]],
                velocity_mps: [0.0; 2],
                position_sigma_m: 0.5,
                velocity_sigma_mps: 0.1,
            };
            let path = AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Reported(report) };
            recording.fuse(&Measurement::Range { path, range_m: 300.0_f64.hypot(x[2]) + (2.1 * k).sin() });
        }
        if second >= FIXES_S {
            recording.fuse(&Measurement::VehicleGnss { position_m: [x[X] + 0.5, x[Y] - 0.5] });
        }
        recording.sample();
    }
    recording
}

/// The smallest eigenvalue of a covariance, each state in units of this sigma.
fn least_eigenvalue(covariance: impl Fn(usize, usize) -> f64, sigma: impl Fn(usize) -> f64) -> f64 {
    let symmetric = |i: usize, j: usize| 0.5 * (covariance(i, j) + covariance(j, i));
    Matrix::from_fn(|i, j| symmetric(i, j) / (sigma(i) * sigma(j))).symmetric_eigenvalues().min()
}

/// 0 < P − P Λ P ≤ P.
fn check(filtered: &Filtered, adjoint: &Adjoint) {
    let (p, smoothed, t_s) = (&filtered.covariance, adjoint.covariance(filtered), filtered.time_us / 1_000_000);
    let least = least_eigenvalue(|i, j| smoothed[i][j], |i| smoothed[i][i].sqrt());
    // Far above rounding: no combination of states is known exactly.
    assert!(least > 1.0e-4, "{t_s} s: the smoothed covariance has the eigenvalue {least:e}");
    let least = least_eigenvalue(|i, j| p[i][j] - smoothed[i][j], |i| p[i][i].sqrt());
    // Rounding.
    assert!(least > -1.0e-12, "{t_s} s: P - P Lambda P exceeds P: eigenvalue {least:e}");
}

/// Half an hour that ends at the surface, where depth and attitude leave place, speed and water as they are, and with
/// fixes.
fn surfacing() -> Recording {
    let robust = FilterOptions::robust(&VehicleFile::reference()).navigation;
    let mut recording = Recording::new(navigator(&robust));
    recording.keep();
    let input = ActuatorInput { propeller_radps: 106.0, fins_rad: [0.0; 4] };
    for second in 1..=1800_u64 {
        recording.predict(second * 1_000_000, &input).unwrap();
        let (k, x) = (second as f64, *recording.state());
        let depth_m = (3.0 - 0.02 * (k - 900.0)).clamp(0.1, 3.0);
        recording.fuse(&Measurement::Depth { z_m: depth_m + 0.06 * (1.3 * k).sin() });
        let error_rad = 0.02 * (0.9 * k).sin();
        recording.fuse(&Measurement::Attitude { euler_rad: [error_rad, -error_rad, 0.4 + error_rad] });
        if second > 1500 {
            recording.fuse(&Measurement::VehicleGnss { position_m: [x[X] + 0.5 * (0.7 * k).sin(), x[Y]] });
        }
        recording.sample();
    }
    recording
}

/// Checks every sample of every filter.
fn check_all(recording: &Recording) {
    for k in 0..recording.members().len() {
        let mut adjoint = Adjoint::new();
        for stretch in (0..recording.stretches()).rev() {
            for step in recording.repeat(stretch)[k].iter().flat_map(|stretch| stretch.steps.0.iter().rev()) {
                adjoint.back(std::slice::from_ref(step));
                if let Step::Sample(filtered) = step {
                    check(filtered, &adjoint);
                }
            }
        }
    }
}

#[test]
fn a_smoothed_covariance_is_positive_where_sensors_are_not_heeded_by_all_states() {
    check_all(&surfacing());
}

#[test]
fn a_smoothed_covariance_is_positive_and_no_greater_than_the_filtered_one() {
    for right_s in [300, END_S] {
        let recording = flight(right_s);
        assert!(recording.main().recoveries(Sensor::Range) > 0, "ranges were suspect");
        let members = recording.members();
        for k in (0..members.len()).filter(|k| members[*k].is_some()) {
            let (mut adjoint, mut unconfirmed) = (Adjoint::new(), 0);
            for stretch in (0..recording.stretches()).rev() {
                let Some(stretch) = &recording.repeat(stretch)[k] else { panic!("filter {k} runs") };
                for step in stretch.steps.0.iter().rev() {
                    adjoint.back(std::slice::from_ref(step));
                    if let Step::Sample(filtered) = step {
                        check(filtered, &adjoint);
                        unconfirmed += u32::from(filtered.unconfirmed_m2[0] > 0.0);
                    }
                }
            }
            assert!(unconfirmed > 100, "ranges were unconfirmed for {unconfirmed} s");
        }
    }
}
