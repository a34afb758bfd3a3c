//! `linear_drag`: drag that grows with surge itself, beside the quadratic one.
//!
//! A fouled hull, an added instrument. Serves as the filter's drag factor: its state is `surge_ns_per_m`.

use super::{EffectInfo, Enters, Hooks, Motion, ParameterInfo, info::with};
use crate::dynamics::VehicleParameters;
use nalgebra::Vector6;

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "linear_drag",
    parameters: &[ParameterInfo::size("surge_ns_per_m", "N s/m", -5.0, 20.0)],
    enters: Enters::Process,
    equations: "X -= d u",
    signature: "Surge is below the model. The missing force is proportional to speed, from the start of the log",
    confused_with: &[
        with("thrust_loss", "The log has one propeller speed only", "Hold two propeller speeds for some minutes each"),
        with("drag_change", "The whole log lies after the onset", "Compare with a log from before the onset"),
        with("thrust_decay", "The log is too short for a decay to show", "Record a longer log at one propeller speed"),
        with(
            "water_current",
            "There is no DVL, and all lines have one heading",
            "Fly the same line in both directions, or record DVL bottom track",
        ),
    ],
    hooks: Hooks { plant: Some(plant), wrench_by: Some(wrench_by), ..Hooks::NONE },
};

fn plant(values: &[f64], _: f64, plant: &mut VehicleParameters) {
    if let [drag] = values {
        plant.linear_surge_ns_per_m += drag;
    }
}

fn wrench_by(_: usize, at: &Motion<'_>) -> Vector6<f64> {
    Vector6::new(-at.velocity[0], 0.0, 0.0, 0.0, 0.0, 0.0)
}
