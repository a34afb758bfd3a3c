//! `water_density`: true minus declared density of the water, as a CTD gives it.
//!
//! Buoyancy, drag, fins, thrust and the added mass of translation (for the Munk moment it makes) are proportional to
//! it; the added inertia of rotation, by which transients change by less than a percent, is left as declared.

use super::{EffectInfo, Enters, Hooks, ParameterInfo, info::with};
use crate::dynamics::VehicleParameters;

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "water_density",
    parameters: &[ParameterInfo::symmetric("offset_kg_per_m3", "kg/m^3", 40.0)],
    enters: Enters::Process,
    equations: "rho += offset; rho V, D, M_A, beta5 and k in proportion",
    signature: "As buoyancy_offset. Thrust and drag change alike, so that the speed at a given propeller speed \
                stays",
    confused_with: &[with("buoyancy_offset", "The log has no water density", "Log the water density (CTD)")],
    hooks: Hooks { plant: Some(plant), ..Hooks::NONE },
};

fn plant(values: &[f64], _: f64, plant: &mut VehicleParameters) {
    let [offset] = values else { return };
    let ratio = (plant.rho_kg_per_m3 + offset) / plant.rho_kg_per_m3;
    let p = plant;
    for inertia in &mut p.m_diag[..3] {
        *inertia = p.mass_kg + ratio * (*inertia - p.mass_kg);
    }
    let quadratic = p.quadratic_diag.iter_mut().chain([&mut p.d26, &mut p.d35]);
    let actuators = [&mut p.beta5_n_s2_per_rad2, &mut p.advance_n_s2_per_rad_m];
    let buoyancy = [&mut p.rho_kg_per_m3, &mut p.displaced_mass_kg];
    for value in quadratic.chain(actuators).chain(buoyancy) {
        *value *= ratio;
    }
}
