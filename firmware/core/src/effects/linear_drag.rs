//! `linear_drag`: drag that grows with surge itself, beside the quadratic one.
//!
//! A fouled hull, an added instrument. Serves as the filter's drag factor: its state is `surge_ns_per_m`.

use super::{Confusion, EffectInfo, Enters, Hooks, Motion, ParameterInfo};
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
        Confusion {
            effect: "thrust_loss",
            condition: "The log has one propeller speed only",
            separating_manoeuvre: "Hold two propeller speeds for some minutes each",
        },
        Confusion {
            effect: "drag_change",
            condition: "The whole log lies after the onset",
            separating_manoeuvre: "Compare with a log from before the onset",
        },
        Confusion {
            effect: "thrust_decay",
            condition: "The log is too short for a decay to show",
            separating_manoeuvre: "Record a longer log at one propeller speed",
        },
        Confusion {
            effect: "water_current",
            condition: "There is no DVL, and all lines have one heading",
            separating_manoeuvre: "Fly the same line in both directions, or record DVL bottom track",
        },
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
