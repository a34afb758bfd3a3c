//! Parameters out of range are refused by name.

use super::support::full_parameters;
use backseat_core::dynamics::{VehicleModel, VehicleParameters};

/// Sets one number of a parameter set.
type Set = fn(&mut VehicleParameters, f64);

#[test]
fn reference_vehicle_is_valid() {
    assert!(VehicleParameters::IVER3.validate().is_ok());
    assert!(full_parameters().validate().is_ok());
}

#[test]
fn every_number_is_checked_and_named() {
    let every: [(&str, usize, Set); 37] = [
        ("vehicle.length_m", 0, |p, x| p.length_m = x),
        ("vehicle.diameter_m", 0, |p, x| p.diameter_m = x),
        ("vehicle.mass_kg", 0, |p, x| p.mass_kg = x),
        ("vehicle.displaced_mass_kg", 0, |p, x| p.displaced_mass_kg = x),
        ("vehicle.rho_kg_per_m3", 0, |p, x| p.rho_kg_per_m3 = x),
        ("vehicle.g_mps2", 0, |p, x| p.g_mps2 = x),
        ("vehicle.b_cb_to_cg_m", 0, |p, x| p.b_cb_to_cg_m[0] = x),
        ("vehicle.b_cb_to_cg_m", 2, |p, x| p.b_cb_to_cg_m[2] = x),
        ("inertia.m_diag", 0, |p, x| p.m_diag[0] = x),
        ("inertia.m_diag", 2, |p, x| p.m_diag[2] = x),
        ("inertia.m_diag", 3, |p, x| p.m_diag[3] = x),
        ("inertia.m_diag", 5, |p, x| p.m_diag[5] = x),
        ("drag.quadratic_diag", 0, |p, x| p.quadratic_diag[0] = x),
        ("drag.quadratic_diag", 1, |p, x| p.quadratic_diag[1] = x),
        ("drag.quadratic_diag", 3, |p, x| p.quadratic_diag[3] = x),
        ("drag.quadratic_diag", 5, |p, x| p.quadratic_diag[5] = x),
        ("drag.d26", 0, |p, x| p.d26 = x),
        ("drag.d35", 0, |p, x| p.d35 = x),
        ("drag.linear_surge_ns_per_m", 0, |p, x| p.linear_surge_ns_per_m = x),
        ("drag.moment_uu", 0, |p, x| p.moment_uu[0] = x),
        ("drag.moment_uu", 2, |p, x| p.moment_uu[2] = x),
        ("drag.z_uw", 0, |p, x| p.z_uw = x),
        ("fins.phi_rad", 3, |p, x| p.fins[3].phi_rad = x),
        ("fins.cp_m", 0, |p, x| p.fins[0].cp_m[0] = x),
        ("fins.cp_m", 7, |p, x| p.fins[2].cp_m[1] = x),
        ("fins.gain", 1, |p, x| p.fins[1].gain = x),
        ("fins.area_m2", 0, |p, x| p.fin_area_m2 = x),
        ("fins.cd", 0, |p, x| p.cd[0] = x),
        ("fins.cd", 1, |p, x| p.cd[1] = x),
        ("fins.cl", 0, |p, x| p.cl[0] = x),
        ("fins.cl", 1, |p, x| p.cl[1] = x),
        ("fins.stall_rad", 0, |p, x| p.stall_rad = x),
        ("fins.delta_max_rad", 0, |p, x| p.delta_max_rad = x),
        ("propeller.beta5_n_s2_per_rad2", 0, |p, x| p.beta5_n_s2_per_rad2 = x),
        ("propeller.advance_n_s2_per_rad_m", 0, |p, x| p.advance_n_s2_per_rad_m = x),
        ("propeller.torque_arm_m", 0, |p, x| p.torque_arm_m = x),
        ("propeller.omega_max_radps", 0, |p, x| p.omega_max_radps = x),
    ];
    for (key, index, set) in every {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1.0e9, -1.0e9] {
            let mut parameters = full_parameters();
            set(&mut parameters, value);
            let error = VehicleModel::new(&parameters).expect_err(key);
            assert_eq!((error.key, error.index), (key, index));
            assert!(error.value.is_nan() || !(error.min..=error.max).contains(&error.value));
        }
    }
}

#[test]
fn masses_and_drags_must_be_positive() {
    let zeroed: [Set; 6] = [
        |p, x| p.mass_kg = x,
        |p, x| p.m_diag[3] = x,
        |p, x| p.quadratic_diag[4] = x,
        |p, x| p.cd[0] = x,
        |p, x| p.cd[1] = x,
        |p, x| p.fin_area_m2 = x,
    ];
    for set in zeroed {
        let mut parameters = full_parameters();
        set(&mut parameters, 0.0);
        assert!(parameters.validate().is_err());
    }
}

#[test]
fn val_cross_drag_is_bounded_by_the_energy_condition() {
    let with = |d26, d35| VehicleParameters { d26, d35, ..VehicleParameters::IVER3 }.validate();
    assert!(with(98.0, -98.0).is_ok());
    let error = with(100.0, 0.0).expect_err("creates energy");
    assert_eq!(error.key, "drag.d26");
    // "about 99" by the independent implementation.
    assert!((error.max - 99.0).abs() < 0.5 && error.min == -error.max);
    assert_eq!(with(0.0, -100.0).expect_err("creates energy").key, "drag.d35");
}

#[test]
fn error_names_key_and_position() {
    let error = VehicleParameters { cd: [0.02, -1.0], ..VehicleParameters::IVER3 }.validate().expect_err("negative");
    assert_eq!(error.to_string(), "fins.cd[1] is outside its range");
}
