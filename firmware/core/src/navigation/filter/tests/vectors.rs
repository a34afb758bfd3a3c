//! Discretisation, prediction and updates against `tests/data/nav_vectors.json`, an independent implementation
//! with dense matrices (Van Loan by matrix exponential). Its layout is vehicle 12, ship 6, ship clone 6, current 2.

#![allow(clippy::disallowed_methods)] // the tests' own arithmetic need not have the same bits on every machine

extern crate std;

use crate::dynamics::{ActuatorInput, VehicleModel, VehicleParameters};
use crate::navigation::algebra::discretisation::{DRIVING, Discretisation};
use crate::navigation::algebra::layout::{CLONE_STATES, CloneKind, N_MAX};
use crate::navigation::algebra::propagation;
use crate::navigation::filter::cekf::Filter;
use crate::navigation::sources::dvl;
use crate::navigation::*;
use crate::state::VehicleState;
use serde_json::Value;
use std::{boxed::Box, vec::Vec};

const N: usize = 26;

fn vectors() -> Value {
    serde_json::from_str(include_str!("../../../../tests/data/nav_vectors.json")).expect("vectors")
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("array").iter().map(|v| v.as_f64().expect("number")).collect()
}

fn input(value: &Value) -> ActuatorInput {
    let xi = numbers(value);
    ActuatorInput { propeller_radps: xi[0], fins_rad: [xi[1], xi[2], xi[3], xi[4]] }
}

fn model() -> VehicleModel {
    VehicleModel::new(&VehicleParameters::IVER3).expect("reference vehicle")
}

/// Place of our state i in the vectors' layout: ours is vehicle, current, ship, clone.
fn theirs(i: usize) -> usize {
    match i {
        0..12 => i,
        12..14 => 24 + i - 12,
        _ => i - 2,
    }
}

/// A filter in the state of `predict_step` before (`X`, `P`) or after it (`X_pred`, `P_pred`), with its ship clone.
fn navigator(vectors: &Value, x: &str, p: &str) -> (Box<Filter>, CloneId) {
    let case = &vectors["predict_step"];
    let config = NavigationConfig {
        ship_noise: ShipNoise { linear_mps2_per_sqrt_hz: 2.0e-2, angular_radps2_per_sqrt_hz: 1.0e-3 },
        effect_states: EffectStates::water_current(0.3, 1.0e-4),
        gate_sigma: 1.0e3,
        ..NavigationConfig::REFERENCE
    };
    let mut navigator = Box::new(Filter::new());
    navigator.configure(&config, &model()).expect("valid");
    let one = VehicleState::repeat(1.0);
    navigator.initialise(0, &InitialState { state: one, sigma: one }).expect("valid");
    navigator.initialise_ship(&InitialShip { state: [0.0; 6], sigma: [1.0; 6] }, &mut ()).expect("valid");
    let clone = navigator.clone_ship(&mut ()).expect("free");
    let x = numbers(&case[x]);
    navigator.x.vehicle = VehicleState::from_column_slice(&x[..12]);
    for i in 12..N {
        navigator.x.tail[i - 12] = x[theirs(i)];
    }
    for j in 0..N {
        let column = numbers(&case[p][theirs(j)]);
        for i in j..N {
            navigator.p.set(i, j, column[theirs(i)]);
        }
    }
    (navigator, clone)
}

/// Largest deviation of state and covariance; covariances in units of the two sigmas.
fn deviation(navigator: &Filter, x: &Value, p: &Value) -> (f64, f64) {
    let (x, mut dx, mut dp) = (numbers(x), 0.0_f64, 0.0_f64);
    for j in 0..N {
        let column = numbers(&p[theirs(j)]);
        dx = dx.max((navigator.x.get(j) - x[theirs(j)]).abs());
        for i in 0..N {
            let scale = (navigator.variance(i) * navigator.variance(j)).sqrt();
            dp = dp.max((navigator.covariance(i, j) - column[theirs(i)]).abs() / scale);
        }
    }
    (dx, dp)
}

