//! `fin_stuck`: from a time on, for good or for a while, one fin stands still whatever is commanded.

use super::{ActuatorMemory, EffectInfo, Enters, Hooks, ParameterInfo, Step, fin_index, info::with, is_on};
use crate::dynamics::ActuatorInput;

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "fin_stuck",
    parameters: &[
        ParameterInfo::FIN,
        ParameterInfo::symmetric("rad", "rad", 0.6),
        ParameterInfo::ONSET,
        ParameterInfo::END,
    ],
    enters: Enters::Process,
    equations: "delta_fin = rad from time_s to until_s",
    signature: "The trim steps at one time. From then on the residual moment follows the fin's command with \
                the opposite sign",
    confused_with: &[with(
        "fin_bias",
        "The fin has not been commanded since the onset",
        "Turn and dive, so that the fin is commanded",
    )],
    hooks: Hooks { input: Some(input), ..Hooks::NONE },
};

fn input(values: &[f64], step: &Step, _: &mut ActuatorMemory, input: &mut ActuatorInput) {
    if let [fin, held, time_s, until_s] = values
        && is_on(step.t_s, *time_s, *until_s)
        && let Some(angle) = fin_index(*fin).and_then(|fin| input.fins_rad.get_mut(fin))
    {
        *angle = *held;
    }
}
