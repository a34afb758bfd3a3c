//! The vehicle of the experiment, as it is and as it is declared.

use backseat_core::dynamics::{FinGeometry, VehicleParameters};
use backseat_core::identification::theta::{B1, M11, theta_of, with_theta};
use core::f64::consts::{FRAC_PI_2, FRAC_PI_6, PI};
use hil_sim::rng::{Source, Stream};
use hil_sim::truth::{Fin, Parameters};

/// φ and lever of top, bottom, port, starboard.
const FINS: [(f64, [f64; 3]); 4] = [
    (-FRAC_PI_2, [-0.9, 0.0, -0.11]),
    (FRAC_PI_2, [-0.9, 0.0, 0.11]),
    (PI, [-0.9, -0.11, 0.0]),
    (0.0, [-0.9, 0.11, 0.0]),
];

/// The vehicle as it is.
pub(super) fn truth([d26, d35]: [f64; 2]) -> Parameters {
    Parameters {
        mass_kg: 38.0,
        displaced_mass_kg: 38.3,
        rho_kg_per_m3: 1025.0,
        g_mps2: 9.81,
        length_m: 2.16,
        hull_radius_m: 0.0735,
        cb_to_cg_m: [0.0, 0.0, 0.015],
        inertia: [38.8, 75.0, 73.5, 0.17, 24.1, 24.9],
        quadratic_drag: [3.4, 170.0, 160.0, 0.12, 46.0, 50.0],
        d26,
        d35,
        linear_surge_ns_per_m: 0.0,
        moment_uu: [0.0; 3],
        z_uw: 0.0,
        fins: FINS.map(|(phi_rad, cp_m)| Fin {
            phi_rad,
            cp_m,
            gain: 1.0,
            area_m2: 0.011,
            cd: [0.012, 1.4],
            cl: [3.2, -6.0],
            stall_rad: PI,
        }),
        fin_max_rad: FRAC_PI_6,
        servo_rate_radps: f64::INFINITY,
        thrust_n_s2_per_rad2: 5.0e-4,
        advance_n_s2_per_rad_m: 0.0,
        torque_arm_m: 0.0,
        propeller_max_radps: 190.0,
        propeller_lag_s: 0.0,
        disturbance_per_sqrt_hz: [0.0; 6],
    }
}

/// The simulator's plant with a vehicle's parameters, physical or not.
pub(super) fn plant_of(vehicle: &VehicleParameters) -> Parameters {
    let truth = truth([vehicle.d26, vehicle.d35]);
    let (area_m2, cd, cl) = (vehicle.fin_area_m2, vehicle.cd, vehicle.cl);
    Parameters {
        mass_kg: vehicle.mass_kg,
        displaced_mass_kg: vehicle.displaced_mass_kg,
        cb_to_cg_m: vehicle.b_cb_to_cg_m,
        inertia: vehicle.m_diag,
        quadratic_drag: vehicle.quadratic_diag,
        fins: truth.fins.map(|fin| Fin { area_m2, cd, cl, ..fin }),
        thrust_n_s2_per_rad2: vehicle.beta5_n_s2_per_rad2,
        ..truth
    }
}

/// The vehicle as it would be declared without error; without cross drag.
#[must_use]
pub fn declared() -> VehicleParameters {
    let truth = truth([0.0; 2]);
    VehicleParameters {
        length_m: truth.length_m,
        mass_kg: truth.mass_kg,
        displaced_mass_kg: truth.displaced_mass_kg,
        b_cb_to_cg_m: truth.cb_to_cg_m,
        m_diag: truth.inertia,
        quadratic_diag: truth.quadratic_drag,
        fins: FINS.map(|(phi_rad, cp_m)| FinGeometry { phi_rad, cp_m, gain: 1.0 }),
        fin_area_m2: truth.fins[0].area_m2,
        cd: truth.fins[0].cd,
        cl: truth.fins[0].cl,
        stall_rad: PI,
        beta5_n_s2_per_rad2: truth.thrust_n_s2_per_rad2,
        omega_max_radps: truth.propeller_max_radps,
        ..VehicleParameters::IVER3
    }
}

/// A prior wrong by up to `share` (uniform) in every parameter but m11, the scale; B1 and B2, zero in truth, by up to
/// `share` of B3.
#[must_use]
pub fn wrong_prior(share: f64, seed: u64) -> VehicleParameters {
    let mut random = Stream::new(seed, Source::Disturbance);
    let truth = theta_of(&declared());
    let mut theta = truth;
    for j in 0..theta.len() {
        let size = if j == B1 || j == B1 + 1 { truth[B1 + 2] } else { truth[j] };
        let error = share * (2.0 * random.uniform() - 1.0) * size;
        if j != M11 {
            theta[j] += error;
        }
    }
    with_theta(&declared(), &theta)
}