#[test]
fn val_discretisation_is_van_loan() {
    let vectors = vectors();
    let case = &vectors["discretisation"];
    let x = VehicleState::from_column_slice(&numbers(&case["x"]));
    let linearisation = model().linearise(&x, &input(&case["xi"]));
    let psd: [f64; 6] = numbers(&case["qc_accel_psd"]).try_into().expect("six");
    let mut step = Box::new(Discretisation::new());
    step.compute(&linearisation, &psd, case["dt"].as_f64().expect("dt"));
    let next = numbers(&case["x_next_zoh"]);
    let mut worst = [0.0_f64; 3];
    let q_scale: Vec<f64> = (0..12).map(|i| case["Qd_vanloan"][i][i].as_f64().expect("number").sqrt()).collect();
    for i in 0..12 {
        worst[1] = worst[1].max((x[i] + step.increment[i] - next[i]).abs());
        let (phi, q) = (numbers(&case["Phi"][i]), numbers(&case["Qd_vanloan"][i]));
        for j in 0..12 {
            let ours = match DRIVING.iter().position(|&state| state == j) {
                Some(k) => step.phi[k][i],
                None if i == j => 1.0,
                None if j == crate::state::PSI && i < 2 => step.phi_heading[i],
                None => 0.0,
            };
            worst[0] = worst[0].max((ours - phi[j]).abs());
            worst[2] = worst[2].max((step.q[i.min(j)][i.max(j)] - q[j]).abs() / (q_scale[i] * q_scale[j]));
        }
    }
    // What the truncated series leaves (its bound is 3e-8 of a norm that exceeds the spectral radius twofold), far
    // below the error of holding F over the step (2e-5 in x, `zoh_vs_exact_max`).
    // What the truncated series leaves, far below the error of holding F over the step (2e-5 in x,
    // `zoh_vs_exact_max`), and the four-point quadrature of Q_d, as correlation.
    assert!(worst[0] < 1e-6 && worst[1] < 1e-9 && worst[2] < 1e-5, "{worst:?}");
}

#[test]
fn val_predict_step() {
    let vectors = vectors();
    let case = &vectors["predict_step"];
    let (mut navigator, _) = navigator(&vectors, "X", "P");
    navigator.predict(100_000, &input(&case["xi"]), &mut ()).expect("healthy");
    let (dx, dp) = deviation(&navigator, &case["X_pred"], &case["P_pred"]);
    // The series' error as above; P to the same relative size.
    assert!(dx < 1e-9 && dp < 1e-6, "{dx:e} {dp:e}");
}

#[test]
fn val_range_and_range_rate_update() {
    let vectors = vectors();
    for name in ["range_update", "range_rate_update"] {
        let case = &vectors[name];
        let number = |key: &str| case[key].as_f64().expect("number");
        let (mut navigator, clone) = navigator(&vectors, "X_pred", "P_pred");
        let path = AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Delayed(clone) };
        navigator.config.sensors.range_m = number("R").sqrt();
        navigator.config.sensors.range_rate_mps = number("R").sqrt();
        let measurement = if name == "range_update" {
            Measurement::Range { path, range_m: number("z") }
        } else {
            Measurement::RangeRate { path, range_rate_mps: number("z") }
        };
        let fusions = navigator.fuse(&measurement, &mut ());
        let record = fusions.iter().next().expect("one scalar");
        // Rounding of some hundred operations on numbers up to 1e3.
        assert!((record.innovation - (number("z") - number("z_pred"))).abs() < 1e-12 * number("z").abs().max(1.0));
        assert!((record.variance / number("S") - 1.0).abs() < 1e-13);
        assert!((record.nis() / number("nis") - 1.0).abs() < 1e-11);
        let (dx, dp) = deviation(&navigator, &case["X_post"], &case["P_post"]);
        assert!(dx < 1e-12 && dp < 1e-13, "{name} {dx:e} {dp:e}");
        let gain = numbers(&case["K"]);
        for i in 0..N {
            assert!((navigator.gain[i] - gain[theirs(i)]).abs() < 1e-13 * gain[theirs(i)].abs().max(1.0));
        }
    }
}

#[test]
fn val_dvl_model() {
    let vectors = vectors();
    let case = &vectors["dvl_model"];
    let (navigator, _) = navigator(&vectors, "X_pred", "P_pred");
    let mut observations = crate::navigation::algebra::observation::Observations::new();
    dvl::observe_bottom(&navigator.x, &[0.0; 3], 0.01, &mut observations);
    for (i, observation) in observations.as_slice().iter().enumerate() {
        // Rounding only.
        assert!((observation.innovation + numbers(&case["z_pred"])[i]).abs() < 1e-15);
        let row = numbers(&case["H"][i]);
        for j in 0..N {
            let ours: f64 = observation.row.iter().filter(|(k, _)| *k == j).map(|(_, value)| value).sum();
            // The reference differentiates numerically, its own rounding is some 1e-12.
            assert!((ours - row[theirs(j)]).abs() < 1e-10, "{i} {j}");
        }
    }
}

