//! The vehicle's plant and actuator parameters as one validated set.

use super::{FINS, cross_drag_limit};
use core::f64::consts::{FRAC_PI_2, PI};
use core::fmt;

/// Where a fin sits and how it is turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FinGeometry {
    /// Active rotation φ_i of the fin frame about body x, rad; its y axis points outboard.
    pub phi_rad: f64,
    /// Centre of pressure from the centre of gravity, body frame, m.
    pub cp_m: [f64; 3],
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
    /// Largest propeller speed, rad/s.
    pub omega_max_radps: f64,
}

/// Why a parameter set was refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ParameterError {
    /// Key of the vehicle file, e.g. `inertia.m_diag`.
    pub key: &'static str,
    /// Position inside an array, 0 for scalars; nested arrays count on (`fins.cp_m`: 3 fin + axis).
    pub index: usize,
    /// The value that was refused.
    pub value: f64,
    /// Smallest value allowed.
    pub min: f64,
    /// Largest value allowed.
    pub max: f64,
}

impl fmt::Display for ParameterError {
    /// Key and index only: formatting of floats is left to the host.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}[{}] is outside its range", self.key, self.index)
    }
}

impl core::error::Error for ParameterError {}

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
        fins: [
            FinGeometry { phi_rad: -FRAC_PI_2, cp_m: [-0.85, 0.0, -0.13] },
            FinGeometry { phi_rad: FRAC_PI_2, cp_m: [-0.85, 0.0, 0.13] },
            FinGeometry { phi_rad: PI, cp_m: [-0.85, -0.13, 0.0] },
            FinGeometry { phi_rad: 0.0, cp_m: [-0.85, 0.13, 0.0] },
        ],
        fin_area_m2: 0.009,
        cd: [0.02, 1.2],
        cl: [3.1, -4.0],
        // Past the peak of C_L at 0.51 rad; the polynomials are fitted to attached flow only.
        stall_rad: 0.7,
        delta_max_rad: 0.5236,
        beta5_n_s2_per_rad2: 3.0e-4,
        advance_n_s2_per_rad_m: 0.0,
        omega_max_radps: 200.0,
    };

    /// Checks every value against its physical range.
    ///
    /// The ranges span vehicles from a hand-launched glider to a midget submarine; they catch slips (a unit, a
    /// sign, a missing exponent), not poor estimates. Drag must take energy out of every motion, so that
    /// d26 and d35 are bounded by [`cross_drag_limit`] of their axes.
    ///
    /// # Errors
    /// The first parameter that is not finite or outside its range.
    pub fn validate(&self) -> Result<(), ParameterError> {
        self.validate_from(0.0)
    }

    /// [`Self::validate`] of a vehicle with effects: fitted ones may take more linear drag or advance away than was
    /// declared.
    pub(crate) fn validate_with_effects(&self) -> Result<(), ParameterError> {
        self.validate_from(-1.0)
    }

    /// `least` is the smallest part of the largest linear drag and advance.
    fn validate_from(&self, least: f64) -> Result<(), ParameterError> {
        let scalar = |key, value, range| check(key, 0, value, range);

        scalar("vehicle.length_m", self.length_m, [0.1, 50.0])?;
        scalar("vehicle.diameter_m", self.diameter_m, [0.01, 10.0])?;
        scalar("vehicle.mass_kg", self.mass_kg, [0.1, 1.0e5])?;
        scalar("vehicle.displaced_mass_kg", self.displaced_mass_kg, [0.1, 1.0e5])?;
        // Fresh water at 100 °C to Dead Sea brine.
        scalar("vehicle.rho_kg_per_m3", self.rho_kg_per_m3, [950.0, 1300.0])?;
        // Anywhere on Earth.
        scalar("vehicle.g_mps2", self.g_mps2, [9.76, 9.84])?;
        check_from("vehicle.b_cb_to_cg_m", 0, &self.b_cb_to_cg_m, [-1.0, 1.0])?;

        let (m, d) = (self.m_diag.split_at(3), self.quadratic_diag.split_at(3));
        check_from("inertia.m_diag", 0, m.0, [0.1, 1.0e6])?;
        check_from("inertia.m_diag", 3, m.1, [1.0e-6, 1.0e7])?;
        check_from("drag.quadratic_diag", 0, d.0, [1.0e-3, 1.0e6])?;
        check_from("drag.quadratic_diag", 3, d.1, [1.0e-6, 1.0e7])?;
        let cross = |a: usize, b: usize| {
            let limit = cross_drag_limit(self.quadratic_diag[a], self.quadratic_diag[b]);
            [-limit, limit]
        };
        scalar("drag.d26", self.d26, cross(1, 5))?;
        scalar("drag.d35", self.d35, cross(2, 4))?;
        scalar("drag.linear_surge_ns_per_m", self.linear_surge_ns_per_m, [least * 1.0e5, 1.0e5])?;

        for (i, fin) in self.fins.iter().enumerate() {
            check("fins.phi_rad", i, fin.phi_rad, [-2.0 * PI, 2.0 * PI])?;
        }
        for (i, fin) in self.fins.iter().enumerate() {
            check_from("fins.cp_m", 3 * i, &fin.cp_m, [-25.0, 25.0])?;
        }
        scalar("fins.area_m2", self.fin_area_m2, [1.0e-6, 10.0])?;
        check_from("fins.cd", 0, &self.cd, [1.0e-6, 100.0])?;
        // A flat plate of infinite span has 2π per radian; CL must rise with incidence.
        check("fins.cl", 0, self.cl[0], [1.0e-3, 20.0])?;
        check("fins.cl", 1, self.cl[1], [-1.0e3, 1.0e3])?;
        scalar("fins.stall_rad", self.stall_rad, [1.0e-2, PI])?;
        scalar("fins.delta_max_rad", self.delta_max_rad, [1.0e-3, FRAC_PI_2])?;

        scalar("propeller.beta5_n_s2_per_rad2", self.beta5_n_s2_per_rad2, [1.0e-9, 10.0])?;
        scalar("propeller.advance_n_s2_per_rad_m", self.advance_n_s2_per_rad_m, [least * 10.0, 10.0])?;
        scalar("propeller.omega_max_radps", self.omega_max_radps, [1.0, 1.0e4])
    }
}

fn check(key: &'static str, index: usize, value: f64, [min, max]: [f64; 2]) -> Result<(), ParameterError> {
    // A NaN is in no range; infinities are in none of the finite ones used here.
    if (min..=max).contains(&value) { Ok(()) } else { Err(ParameterError { key, index, value, min, max }) }
}

/// `first` is the position of the first value in its array.
fn check_from(key: &'static str, first: usize, values: &[f64], range: [f64; 2]) -> Result<(), ParameterError> {
    values.iter().enumerate().try_for_each(|(i, &value)| check(key, first + i, value, range))
}
