//! `buoyancy_offset`: true minus declared displaced mass; positive floats more.
//!
//! Ballast, or water of another density if nothing else follows it.

use super::{EffectInfo, Enters, Hooks, Motion, ParameterInfo, info::with};
use crate::dynamics::VehicleParameters;
use nalgebra::{Vector3, Vector6};

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "buoyancy_offset",
    parameters: &[ParameterInfo::symmetric("kg", "kg", 2.0)],
    enters: Enters::Process,
    equations: "rho V += kg",
    signature: "A constant vertical force is missing: in level flight the pitch and the elevator differ from \
                the model's",
    confused_with: &[
        with(
            "pitch_trim",
            "The log has one speed only",
            "Fly at two propeller speeds, or drift for a minute with the propeller stopped",
        ),
        with("water_density", "The log has no water density", "Log the water density (CTD)"),
    ],
    hooks: Hooks { plant: Some(plant), wrench_by: Some(wrench_by), ..Hooks::NONE },
};

fn plant(values: &[f64], _: f64, plant: &mut VehicleParameters) {
    if let [offset] = values {
        plant.displaced_mass_kg += offset;
    }
}

/// Buoyancy acts against s at the centre of buoyancy, b from the centre of gravity.
fn wrench_by(_: usize, at: &Motion<'_>) -> Vector6<f64> {
    let force = at.down * -at.plant.g_mps2;
    let moment = Vector3::from(at.plant.b_cb_to_cg_m).cross(at.down) * at.plant.g_mps2;
    Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
}
