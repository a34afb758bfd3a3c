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
    signature: "surge below the model by the same force over speed at all speeds, from the start of the log",
    confused_with: &[
        Confusion {
            effect: "thrust_loss",
            condition: "at one propeller speed",
            separating_manoeuvre: "two propeller speeds, held for minutes each",
        },
        Confusion {
            effect: "drag_change",
            condition: "the whole log lies on one side of its onset",
            separating_manoeuvre: "a log from before",
        },
        Confusion {
            effect: "thrust_decay",
            condition: "a log too short for a decay to show",
            separating_manoeuvre: "a longer log at one propeller speed",
        },
        Confusion {
            effect: "water_current",
            condition: "no DVL, lines of a single heading",
            separating_manoeuvre: "the same line in both directions, or bottom lock",
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
