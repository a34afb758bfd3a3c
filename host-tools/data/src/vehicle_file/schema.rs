//! The numbers of a vehicle file: one table for reading, writing and naming them.

use super::VehicleFile;

/// How the numbers of a key are arranged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    Scalar,
    Vector(usize),
    /// Rows, columns.
    Matrix(usize, usize),
}

impl Shape {
    pub(super) const fn len(self) -> usize {
        match self {
            Self::Scalar => 1,
            Self::Vector(n) => n,
            Self::Matrix(rows, columns) => rows * columns,
        }
    }

    /// `[0]`, `[3][2]` or nothing.
    pub(super) fn suffix(self, index: usize) -> String {
        match self {
            Self::Scalar => String::new(),
            Self::Vector(_) => format!("[{index}]"),
            Self::Matrix(_, columns) => format!("[{}][{}]", index / columns, index % columns),
        }
    }
}

/// One key of the vehicle file.
pub(super) struct Field {
    pub section: &'static str,
    pub key: &'static str,
    pub shape: Shape,
    pub unit: &'static str,
    pub meaning: &'static str,
    pub slot: fn(&mut VehicleFile, usize) -> &mut f64,
}

impl Field {
    /// `vehicle.mass_kg`, `inertia.m_diag[0]`, `fins.cp_m[1][2]`.
    pub(super) fn dotted(&self, index: usize) -> String {
        format!("{}.{}{}", self.section, self.key, self.shape.suffix(index))
    }
}

/// Sections in the order of the file, what they are about, and whether they may be left out.
pub(super) const SECTIONS: [(&str, &str, bool); 8] = [
    ("vehicle", "NED; body axes forward, starboard, down; origin = centre of gravity", false),
    ("inertia", "rigid body + added mass (added mass positive)", false),
    ("drag", "positive: opposes motion", false),
    ("fins", "top, bottom, port, starboard", false),
    ("propeller", "thrust = beta5 omega |omega| - advance omega u", false),
    ("noise", "process: square root of the acceleration power spectral density", true),
    ("sensors", "one sigma, white", true),
    ("installation", "lever arms from the centre of gravity, turns and delays of the sensors", true),
];

/// What a board has beyond its vehicle ([`super::BoardFile`]); no concern of a vehicle file.
pub(super) const BOARD_SECTION: &str = "app";

/// Keys of the other sections that may be left out as well (section, key).
pub(super) const OPTIONAL: [(&str, &str); 1] = [("fins", "stall_rad")];

const fn field(
    section: &'static str,
    key: &'static str,
    shape: Shape,
    unit: &'static str,
    meaning: &'static str,
    slot: fn(&mut VehicleFile, usize) -> &mut f64,
) -> Field {
    Field { section, key, shape, unit, meaning, slot }
}

use Shape::{Matrix, Scalar, Vector};

