//! `thrust_decay`: the propeller turns at (1 − rate t) times its command, t since the epoch.
//!
//! A battery that runs down under an open-loop motor controller.

use super::{ActuatorMemory, EffectInfo, Enters, Hooks, ParameterInfo, Step, info::with};
use crate::dynamics::ActuatorInput;

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "thrust_decay",
    parameters: &[ParameterInfo::size("per_hour", "1/h", -0.5, 0.5)],
    enters: Enters::Process,
    equations: "omega = (1 - rate t) omega_c",
    signature: "Surge falls behind the model steadily with time",
    confused_with: &[
        with("drag_change", "The log is short", "Record a longer log at one propeller speed"),
        with("linear_drag", "The log is short", "Record a longer log at one propeller speed"),
        with("thrust_loss", "The log is short", "Record a longer log at one propeller speed"),
    ],
    hooks: Hooks { input: Some(input), ..Hooks::NONE },
};

fn input(values: &[f64], step: &Step, _: &mut ActuatorMemory, input: &mut ActuatorInput) {
    if let [rate_per_hour] = values {
        input.propeller_radps *= 1.0 - rate_per_hour * step.t_s / 3600.0;
    }
}
