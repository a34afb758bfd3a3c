//! Against the independent implementation's numbers (tests/data/README.md).

use super::support::{assert_close, ident, input, matrix, model, numbers};
use crate::shared::{IDENT_FIN, VEHICLE};
use backseat_core::dynamics::{
    ActuatorInput, Attitude, VehicleModel, VehicleParameters, coriolis_by_velocity, kinematic_linearise,
};
use backseat_core::state::VehicleState;
use nalgebra::Vector6;
use serde_json::Value;

/// The same formulas in another language and order of operations: rounding only.
const ROUNDING: f64 = 1.0e-11;

fn nav() -> Value {
    serde_json::from_str(include_str!("../../data/nav_vectors.json")).expect("JSON")
}

/// The reference vehicle with a case's `params_override`.
fn overridden(overrides: &Value) -> VehicleParameters {
    // The source has no stall.
    let mut parameters = VehicleParameters { stall_rad: core::f64::consts::PI, ..VehicleParameters::IVER3 };
    for (name, value) in overrides.as_object().expect("an object") {
        let value = value.as_f64().expect("a number");
        match name.as_str() {
            "d26" => parameters.d26 = value,
            "d35" => parameters.d35 = value,
            "bx" => parameters.b_cb_to_cg_m[0] = value,
            "by" => parameters.b_cb_to_cg_m[1] = value,
            "lin_surge" => parameters.linear_surge_ns_per_m = value,
            "k_adv" => parameters.advance_n_s2_per_rad_m = value,
            other => panic!("unknown parameter {other}"),
        }
    }
    parameters
}

#[test]
fn val_process_model_matches_nav_vectors() {
    let nav = nav();
    let cases = nav["process_model"].as_array().expect("cases");
    assert_eq!(cases.len(), 6);
    for case in cases {
        let model = model(&overridden(&case["params_override"]));
        let x = VehicleState::from_column_slice(&numbers(&case["x"]));
        let input = input(&case["xi"]);
        let linearised = model.linearise(&x, &input);
        assert_close(&linearised.f, &numbers(&case["f_dynamic"]), ROUNDING, "f");
        assert_close(&model.derivative(&x, &input), &numbers(&case["f_dynamic"]), ROUNDING, "f");
        assert_close(&linearised.F().transpose(), &matrix(&case["F_dynamic"]), ROUNDING, "F");

        let kinematic = kinematic_linearise(&x);
        assert_close(&kinematic.f, &numbers(&case["f_kinematic"]), ROUNDING, "kinematic f");
        // Their kinematic F is a central difference, good to 1e-9 at these positions' magnitudes.
        assert_close(&kinematic.F().transpose(), &matrix(&case["F_kinematic_fd"]), 1.0e-8, "kinematic F");

        let v = backseat_core::state::velocity(&x);
        let wrenches = model.fin_wrenches(&v, &input.fins_rad);
        for (wrench, name) in wrenches.iter().zip(["top", "bottom", "port", "starboard"]) {
            assert_close(wrench, &numbers(&case["fin_wrenches"][name]), ROUNDING, name);
        }
    }
}

/// One step of the classical Runge-Kutta method.
fn rk4(model: &VehicleModel, x: &VehicleState, input: &ActuatorInput, dt: f64) -> VehicleState {
    let k1 = model.derivative(x, input);
    let k2 = model.derivative(&(x + k1 * (0.5 * dt)), input);
    let k3 = model.derivative(&(x + k2 * (0.5 * dt)), input);
    let k4 = model.derivative(&(x + k3 * dt), input);
    x + (k1 + (k2 + k3) * 2.0 + k4) * (dt / 6.0)
}

