//! `buoyancy_offset`: true minus declared displaced mass; positive floats more.
//!
//! Ballast, or water of another density if nothing else follows it.

use super::{Confusion, EffectInfo, Enters, Hooks, ParameterInfo};
use crate::dynamics::VehicleParameters;

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "buoyancy_offset",
    parameters: &[ParameterInfo::symmetric("kg", "kg", 2.0)],
    enters: Enters::Process,
    equations: "rho V += kg",
    signature: "heave and pitch differ from the model by a constant force: the vehicle flies level at another pitch",
    confused_with: &[
        Confusion {
            effect: "pitch_trim",
            condition: "one speed",
            separating_manoeuvre: "two propeller speeds, or a minute at rest",
        },
        Confusion {
            effect: "water_density",
            condition: "always, unless the log has the density",
            separating_manoeuvre: "a CTD",
        },
    ],
    hooks: Hooks { plant: Some(plant), ..Hooks::NONE },
};

fn plant(values: &[f64], _: f64, plant: &mut VehicleParameters) {
    if let [offset] = values {
        plant.displaced_mass_kg += offset;
    }
}
