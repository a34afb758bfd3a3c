//! `drag_change`: from a time on, more linear drag in surge.
//!
//! Weed or a line caught on the way, a fairing lost.

use super::{Confusion, EffectInfo, Enters, Hooks, ParameterInfo};
use crate::dynamics::VehicleParameters;

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "drag_change",
    parameters: &[ParameterInfo::size("surge_ns_per_m", "N s/m", -5.0, 20.0), ParameterInfo::ONSET],
    enters: Enters::Process,
    equations: "X -= d u from time_s on",
    signature: "a step in surge at one time; constant on either side of it at constant propeller speed",
    confused_with: &[
        Confusion {
            effect: "linear_drag",
            condition: "the onset lies at an end of the log",
            separating_manoeuvre: "a longer log",
        },
        Confusion {
            effect: "thrust_decay",
            condition: "a step near the middle of a short log",
            separating_manoeuvre: "a longer log at one propeller speed",
        },
        Confusion {
            effect: "water_current",
            condition: "no DVL, one heading since the onset",
            separating_manoeuvre: "a line back, or bottom lock",
        },
    ],
    hooks: Hooks { plant: Some(plant), ..Hooks::NONE },
};

fn plant(values: &[f64], t_s: f64, plant: &mut VehicleParameters) {
    if let [drag, time_s] = values
        && t_s >= *time_s
    {
        plant.linear_surge_ns_per_m += drag;
    }
}
