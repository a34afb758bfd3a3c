//! Reading of the reference files' arrays, the vehicle of ident_vectors.json, comparison.

use backseat_core::dynamics::{ActuatorInput, FinGeometry, VehicleModel, VehicleParameters};
use nalgebra::{Vector3, Vector6};
use serde_json::Value;

pub fn ident() -> Value {
    serde_json::from_str(include_str!("../data/ident_vectors.json")).expect("JSON")
}

pub fn model(parameters: &VehicleParameters) -> VehicleModel {
    VehicleModel::new(parameters).expect("valid parameters")
}

/// The numbers of a JSON array.
pub fn numbers(value: &Value) -> Vec<f64> {
    let array = value.as_array().unwrap_or_else(|| panic!("not an array: {value}"));
    array.iter().map(|number| number.as_f64().expect("a number")).collect()
}

/// The numbers of a JSON matrix, row-major.
pub fn matrix(value: &Value) -> Vec<f64> {
    value.as_array().expect("a matrix").iter().flat_map(numbers).collect()
}

pub fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// The vehicle of ident_vectors.json (tests/data/README.md). Its fins stand in the order right, top, left,
/// bottom in passive frames: φ_active = −φ_passive, δ_active = −δ_passive.
pub const VEHICLE: VehicleParameters = {
    use core::f64::consts::{FRAC_PI_2, PI};
    const fn fin(phi_rad: f64, y: f64, z: f64) -> FinGeometry {
        FinGeometry { phi_rad, cp_m: [-0.9, y, z], gain: 1.0 }
    }
    VehicleParameters {
        length_m: 2.16,
        displaced_mass_kg: 38.3,
        m_diag: [38.8, 75.0, 73.5, 0.17, 24.1, 24.9],
        quadratic_diag: [3.4, 170.0, 160.0, 0.12, 46.0, 50.0],
        fins: [fin(-FRAC_PI_2, 0.0, -0.11), fin(FRAC_PI_2, 0.0, 0.11), fin(PI, -0.11, 0.0), fin(0.0, 0.11, 0.0)],
        fin_area_m2: 0.011,
        cd: [0.012, 1.4],
        cl: [3.2, -6.0],
        beta5_n_s2_per_rad2: 5.0e-4,
        omega_max_radps: 190.0,
        stall_rad: PI, // the source has none
        ..VehicleParameters::IVER3
    }
};

/// Where [top, bottom, port, starboard] stand in ident_vectors.json.
pub const IDENT_FIN: [usize; 4] = [1, 3, 2, 0];

/// v, Euler angles and ξ of a state of ident_vectors.json.
pub fn state(state: &Value) -> (Vector6<f64>, Vector3<f64>, ActuatorInput) {
    (
        Vector6::from_column_slice(&numbers(&state["v"])),
        Vector3::new(number(&state["phi"]), number(&state["theta"]), number(&state["psi"])),
        input(state),
    )
}

pub fn input(state: &Value) -> ActuatorInput {
    let delta = numbers(&state["delta_frame"]);
    ActuatorInput { propeller_radps: number(&state["omega_p"]), fins_rad: IDENT_FIN.map(|theirs| -delta[theirs]) }
}

/// Compares number by number: |ours − theirs| ≤ tolerance (1 + |theirs|).
pub fn assert_close<'a>(
    ours: impl IntoIterator<Item = &'a f64>,
    theirs: impl IntoIterator<Item = &'a f64>,
    tolerance: f64,
    what: &str,
) {
    let (ours, theirs): (Vec<_>, Vec<_>) = (ours.into_iter().collect(), theirs.into_iter().collect());
    assert_eq!(ours.len(), theirs.len(), "{what}");
    for (i, (a, b)) in ours.iter().zip(&theirs).enumerate() {
        let error = (*a - *b).abs() / (1.0 + b.abs());
        assert!(error <= tolerance, "{what}[{i}]: {a} instead of {b}, error {error:e}");
    }
}