/// Every number, in the order of the file.
#[rustfmt::skip] // a table: one key a line
pub(super) const FIELDS: [Field; 45] = [
    field("vehicle", "length_m", Scalar, "m", "over all", |f, _| &mut f.parameters.length_m),
    field("vehicle", "diameter_m", Scalar, "m", "hull", |f, _| &mut f.parameters.diameter_m),
    field("vehicle", "mass_kg", Scalar, "kg", "dry", |f, _| &mut f.parameters.mass_kg),
    field("vehicle", "displaced_mass_kg", Scalar, "kg", "rho * volume; more than mass_kg floats", |f, _| &mut f.parameters.displaced_mass_kg),
    field("vehicle", "rho_kg_per_m3", Scalar, "kg/m^3", "water density", |f, _| &mut f.parameters.rho_kg_per_m3),
    field("vehicle", "g_mps2", Scalar, "m/s^2", "gravity", |f, _| &mut f.parameters.g_mps2),
    field("vehicle", "b_cb_to_cg_m", Vector(3), "m", "from centre of buoyancy to centre of gravity; +z: stable", |f, i| &mut f.parameters.b_cb_to_cg_m[i]),
    field("inertia", "m_diag", Vector(6), "kg x3, kg m^2 x3", "diagonal of M (3.6)", |f, i| &mut f.parameters.m_diag[i]),
    field("drag", "quadratic_diag", Vector(6), "N s^2/m^2 x3, N m s^2/rad^2 x3", "(3.7 corrected)", |f, i| &mut f.parameters.quadratic_diag[i]),
    field("drag", "d26", Scalar, "N s^2/rad^2, N m s^2/m^2", "(4.21): rows 2 (|r| r) and 6 (|v| v)", |f, _| &mut f.parameters.d26),
    field("drag", "d35", Scalar, "N s^2/rad^2, N m s^2/m^2", "(4.21): rows 3 (|q| q) and 5 (|w| w)", |f, _| &mut f.parameters.d35),
    field("drag", "linear_surge_ns_per_m", Scalar, "N s/m", "linear surge drag", |f, _| &mut f.parameters.linear_surge_ns_per_m),
    field("fins", "phi_rad", Vector(4), "rad", "active rotation about x; y of the fin frame points outboard", |f, i| &mut f.parameters.fins[i].phi_rad),
    field("fins", "cp_m", Matrix(4, 3), "m", "centre of pressure from the centre of gravity", |f, i| &mut f.parameters.fins[i / 3].cp_m[i % 3]),
    field("fins", "area_m2", Scalar, "m^2", "planform of one fin", |f, _| &mut f.parameters.fin_area_m2),
    field("fins", "cd", Vector(2), "1, 1/rad^2", "beta1 + beta2 alpha^2", |f, i| &mut f.parameters.cd[i]),
    field("fins", "cl", Vector(2), "1/rad, 1/rad^3", "beta3 alpha + beta4 alpha^3", |f, i| &mut f.parameters.cl[i]),
    field("fins", "stall_rad", Scalar, "rad", "incidence beyond which cd and cl keep their values", |f, _| &mut f.parameters.stall_rad),
    field("fins", "delta_max_rad", Scalar, "rad", "mechanical limit", |f, _| &mut f.parameters.delta_max_rad),
    field("propeller", "beta5_n_s2_per_rad2", Scalar, "N s^2/rad^2", "thrust of the propeller", |f, _| &mut f.parameters.beta5_n_s2_per_rad2),
    field("propeller", "advance_n_s2_per_rad_m", Scalar, "N s^2/(rad m)", "thrust loss with speed", |f, _| &mut f.parameters.advance_n_s2_per_rad_m),
    field("propeller", "omega_max_radps", Scalar, "rad/s", "largest speed", |f, _| &mut f.parameters.omega_max_radps),
    field("noise", "linear_mps2_per_sqrt_hz", Vector(3), "m/s^2/sqrt(Hz)", "u, v, w", |f, i| &mut f.noise.linear_mps2_per_sqrt_hz[i]),
    field("noise", "angular_radps2_per_sqrt_hz", Vector(3), "rad/s^2/sqrt(Hz)", "p, q, r", |f, i| &mut f.noise.angular_radps2_per_sqrt_hz[i]),
    field("sensors", "depth_m", Scalar, "m", "pressure depth", |f, _| &mut f.sensors.depth_m),
    field("sensors", "attitude_rad", Scalar, "rad", "roll, pitch, heading", |f, _| &mut f.sensors.attitude_rad),
    field("sensors", "rates_radps", Scalar, "rad/s", "p, q, r", |f, _| &mut f.sensors.rates_radps),
    field("sensors", "dvl_mps", Scalar, "m/s", "per axis, over ground", |f, _| &mut f.sensors.dvl_mps),
    field("sensors", "range_m", Scalar, "m", "one-way range", |f, _| &mut f.sensors.range_m),
    field("sensors", "range_rate_mps", Scalar, "m/s", "range rate", |f, _| &mut f.sensors.range_rate_mps),
    field("sensors", "gnss_m", Scalar, "m", "surfaced vehicle, per axis", |f, _| &mut f.sensors.gnss_m),
    field("sensors", "ship_gnss_m", Scalar, "m", "ship, per axis", |f, _| &mut f.sensors.ship_gnss_m),
    field("installation", "dvl_arm_m", Vector(3), "m", "DVL from the centre of gravity, body frame", |f, i| &mut f.installation.dvl_arm_m[i]),
    field("installation", "dvl_turn_rad", Vector(3), "rad", "roll, pitch, yaw of the DVL's axes in the body", |f, i| &mut f.installation.dvl_turn_rad[i]),
    field("installation", "dvl_delay_s", Scalar, "s", "DVL: from validity to the arrival of the last byte", |f, _| &mut f.installation.dvl_delay_s),
    field("installation", "ahrs_turn_rad", Vector(3), "rad", "roll, pitch, yaw of the AHRS' axes in the body", |f, i| &mut f.installation.ahrs_turn_rad[i]),
    field("installation", "ahrs_delay_s", Scalar, "s", "AHRS: from validity to the arrival of the last byte", |f, _| &mut f.installation.ahrs_delay_s),
    field("installation", "depth_arm_m", Vector(3), "m", "pressure sensor from the centre of gravity, body frame", |f, i| &mut f.installation.depth_arm_m[i]),
    field("installation", "depth_delay_s", Scalar, "s", "depth: from validity to the arrival of the last byte", |f, _| &mut f.installation.depth_delay_s),
    field("installation", "gnss_arm_m", Vector(3), "m", "antenna from the centre of gravity, body frame", |f, i| &mut f.installation.gnss_arm_m[i]),
    field("installation", "gnss_delay_s", Scalar, "s", "fix: from validity to the arrival of the last byte", |f, _| &mut f.installation.gnss_delay_s),
    field("installation", "transducer_arm_m", Vector(3), "m", "acoustic transducer from the centre of gravity, body frame", |f, i| &mut f.installation.transducer_arm_m[i]),
    field("installation", "transducer_delay_s", Scalar, "s", "calibrated hardware delay, subtracted from every time of flight", |f, _| &mut f.installation.transducer_delay_s),
    field("installation", "sound_speed_mps", Scalar, "m/s", "sound speed", |f, _| &mut f.installation.sound_speed_mps),
    field("installation", "ship_transducer_depth_m", Scalar, "m", "depth of the ship's transducer", |f, _| &mut f.installation.ship_transducer_depth_m),
];

