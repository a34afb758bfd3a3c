//! `fin_bias`: one fin stands off its command by a constant angle (actual minus commanded).

use super::{ActuatorMemory, EffectInfo, Enters, Hooks, ParameterInfo, Step, fin_index, info::with};
use crate::dynamics::ActuatorInput;

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "fin_bias",
    parameters: &[ParameterInfo::FIN, ParameterInfo::symmetric("rad", "rad", 0.3)],
    enters: Enters::Process,
    equations: "delta_fin = delta_c + rad",
    signature: "A steady moment grows with the square of speed. The controller holds the other fins off their \
                trim, or the vehicle rolls or turns against its rudders",
    confused_with: &[
        with(
            "fin_stuck",
            "The fin has not been commanded since the onset",
            "Turn and dive, so that the fin is commanded",
        ),
        with("roll_trim", "The log has one speed only", "Fly at two propeller speeds"),
        with(
            "pitch_trim",
            "The log has one speed only, and the fin is port or starboard",
            "Fly at two propeller speeds",
        ),
        with("cross_drag", "All turns are to one side", "Turn to both sides"),
    ],
    hooks: Hooks { input: Some(input), ..Hooks::NONE },
};

fn input(values: &[f64], _: &Step, _: &mut ActuatorMemory, input: &mut ActuatorInput) {
    if let [fin, bias] = values
        && let Some(angle) = fin_index(*fin).and_then(|fin| input.fins_rad.get_mut(fin))
    {
        *angle += bias;
    }
}
