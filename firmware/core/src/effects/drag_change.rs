//! `drag_change`: from a time on, for good or for a while, more linear drag in surge.
//!
//! Weed or a line caught on the way and perhaps shed, a fairing lost.

use super::{Confusion, EffectInfo, Enters, Hooks, ParameterInfo, is_on};
use crate::dynamics::VehicleParameters;

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "drag_change",
    parameters: &[ParameterInfo::size("surge_ns_per_m", "N s/m", -5.0, 20.0), ParameterInfo::ONSET, ParameterInfo::END],
    enters: Enters::Process,
    equations: "X -= d u from time_s to until_s",
    signature: "Surge steps at one time, and back if it ends. At constant propeller speed it is constant in between",
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
    if let [drag, time_s, until_s] = values
        && is_on(t_s, *time_s, *until_s)
    {
        plant.linear_surge_ns_per_m += drag;
    }
}
