//! `pitch_trim`: the centre of gravity stands before or behind the centre of buoyancy.
//!
//! The angle is atan(b_x / b_z), b from the centre of buoyancy to the centre of gravity, beyond what is declared.

use super::{EffectInfo, Enters, Hooks, Motion, ParameterInfo, info::with};
use crate::dynamics::VehicleParameters;
use nalgebra::Vector6;

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "pitch_trim",
    parameters: &[ParameterInfo::symmetric("rad", "rad", 0.5)],
    enters: Enters::Process,
    equations: "b_x = b_z tan(atan2(b_x, b_z) + rad)",
    signature: "A steady pitch moment: the pitch or the elevator is off by an angle that falls with speed",
    confused_with: &[
        with(
            "pitch_sensor",
            "Straight and level flight only: a bias of the pitch sensor looks the same",
            "Dive: a bias of the sensor changes neither depth rate nor elevator",
        ),
        with("fin_bias", "The log has one speed only, and the fin is port or starboard", "Fly at two propeller speeds"),
        with(
            "buoyancy_offset",
            "The log has one speed only",
            "Fly at two propeller speeds, or drift for a minute with the propeller stopped",
        ),
    ],
    hooks: Hooks { plant: Some(plant), wrench_by: Some(wrench_by), ..Hooks::NONE },
};

fn plant(values: &[f64], _: f64, plant: &mut VehicleParameters) {
    if let ([angle], [x, _, z]) = (values, &mut plant.b_cb_to_cg_m) {
        *x = *z * libm::tan(libm::atan2(*x, *z) + angle);
    }
}

/// ∂b_x/∂rad = b_z (1 + (b_x / b_z)²), and the moment B × s of it.
fn wrench_by(_: usize, at: &Motion<'_>) -> Vector6<f64> {
    let [x, _, z] = at.plant.b_cb_to_cg_m;
    if z == 0.0 {
        return Vector6::zeros();
    }
    let moment_nm = at.plant.displaced_mass_kg * at.plant.g_mps2 * (z + x * x / z);
    Vector6::new(0.0, 0.0, 0.0, 0.0, -moment_nm * at.down.z, moment_nm * at.down.y)
}
