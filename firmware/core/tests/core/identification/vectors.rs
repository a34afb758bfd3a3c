//! Against the independent implementation's numbers (tests/data/README.md).

use super::support::{VEHICLE, assert_close, ident, input, matrix, model, number, numbers, state};
use backseat_core::dynamics::Attitude;
use backseat_core::identification::aid::{AidState, Instant, heun, rates};
use backseat_core::identification::regressor::{Regressor, cross_drag_columns, regressor};
use backseat_core::identification::theta::{B1, BETA1, D11, M11, NAMES, Theta, W, theta_of, with_theta};
use nalgebra::{SMatrix, Vector3, Vector6};
use serde_json::Value;

/// The same formulas in another language and order of operations: rounding only.
const ROUNDING: f64 = 1.0e-11;
/// The same, after a Heun step whose fast fin parameters reach hundreds.
const HEUN: f64 = 1.0e-10;

fn instant(value: &Value) -> Instant {
    let (v, euler, input) = state(value);
    Instant::new(&model(&VEHICLE), &v, &Attitude::new(&euler).down(), &input)
}

#[test]
fn val_theta_is_the_vehicle_in_the_reference_order() {
    let ident = ident();
    let names: Vec<_> = ident["theta_names"].as_array().expect("names").iter().map(|n| n.as_str()).collect();
    assert_eq!(names, NAMES.map(Some));
    assert_close(&theta_of(&VEHICLE), &numbers(&ident["theta"]), ROUNDING, "theta");
    assert_eq!(NAMES[W], "w");
    assert_eq!([NAMES[M11], NAMES[D11], NAMES[B1], NAMES[BETA1]], ["m11", "d11", "B1", "beta1"]);
}

#[test]
fn theta_and_vehicle_convert_both_ways() {
    let theta = theta_of(&VEHICLE);
    // Anything of θ changes nothing else, and a change in w is a change in mass.
    let mut changed = theta * 1.1;
    changed[W] = theta[W] + VEHICLE.g_mps2;
    let vehicle = with_theta(&VEHICLE, &changed);
    assert_close(&theta_of(&vehicle), &changed, ROUNDING, "there and back");
    assert!((vehicle.mass_kg - 39.0).abs() < 1.0e-12, "one kilogram heavier");
    assert_eq!(vehicle.displaced_mass_kg, VEHICLE.displaced_mass_kg);
    assert_eq!(vehicle.fins, VEHICLE.fins);
}

#[test]
fn val_regressor_matches_and_annihilates_theta() {
    let ident = ident();
    let theta = Theta::from_column_slice(&numbers(&ident["theta"]));
    for state in ident["states"].as_array().expect("states") {
        let at = instant(state);
        let a = Vector6::from_column_slice(&numbers(&state["vdot"]));
        let mut y = Regressor::zeros();
        regressor(&a, &at.velocity, &at.down, &at.actuators, &mut y);
        assert_close(&y.transpose(), &matrix(&state["regressor_Y_at_vdot"]), ROUNDING, "Y");
        // Newtons and newton metres, of terms of tens.
        assert_close(&(y * theta), &[0.0; 6], 1.0e-10, "Y theta");
    }
}

/// Columns of the least-squares problem in terms of ours: d26 and d35 after the drags, no B1 and B2.
fn nullspace_rows(row: &Value) -> SMatrix<f64, 6, 21> {
    let v = Vector6::from_column_slice(&numbers(&row["v"]));
    let a = Vector6::from_column_slice(&numbers(&row["vdot"]));
    let s = Vector3::from_column_slice(&numbers(&row["s"]));
    let at = Instant::new(&model(&VEHICLE), &v, &s, &input(row));
    let mut y = Regressor::zeros();
    regressor(&a, &v, &s, &at.actuators, &mut y);
    let cross = cross_drag_columns(&v);
    SMatrix::from_fn(|i, j| match j {
        0..12 => y[(i, j)],
        12..14 => cross[(i, j - 12)],
        14 => y[(i, W)],
        _ => y[(i, j)],
    })
}

#[test]
fn val_nullspace_rows_match() {
    let ident = ident();
    let small = &ident["nbls_small"];
    let mut normal = SMatrix::<f64, 21, 21>::zeros();
    for (i, row) in small["rows"].as_array().expect("rows").iter().enumerate() {
        let w = nullspace_rows(row);
        if i == 0 {
            assert_close(&w.transpose(), &matrix(&small["W_first_row_block"]), ROUNDING, "W");
        }
        normal += w.transpose() * w;
    }
    // Sums of squares up to 1e10.
    assert_close(&normal, &matrix(&small["WtW"]), ROUNDING, "WtW");
}

#[test]
fn val_adaptive_steps_match() {
    let ident = ident();
    let states = ident["states"].as_array().expect("states");
    let steps = ident["aid"].as_array().expect("steps");
    assert_eq!(steps.len(), 3);
    for step in steps {
        let [first, second] = [0, 1].map(|i| {
            let index = step["state_indices"][i].as_u64().expect("an index");
            instant(&states[index as usize])
        });
        let x = AidState {
            velocity: Vector6::from_column_slice(&numbers(&step["v_hat"])),
            theta: Theta::from_column_slice(&numbers(&step["theta_hat"])),
        };
        let gains = Theta::from_column_slice(&numbers(&step["Gamma_diag"]));
        let (alpha, dt) = (number(&step["alpha"]), number(&step["dt"]));

        let rates = rates(&x, alpha, &first);
        assert_close(&rates.model_acceleration, &numbers(&step["psi2"]), ROUNDING, "psi2");
        assert_close(&rates.velocity, &numbers(&step["v_hat_dot"]), ROUNDING, "v_hat_dot");
        let theta_dot = rates.gradient.component_mul(&gains);
        assert_close(&theta_dot, &numbers(&step["theta_hat_dot"]), ROUNDING, "theta_hat_dot");
        // θ̂ᵀ Γ⁻¹ θ̂ does not change: a sum of 21 terms of up to a few hundred that cancels.
        assert!(x.theta.dot(&rates.gradient).abs() < 1.0e-11, "{:e}", x.theta.dot(&rates.gradient));

        let next = heun(&x, &rates, &gains, alpha, &second, dt);
        assert_close(&next.velocity, &numbers(&step["heun_v_hat_next"]), HEUN, "v_hat");
        assert_close(&next.theta, &numbers(&step["heun_theta_hat_next"]), HEUN, "theta_hat");
    }
}
