//! `roll_trim`: the centre of gravity stands beside the centre of buoyancy.
//!
//! The angle is atan(b_y / b_z), b from the centre of buoyancy to the centre of gravity, beyond what is declared.

use super::{Confusion, EffectInfo, Enters, Hooks, ParameterInfo};
use crate::dynamics::VehicleParameters;

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "roll_trim",
    parameters: &[ParameterInfo::symmetric("rad", "rad", 0.5)],
    enters: Enters::Process,
    equations: "b_y = b_z tan(atan2(b_y, b_z) + rad)",
    signature: "a steady roll that falls little with speed",
    confused_with: &[Confusion {
        effect: "fin_bias",
        condition: "one speed",
        separating_manoeuvre: "two propeller speeds: a fin's moment grows with speed squared, the trim's falls against it",
    }],
    hooks: Hooks { plant: Some(plant), ..Hooks::NONE },
};

fn plant(values: &[f64], _: f64, plant: &mut VehicleParameters) {
    if let ([angle], [_, y, z]) = (values, &mut plant.b_cb_to_cg_m) {
        *y = *z * libm::tan(libm::atan2(*y, *z) + angle);
    }
}
