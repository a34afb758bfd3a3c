//! `drag_change`: from a time on, for good or for a while, more linear drag in surge.
//!
//! Weed or a line caught on the way and perhaps shed, a fairing lost.

use super::{EffectInfo, Enters, Hooks, ParameterInfo, info::with, is_on};
use crate::dynamics::VehicleParameters;

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "drag_change",
    parameters: &[ParameterInfo::size("surge_ns_per_m", "N s/m", -5.0, 20.0), ParameterInfo::ONSET, ParameterInfo::END],
    enters: Enters::Process,
    equations: "X -= d u from time_s to until_s",
    signature: "Surge steps at one time, and back if it ends. At constant propeller speed it is constant in between",
    confused_with: &[
        with("linear_drag", "The onset lies near the start or the end of the log", "Record a longer log"),
        with(
            "thrust_decay",
            "The log is short and the onset lies near its middle",
            "Record a longer log at one propeller speed",
        ),
        with(
            "water_current",
            "There is no DVL, and the heading is the same since the onset",
            "Fly the line back, or record DVL bottom track",
        ),
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