/// Range of a noise parameter: more than nothing (a filter that trusts a sensor or its model
/// without bound is singular), less than the useless.
const NOISE_RANGE: [f64; 2] = [1.0e-9, 1.0e4];

/// Range of one number, the others being as they are in `file` (which must be valid).
///
/// Plant and actuators have their ranges in the core's validation; it is asked, not repeated.
pub(super) fn range(file: &VehicleFile, field: &Field, index: usize) -> [f64; 2] {
    let mut probe = file.clone();
    *(field.slot)(&mut probe, index) = f64::NAN;
    match probe.parameters.validate() {
        Err(refused) => [refused.min, refused.max],
        Ok(()) => own_range(field, index),
    }
}

/// Range of a number that the core does not check.
fn own_range(field: &Field, index: usize) -> [f64; 2] {
    match backseat_app::parameters::find(&field.dotted(index)) {
        Some(parameter) if field.section == "installation" => [parameter.min, parameter.max],
        _ => NOISE_RANGE,
    }
}

/// The first number outside its range: (field, index, value, range).
pub(super) fn first_outside(file: &VehicleFile) -> Option<(&'static Field, usize, f64, [f64; 2])> {
    if let Err(refused) = file.parameters.validate() {
        let is_it = |field: &&Field| refused.key == format!("{}.{}", field.section, field.key);
        let field = FIELDS.iter().find(is_it)?;
        return Some((field, refused.index, refused.value, [refused.min, refused.max]));
    }
    let mut file = file.clone();
    for field in FIELDS.iter().filter(|field| matches!(field.section, "noise" | "sensors" | "installation")) {
        for index in 0..field.shape.len() {
            let value = *(field.slot)(&mut file, index);
            let [min, max] = own_range(field, index);
            if !(min..=max).contains(&value) {
                return Some((field, index, value, [min, max]));
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The core names a refused parameter by its key; were one of its keys unknown here, the value
    /// would pass unseen.
    #[test]
    fn every_number_is_checked_and_found_under_its_own_key() {
        for field in &FIELDS {
            for index in 0..field.shape.len() {
                let mut file = VehicleFile::reference();
                *(field.slot)(&mut file, index) = f64::NAN;
                let (found, at, ..) = first_outside(&file).expect("NaN is in no range");
                assert_eq!(found.dotted(at), field.dotted(index));
            }
        }
    }
}
