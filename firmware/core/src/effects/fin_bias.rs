//! `fin_bias`: one fin stands off its command by a constant angle (actual minus commanded).

use super::{ActuatorMemory, Confusion, EffectInfo, Enters, Hooks, ParameterInfo, Step, fin_index};
use crate::dynamics::ActuatorInput;

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "fin_bias",
    parameters: &[ParameterInfo::FIN, ParameterInfo::symmetric("rad", "rad", 0.3)],
    enters: Enters::Process,
    equations: "delta_fin = delta_c + rad",
    signature: "steady moments that grow with speed squared: the controller holds the fins off their trim; roll, or turn against the rudders",
    confused_with: &[
        Confusion {
            effect: "fin_stuck",
            condition: "no command of that fin since the onset",
            separating_manoeuvre: "turns and dives, so that the fin is commanded",
        },
        Confusion { effect: "roll_trim", condition: "one speed", separating_manoeuvre: "two propeller speeds" },
        Confusion {
            effect: "pitch_trim",
            condition: "one speed; port or starboard fin",
            separating_manoeuvre: "two propeller speeds",
        },
        Confusion {
            effect: "cross_drag",
            condition: "turns to one side only",
            separating_manoeuvre: "turns to both sides",
        },
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
