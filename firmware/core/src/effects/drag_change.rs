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
    signature: "Surge steps at one time. At constant propeller speed it is constant before and after",
    confused_with: &[
        Confusion {
            effect: "linear_drag",
            condition: "The onset lies near the start or the end of the log",
            separating_manoeuvre: "Record a longer log",
        },
        Confusion {
            effect: "thrust_decay",
            condition: "The log is short and the onset lies near its middle",
            separating_manoeuvre: "Record a longer log at one propeller speed",
        },
        Confusion {
            effect: "water_current",
            condition: "There is no DVL, and the heading is the same since the onset",
            separating_manoeuvre: "Fly the line back, or record DVL bottom track",
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
