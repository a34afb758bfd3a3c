//! `thrust_loss`: thrust falls with the speed of advance, T = β5 ω|ω| − k ω u.
//!
//! Serves as the filter's thrust factor: its state is `k_n_s2_per_rad_m`.

use super::{Confusion, EffectInfo, Enters, Hooks, Motion, ParameterInfo};
use crate::dynamics::VehicleParameters;
use nalgebra::Vector6;

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "thrust_loss",
    parameters: &[ParameterInfo::size("k_n_s2_per_rad_m", "N s^2/(rad m)", -0.01, 0.03)],
    enters: Enters::Process,
    equations: "X -= k omega u",
    signature: "surge below the model, more so the faster propeller and vehicle are",
    confused_with: &[
        Confusion {
            effect: "linear_drag",
            condition: "at one propeller speed",
            separating_manoeuvre: "two propeller speeds, held for minutes each",
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
        Confusion {
            effect: "dvl_scale",
            condition: "DVL without ranges or fixes, at one propeller speed",
            separating_manoeuvre: "two propeller speeds, held for minutes each",
        },
    ],
    hooks: Hooks { plant: Some(plant), wrench_by: Some(wrench_by), ..Hooks::NONE },
};

fn plant(values: &[f64], _: f64, plant: &mut VehicleParameters) {
    if let [k] = values {
        plant.advance_n_s2_per_rad_m += k;
    }
}

fn wrench_by(_: usize, at: &Motion<'_>) -> Vector6<f64> {
    Vector6::new(-at.input.propeller_radps * at.velocity[0], 0.0, 0.0, 0.0, 0.0, 0.0)
}
