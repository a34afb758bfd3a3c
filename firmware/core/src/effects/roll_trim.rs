//! `roll_trim`: the centre of gravity stands beside the centre of buoyancy.
//!
//! The angle is atan(b_y / b_z), b from the centre of buoyancy to the centre of gravity, beyond what is declared.

use super::{EffectInfo, Enters, Hooks, ParameterInfo, info::with};
use crate::dynamics::VehicleParameters;

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "roll_trim",
    parameters: &[ParameterInfo::symmetric("rad", "rad", 0.5)],
    enters: Enters::Process,
    equations: "b_y = b_z tan(atan2(b_y, b_z) + rad)",
    signature: "A steady roll angle that falls only a little with speed",
    confused_with: &[with(
        "fin_bias",
        "The log has one speed only",
        "Fly at two propeller speeds: the moment of a fin grows with the square of \
                               speed, that of the trim does not",
    )],
    hooks: Hooks { plant: Some(plant), ..Hooks::NONE },
};

fn plant(values: &[f64], _: f64, plant: &mut VehicleParameters) {
    if let ([angle], [_, y, z]) = (values, &mut plant.b_cb_to_cg_m) {
        *y = *z * libm::tan(libm::atan2(*y, *z) + angle);
    }
}
