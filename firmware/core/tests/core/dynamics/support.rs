//! Vehicles, random states, inputs of the reference file.

use backseat_core::dynamics::{ActuatorInput, VehicleParameters};
use backseat_core::state::VehicleState;
use serde_json::Value;

/// The reference vehicle with everything that is zero on it switched on.
pub fn full_parameters() -> VehicleParameters {
    VehicleParameters {
        b_cb_to_cg_m: [0.003, -0.002, 0.015],
        m_diag: [39.3, 75.0, 73.5, 0.20, 20.0, 21.0],
        quadratic_diag: [3.0, 170.0, 165.0, 0.30, 55.0, 60.0],
        d26: 12.0,
        d35: -9.0,
        linear_surge_ns_per_m: 0.7,
        advance_n_s2_per_rad_m: 0.004,
        stall_rad: core::f64::consts::PI, // the polynomials alone
        ..VehicleParameters::IVER3
    }
}

/// The same with what takes or gives energy along a hull that is not symmetric, fins that turn as they like, and torque.
pub fn lopsided_parameters() -> VehicleParameters {
    let mut parameters = full_parameters();
    for (fin, gain) in parameters.fins.iter_mut().zip([0.3, 1.1, 0.9, -0.8]) {
        fin.gain = gain;
    }
    VehicleParameters { moment_uu: [0.06, -0.3, 0.2], z_uw: -25.0, torque_arm_m: 0.02, ..parameters }
}

pub use crate::random::Random;
pub use crate::shared::{assert_close, ident, matrix, model, numbers};

impl Random {
    /// Any attitude short of the vertical; slow and fast, ahead and astern.
    pub fn state(&mut self) -> VehicleState {
        let scales = [100.0, 100.0, 50.0, 3.0, 1.4, 3.0, 3.0, 1.0, 1.0, 1.0, 1.0, 1.0];
        VehicleState::from(scales.map(|scale| self.within(scale)))
    }

    /// Fins far beyond their stall and mechanical limits.
    pub fn input(&mut self) -> ActuatorInput {
        ActuatorInput { propeller_radps: self.within(150.0), fins_rad: [(); 4].map(|()| self.within(1.5)) }
    }
}

/// ξ of nav_vectors.json.
pub fn input(value: &Value) -> ActuatorInput {
    let xi = numbers(value);
    ActuatorInput { propeller_radps: xi[0], fins_rad: [xi[1], xi[2], xi[3], xi[4]] }
}