#[test]
fn val_open_loop_trajectory_matches_nav_vectors() {
    let nav = nav();
    let trajectory = &nav["open_loop_trajectory"];
    let model = model(&VehicleParameters::IVER3);
    let input = input(&trajectory["xi"]);
    let dt = trajectory["dt_rk4"].as_f64().expect("a number");
    let mut x = VehicleState::from_column_slice(&numbers(&trajectory["x0"]));
    for (second, expected) in trajectory["state_every_1s"].as_array().expect("states").iter().enumerate() {
        // The same method and step: rounding of 2000 steps.
        assert_close(&x, &numbers(expected), 1.0e-10, &format!("state at {second} s"));
        for _ in 0..100 {
            x = rk4(&model, &x, &input, dt);
        }
    }
}

#[test]
fn val_lqr_system_matrix_matches_nav_vectors() {
    let nav = nav();
    let case = &nav["lqr_vehicle"];
    let x = VehicleState::from_column_slice(&numbers(&case["x"]));
    let linearised = model(&VehicleParameters::IVER3).linearise(&x, &input(&case["xi"]));
    assert_close(&linearised.F().transpose(), &matrix(&case["A"]), ROUNDING, "A");
}

#[test]
fn val_every_term_matches_ident_vectors() {
    let ident = ident();
    let plain = model(&VEHICLE);
    let crossed = model(&VehicleParameters { d26: 6.0, d35: -4.0, ..VEHICLE });
    let states = ident["states"].as_array().expect("states");
    assert_eq!(states.len(), 20);
    for state in states {
        let (v, euler, input) = crate::shared::state(state);
        let attitude = Attitude::new(&euler);

        assert_close(&attitude.down(), &numbers(&state["s_RT_e3"]), ROUNDING, "s");
        assert_close(&attitude.rotation().transpose(), &matrix(&state["R_body_to_ned"]), ROUNDING, "R");
        assert_close(&attitude.euler_rate_matrix().transpose(), &matrix(&state["L_euler_rates"]), ROUNDING, "L");
        assert_close(&plain.coriolis(&v), &numbers(&state["coriolis_product"]), ROUNDING, "coriolis");
        assert_close(&plain.drag(&v), &numbers(&state["drag_product"]), ROUNDING, "drag");
        let restoring = plain.restoring().wrench(&attitude.down());
        assert_close(&restoring, &numbers(&state["buoyancy_wrench_applied"]), ROUNDING, "restoring");
        let regressor = plain.actuator_regressor(&v, &input);
        assert_close(&regressor.transpose(), &matrix(&state["G_a"]), ROUNDING, "G_a");

        let wrenches = plain.fin_wrenches(&v, &input.fins_rad);
        for (wrench, theirs) in wrenches.iter().zip(IDENT_FIN.map(|theirs| &state["fins"][theirs])) {
            assert_close(wrench.iter().take(3), &numbers(&theirs["force_body"]), ROUNDING, "fin force");
            assert_close(wrench.iter().skip(3), &numbers(&theirs["moment_body"]), ROUNDING, "fin moment");
        }
        let mut wrench: Vector6<f64> = wrenches.iter().sum();
        wrench[0] += plain.propeller().thrust(input.propeller_radps, v[0]);
        assert_close(&wrench, &numbers(&state["tau"]), ROUNDING, "actuator wrench");

        assert_close(&plain.acceleration(&euler, &v, &input), &numbers(&state["vdot"]), ROUNDING, "acceleration");
        let expected = numbers(&state["vdot_with_d26_6_d35_m4"]);
        assert_close(&crossed.acceleration(&euler, &v, &input), &expected, ROUNDING, "acceleration with d26, d35");
    }
}

#[test]
fn val_coriolis_derivative_holds_the_coriolis_matrix() {
    // ad(v) M v is homogeneous of degree two: its derivative times v is twice the product (Euler).
    let ident = ident();
    let m = VEHICLE.m_diag;
    for state in ident["states"].as_array().expect("states") {
        let v = Vector6::from_column_slice(&numbers(&state["v"]));
        let twice = numbers(&state["coriolis_product"]).iter().map(|value| 2.0 * value).collect::<Vec<_>>();
        assert_close(&(coriolis_by_velocity(&m, &v) * v), &twice, ROUNDING, "derivative times v");
    }
}
