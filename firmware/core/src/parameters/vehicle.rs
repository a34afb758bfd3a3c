//! The vehicle's plant and actuator parameters as one validated set.

use super::Shape;
use core::f64::consts::{FRAC_PI_2, PI};

/// Number of fins; their order everywhere is top, bottom, port, starboard.
pub const FINS: usize = 4;

/// Where a fin sits and how it is turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FinGeometry {
    /// Active rotation φ_i of the fin frame about body x, rad; its y axis points outboard.
    pub phi_rad: f64,
    /// Centre of pressure from the centre of gravity, body frame, m.
    pub cp_m: [f64; 3],
    /// The angle that it takes over the angle commanded: 1 for a linkage as calibrated.
    pub gain: f64,
}

crate::declared! {
    /// What the maker (or an identification) declares about a vehicle.
    ///
    /// The names are those of the vehicle file (`[vehicle]`, `[inertia]`, `[drag]`, `[fins]`,
    /// `[propeller]`).
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct VehicleParameters;
    /// The reference vehicle: Iver3-like, 0.147 m x 2.0 m, 38 kg. Engineering estimates with the
    /// REMUS-100 values of Prestero (2001) as guide; no maker publishes them.
    #[allow(clippy::approx_constant)] // the vehicle file rounds 30°, and so does this
    const IVER3, with {
        /// The four fins: top, bottom, port, starboard.
        fins: [FinGeometry; FINS] = [
            FinGeometry { phi_rad: -FRAC_PI_2, cp_m: [-0.85, 0.0, -0.13], gain: 1.0 },
            FinGeometry { phi_rad: FRAC_PI_2, cp_m: [-0.85, 0.0, 0.13], gain: 1.0 },
            FinGeometry { phi_rad: PI, cp_m: [-0.85, -0.13, 0.0], gain: 1.0 },
            FinGeometry { phi_rad: 0.0, cp_m: [-0.85, 0.13, 0.0], gain: 1.0 },
        ],
    };
    /// Plant and actuators: rows of the table of parameters.
    const ROWS {
        [real "vehicle.length_m", "L", "m", [0.1, 50.0]] "Length over all." length_m: f64 = 2.0,
        [real "vehicle.diameter_m", "D", "m", [0.01, 10.0]] "Diameter of the hull." diameter_m: f64 = 0.147,
        [real "vehicle.mass_kg", "m", "kg", [0.1, 1.0e5]] "Dry mass." mass_kg: f64 = 38.0,
        [real "vehicle.displaced_mass_kg", "rho V", "kg", [0.1, 1.0e5]] "Mass of the displaced water; a vehicle floats if it is more than the mass." displaced_mass_kg: f64 = 38.15,
        // From hot fresh water to the brine of the Dead Sea (1240), and as far as effects.water_density takes it from
        // there.
        [real "vehicle.rho_kg_per_m3", "rho", "kg/m^3", [950.0, 1300.0]] "Density of the water." rho_kg_per_m3: f64 = 1025.0,
        // Anywhere on Earth.
        [real "vehicle.g_mps2", "g", "m/s^2", [9.76, 9.84]] "Acceleration of gravity." g_mps2: f64 = 9.81,
        [vector[0, 3 of 3] "vehicle.b_cb_to_cg_m", "b", "m", [-1.0, 1.0]] "Vector from the centre of buoyancy to the centre of gravity, body frame; +z: stable." b_cb_to_cg_m: [f64; 3] = [0.0, 0.0, 0.015],

        [vector[0, 3 of 6] "inertia.m_diag", "m_11, m_22, m_33", "kg", [0.1, 1.0e6]] "Diagonal of the mass matrix M (3.6)." m_diag: [f64; 6] = [39.3, 74.0, 74.0, 0.20, 20.0, 20.0],
        [vector[3, 3 of 6] "inertia.m_diag", "m_44, m_55, m_66", "kg m^2", [1.0e-6, 1.0e7]] "Diagonal of the mass matrix M (3.6)." (m_diag),

        [vector[0, 3 of 6] "drag.quadratic_diag", "d_11, d_22, d_33", "N s^2/m^2", [1.0e-3, 1.0e6]] "Diagonal of the quadratic drag (3.7 corrected)." quadratic_diag: [f64; 6] = [3.0, 170.0, 170.0, 0.30, 60.0, 60.0],
        [vector[3, 3 of 6] "drag.quadratic_diag", "d_44, d_55, d_66", "N m s^2/rad^2", [1.0e-6, 1.0e7]] "Diagonal of the quadratic drag (3.7 corrected)." (quadratic_diag),
        [real "drag.d26", "d_26", "N s^2/rad^2", [-1.0e7, 1.0e7]] "Off-diagonal drag (4.21): |r| r on sway, |v| v on yaw." d26: f64 = 0.0,
        [real "drag.d35", "d_35", "N s^2/rad^2", [-1.0e7, 1.0e7]] "Off-diagonal drag (4.21): |q| q on heave, |w| w on pitch." d35: f64 = 0.0,
        [real "drag.linear_surge_ns_per_m", "d_u", "N s/m", [0.0, 1.0e5]] "Linear drag in surge." linear_surge_ns_per_m: f64 = 0.0,
        [vector[0, 3 of 3] "drag.moment_uu", "K_uu, M_uu, N_uu", "N s^2/m", [-1.0e4, 1.0e4]] "Moments with u |u| of a hull that is not symmetric, or of fins off their zero." moment_uu: [f64; 3] = [0.0; 3],
        [real "drag.z_uw", "Z_uw", "kg/m", [-1.0e5, 1.0e5]] "Lift of the hull: Z += z_uw |u| w; negative: against the heave." z_uw: f64 = 0.0,

        [elements[Shape::Vector(4), 0, 4] "fins.phi_rad", "phi_i", "rad", [-2.0 * PI, 2.0 * PI]] "Rotation of the fin's frame about body x; its y axis points outboard." (
            |s, i| s.fins.get(i).map_or(f64::NAN, |fin| fin.phi_rad),
            |s, i, value| if let Some(fin) = s.fins.get_mut(i) { fin.phi_rad = value; }
        ),
        [elements[Shape::Matrix(4, 3), 0, 12] "fins.cp_m", "r_i", "m", [-25.0, 25.0]] "Centre of pressure of a fin from the centre of gravity, body frame." (
            |s, i| s.fins.get(i / 3).and_then(|fin| fin.cp_m.get(i % 3)).copied().unwrap_or(f64::NAN),
            |s, i, value| if let Some(place) = s.fins.get_mut(i / 3).and_then(|fin| fin.cp_m.get_mut(i % 3)) { *place = value; }
        ),
        // A fin that turns against its command is wired wrongly; one that does not turn is a fault and no vehicle.
        [elements[Shape::Vector(4), 0, 4] "fins.gain", "", "1", [-3.0, 3.0]] "Angle that a fin takes over the angle commanded." (
            |s, i| s.fins.get(i).map_or(f64::NAN, |fin| fin.gain),
            |s, i, value| if let Some(fin) = s.fins.get_mut(i) { fin.gain = value; }
        ),
        [real "fins.area_m2", "A", "m^2", [1.0e-6, 10.0]] "Planform area of one fin." fin_area_m2: f64 = 0.009,
        [vector[0, 1 of 2] "fins.cd", "beta_1", "1", [1.0e-6, 100.0]] "Drag coefficient of a fin: beta1 + beta2 alpha^2." cd: [f64; 2] = [0.02, 1.2],
        [vector[1, 1 of 2] "fins.cd", "beta_2", "1/rad^2", [1.0e-6, 100.0]] "Drag coefficient of a fin: beta1 + beta2 alpha^2." (cd),
        // A flat plate of infinite span has 2 pi per radian; lift must rise with incidence, or the fins steer the wrong
        // way.
        [vector[0, 1 of 2] "fins.cl", "beta_3", "1/rad", [1.0e-3, 20.0]] "Lift coefficient of a fin: beta3 alpha + beta4 alpha^3." cl: [f64; 2] = [3.1, -4.0],
        [vector[1, 1 of 2] "fins.cl", "beta_4", "1/rad^3", [-1.0e3, 1.0e3]] "Lift coefficient of a fin: beta3 alpha + beta4 alpha^3." (cl),
        // Past the peak of C_L at 0.51 rad; the polynomials are fitted to attached flow only. Pi leaves them alone
        // everywhere.
        [real "fins.stall_rad", "alpha_s", "rad", [1.0e-2, PI]] "Incidence beyond which lift and drag coefficient keep their values." stall_rad: f64 = 0.7,
        [real "fins.delta_max_rad", "delta_max", "rad", [1.0e-3, FRAC_PI_2]] "Mechanical limit of the fins." delta_max_rad: f64 = 0.5236,

        [real "propeller.beta5_n_s2_per_rad2", "beta_5", "N s^2/rad^2", [1.0e-9, 10.0]] "Thrust is beta5 omega |omega| (3.24)." beta5_n_s2_per_rad2: f64 = 3.0e-4,
        [real "propeller.advance_n_s2_per_rad_m", "k", "N s^2/(rad m)", [0.0, 10.0]] "Thrust lost with speed: k omega u." advance_n_s2_per_rad_m: f64 = 0.0,
        [real "propeller.torque_arm_m", "", "m", [-1.0, 1.0]] "Reaction torque of the propeller over its thrust: K = -arm T; positive rolls to port ahead." torque_arm_m: f64 = 0.0,
        [real "propeller.omega_max_radps", "omega_max", "rad/s", [1.0, 1.0e4]] "Largest speed of the propeller." omega_max_radps: f64 = 200.0,
    }
}
