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

crate::with_defaults! {
    /// What the maker (or an identification) declares about a vehicle.
    ///
    /// The names are those of the vehicle file (`[vehicle]`, `[inertia]`, `[drag]`, `[fins]`,
    /// `[propeller]`).
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct VehicleParameters;
    /// The reference vehicle: Iver3-like, 0.147 m x 2.0 m, 38 kg. Engineering estimates with the
    /// REMUS-100 values of Prestero (2001) as guide; no maker publishes them.
    #[allow(clippy::approx_constant)] // the vehicle file rounds 30°, and so does this
    const IVER3 {
        /// Length over all, m.
        length_m: f64 = 2.0,
        /// Hull diameter, m.
        diameter_m: f64 = 0.147,
        /// Dry mass m, kg.
        mass_kg: f64 = 38.0,
        /// ρV: displaced mass, kg; more than `mass_kg` floats.
        displaced_mass_kg: f64 = 38.15,
        /// Water density ρ, kg/m³.
        rho_kg_per_m3: f64 = 1025.0,
        /// Gravity g, m/s².
        g_mps2: f64 = 9.81,
        /// b: vector from the centre of buoyancy to the centre of gravity, body frame, m.
        b_cb_to_cg_m: [f64; 3] = [0.0, 0.0, 0.015],
        /// Diagonal of M (3.6): rigid body plus added mass, kg and kg m².
        m_diag: [f64; 6] = [39.3, 74.0, 74.0, 0.20, 20.0, 20.0],
        /// Diagonal quadratic drag d_ii > 0 (3.7 corrected), N s²/m² and N m s²/rad².
        quadratic_diag: [f64; 6] = [3.0, 170.0, 170.0, 0.30, 60.0, 60.0],
        /// Off-diagonal quadratic drag of (4.21): row 2 += d26 |r| r, row 6 += d26 |v| v.
        d26: f64 = 0.0,
        /// Off-diagonal quadratic drag of (4.21): row 3 += d35 |q| q, row 5 += d35 |w| w.
        d35: f64 = 0.0,
        /// Linear surge drag, N s/m.
        linear_surge_ns_per_m: f64 = 0.0,
        /// K_uu, M_uu, N_uu: moments u|u| of a hull that is not symmetric, or of fins off their zero, N s²/m.
        moment_uu: [f64; 3] = [0.0; 3],
        /// Z_uw: lift of the hull, Z += Z_uw |u| w, kg/m.
        z_uw: f64 = 0.0,
        /// The four fins: top, bottom, port, starboard.
        fins: [FinGeometry; FINS] = [
            FinGeometry { phi_rad: -FRAC_PI_2, cp_m: [-0.85, 0.0, -0.13], gain: 1.0 },
            FinGeometry { phi_rad: FRAC_PI_2, cp_m: [-0.85, 0.0, 0.13], gain: 1.0 },
            FinGeometry { phi_rad: PI, cp_m: [-0.85, -0.13, 0.0], gain: 1.0 },
            FinGeometry { phi_rad: 0.0, cp_m: [-0.85, 0.13, 0.0], gain: 1.0 },
        ],
        /// Planform area of one fin, m².
        fin_area_m2: f64 = 0.009,
        /// [β1, β2] of C_D = β1 + β2 α² (1, 1/rad²).
        cd: [f64; 2] = [0.02, 1.2],
        /// [β3, β4] of C_L = β3 α + β4 α³ (1/rad, 1/rad³).
        cl: [f64; 2] = [3.1, -4.0],
        /// Incidence beyond which C_L and C_D keep their values, rad; π leaves the polynomials alone everywhere.
        // Past the peak of C_L at 0.51 rad; the polynomials are fitted to attached flow only.
        stall_rad: f64 = 0.7,
        /// Mechanical limit of the fins, rad.
        delta_max_rad: f64 = 0.5236,
        /// β5 of thrust = β5 ω|ω| (3.24), N s²/rad².
        beta5_n_s2_per_rad2: f64 = 3.0e-4,
        /// k of thrust −= k ω u (advance of the propeller), N s²/(rad m).
        advance_n_s2_per_rad_m: f64 = 0.0,
        /// Arm of the propeller's reaction torque, K = −arm T, m; positive rolls to port going ahead.
        torque_arm_m: f64 = 0.0,
        /// Largest propeller speed, rad/s.
        omega_max_radps: f64 = 200.0,
    }
}
