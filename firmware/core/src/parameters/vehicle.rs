//! The vehicle's plant and actuator parameters as one validated set.

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

/// What the maker (or an identification) declares about a vehicle.
///
/// The names are those of the vehicle file (`[vehicle]`, `[inertia]`, `[drag]`, `[fins]`,
/// `[propeller]`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehicleParameters {
    /// Length over all, m.
    pub length_m: f64,
    /// Hull diameter, m.
    pub diameter_m: f64,
    /// Dry mass m, kg.
    pub mass_kg: f64,
    /// ρV: displaced mass, kg; more than `mass_kg` floats.
    pub displaced_mass_kg: f64,
    /// Water density ρ, kg/m³.
    pub rho_kg_per_m3: f64,
    /// Gravity g, m/s².
    pub g_mps2: f64,
    /// b: vector from the centre of buoyancy to the centre of gravity, body frame, m.
    pub b_cb_to_cg_m: [f64; 3],
    /// Diagonal of M (3.6): rigid body plus added mass, kg and kg m².
    pub m_diag: [f64; 6],
    /// Diagonal quadratic drag d_ii > 0 (3.7 corrected), N s²/m² and N m s²/rad².
    pub quadratic_diag: [f64; 6],
    /// Off-diagonal quadratic drag of (4.21): row 2 += d26 |r| r, row 6 += d26 |v| v.
    pub d26: f64,
    /// Off-diagonal quadratic drag of (4.21): row 3 += d35 |q| q, row 5 += d35 |w| w.
    pub d35: f64,
    /// Linear surge drag, N s/m.
    pub linear_surge_ns_per_m: f64,
    /// K_uu, M_uu, N_uu: moments u|u| of a hull that is not symmetric, or of fins off their zero, N s²/m.
    pub moment_uu: [f64; 3],
    /// Z_uw: lift of the hull, Z += Z_uw |u| w, kg/m.
    pub z_uw: f64,
    /// The four fins: top, bottom, port, starboard.
    pub fins: [FinGeometry; FINS],
    /// Planform area of one fin, m².
    pub fin_area_m2: f64,
    /// [β1, β2] of C_D = β1 + β2 α² (1, 1/rad²).
    pub cd: [f64; 2],
    /// [β3, β4] of C_L = β3 α + β4 α³ (1/rad, 1/rad³).
    pub cl: [f64; 2],
    /// Incidence beyond which C_L and C_D keep their values, rad; π leaves the polynomials alone everywhere.
    pub stall_rad: f64,
    /// Mechanical limit of the fins, rad.
    pub delta_max_rad: f64,
    /// β5 of thrust = β5 ω|ω| (3.24), N s²/rad².
    pub beta5_n_s2_per_rad2: f64,
    /// k of thrust −= k ω u (advance of the propeller), N s²/(rad m).
    pub advance_n_s2_per_rad_m: f64,
    /// Arm of the propeller's reaction torque, K = −arm T, m; positive rolls to port going ahead.
    pub torque_arm_m: f64,
    /// Largest propeller speed, rad/s.
    pub omega_max_radps: f64,
}

impl VehicleParameters {
    /// The reference vehicle: Iver3-like, 0.147 m x 2.0 m, 38 kg. Engineering estimates with the
    /// REMUS-100 values of Prestero (2001) as guide; no maker publishes them.
    #[allow(clippy::approx_constant)] // the vehicle file rounds 30°, and so does this
    pub const IVER3: Self = Self {
        length_m: 2.0,
        diameter_m: 0.147,
        mass_kg: 38.0,
        displaced_mass_kg: 38.15,
        rho_kg_per_m3: 1025.0,
        g_mps2: 9.81,
        b_cb_to_cg_m: [0.0, 0.0, 0.015],
        m_diag: [39.3, 74.0, 74.0, 0.20, 20.0, 20.0],
        quadratic_diag: [3.0, 170.0, 170.0, 0.30, 60.0, 60.0],
        d26: 0.0,
        d35: 0.0,
        linear_surge_ns_per_m: 0.0,
        moment_uu: [0.0; 3],
        z_uw: 0.0,
        fins: [
            FinGeometry { phi_rad: -FRAC_PI_2, cp_m: [-0.85, 0.0, -0.13], gain: 1.0 },
            FinGeometry { phi_rad: FRAC_PI_2, cp_m: [-0.85, 0.0, 0.13], gain: 1.0 },
            FinGeometry { phi_rad: PI, cp_m: [-0.85, -0.13, 0.0], gain: 1.0 },
            FinGeometry { phi_rad: 0.0, cp_m: [-0.85, 0.13, 0.0], gain: 1.0 },
        ],
        fin_area_m2: 0.009,
        cd: [0.02, 1.2],
        cl: [3.1, -4.0],
        // Past the peak of C_L at 0.51 rad; the polynomials are fitted to attached flow only.
        stall_rad: 0.7,
        delta_max_rad: 0.5236,
        beta5_n_s2_per_rad2: 3.0e-4,
        advance_n_s2_per_rad_m: 0.0,
        torque_arm_m: 0.0,
        omega_max_radps: 200.0,
    };
}