#[test]
fn long_steps_equal_many_short_ones_of_the_same_model() {
    let vectors = vectors();
    let case = &vectors["discretisation"];
    let x = VehicleState::from_column_slice(&numbers(&case["x"]));
    let linearisation = model().linearise(&x, &input(&case["xi"]));
    let psd = ProcessNoise::DYNAMIC.psd();
    let (mut long, mut short) = (Box::new(Discretisation::new()), Box::new(Discretisation::new()));
    long.compute(&linearisation, &psd, 0.8);
    short.compute(&linearisation, &psd, 0.1);
    // Φ(0.8) column by column, as the eighth power.
    for (k, &state) in DRIVING.iter().enumerate() {
        let mut a = [0.0; 12];
        a[state] = 1.0;
        for _ in 0..8 {
            a = short.times(&a);
        }
        for i in 0..12 {
            // Eight times the series' error.
            assert!((a[i] - long.phi[k][i]).abs() < 1e-6, "{k} {i}");
        }
    }
    let mut p = crate::navigation::algebra::covariance::Covariance::new();
    for _ in 0..8 {
        propagation::propagate_vehicle(&mut p, 12, &short);
    }
    for j in 0..12 {
        for i in j..12 {
            let scale = (p.get(i, i) * p.get(j, j)).sqrt();
            assert!((p.get(i, j) - long.q[j][i]).abs() < 1e-5 * scale, "{i} {j}");
        }
    }
}

#[test]
fn layout_moves_blocks_without_mixing_them() {
    let vectors = vectors();
    let (mut navigator, ship_clone) = navigator(&vectors, "X_pred", "P_pred");
    let before: Vec<f64> = (0..N).map(|i| navigator.variance(i)).collect();
    let vehicle_clone = navigator.clone_vehicle(&mut ()).expect("free");
    assert_eq!(navigator.clone_vehicle(&mut ()), Err(CloneError::Full));
    assert_eq!(navigator.dimension(), N + CLONE_STATES);
    let velocity: Vec<f64> = (0..6).map(|i| navigator.variance(N + i)).collect();
    navigator.drop_clone(ship_clone, &mut ());
    let at = navigator.x.layout.clone_at(vehicle_clone, CloneKind::Vehicle).expect("held");
    assert_eq!(at, N - CLONE_STATES);
    assert_eq!((0..6).map(|i| navigator.variance(at + i)).collect::<Vec<_>>(), velocity);
    assert_eq!(navigator.covariance(at, 0), navigator.variance(0));
    // Knowing the ship anew moves the vehicle clone out of the way and back.
    navigator.initialise_ship(&InitialShip { state: [7.0; 6], sigma: [2.0; 6] }, &mut ()).expect("valid");
    assert_eq!((0..6).map(|i| navigator.variance(at + i)).collect::<Vec<_>>(), velocity);
    assert_eq!(navigator.covariance(at, 14), 0.0);
    assert_eq!(navigator.covariance(at + 2, 2), navigator.variance(2));
    assert_eq!((0..14).map(|i| navigator.variance(i)).collect::<Vec<_>>(), before[..14]);
    assert_eq!(navigator.ship_state(), Some([7.0; 6]));
    assert!(navigator.dimension() <= N_MAX);
    // A dropped id, an id of the other kind, and ids after a new start.
    let stale = |navigator: &mut Filter, id: CloneId| {
        let path = AcousticPath { vehicle: VehicleEnd::Delayed { clone: id, bridge_s: 0.0 }, ship: ShipEnd::Now };
        navigator
            .fuse(&Measurement::Range { path, range_m: 10.0 }, &mut ())
            .iter()
            .all(|r| r.outcome == FusionOutcome::StaleClone)
    };
    let digest = navigator.digest();
    assert!(stale(&mut navigator, ship_clone));
    let new_ship_clone = navigator.clone_ship(&mut ()).expect("free");
    assert!(stale(&mut navigator, new_ship_clone));
    navigator.drop_clone(new_ship_clone, &mut ());
    navigator.drop_clone(new_ship_clone, &mut ());
    assert_eq!(navigator.digest(), digest);
    let one = VehicleState::repeat(1.0);
    navigator.initialise(0, &InitialState { state: one, sigma: one }).expect("valid");
    navigator.clone_vehicle(&mut ()).expect("free");
    assert!(stale(&mut navigator, vehicle_clone));
}
