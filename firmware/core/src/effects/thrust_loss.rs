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
    signature: "Surge is below the model. The missing force is proportional to propeller speed times surge",
    confused_with: &[
        Confusion {
            effect: "linear_drag",
            condition: "The log has one propeller speed only",
            separating_manoeuvre: "Hold two propeller speeds for some minutes each",
        },
        Confusion {
            effect: "thrust_decay",
            condition: "The log is too short for a decay to show",
            separating_manoeuvre: "Record a longer log at one propeller speed",
        },
        Confusion {
            effect: "water_current",
            condition: "There is no DVL, and all lines have one heading",
            separating_manoeuvre: "Fly the same line in both directions, or record DVL bottom track",
        },
        Confusion {
            effect: "dvl_scale",
            condition: "A DVL but no ranges and no fixes, at one propeller speed",
            separating_manoeuvre: "Hold two propeller speeds for some minutes each",
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
    let by_k = -at.input.propeller_radps * at.velocity[0];
    Vector6::new(by_k, 0.0, 0.0, -at.plant.torque_arm_m * by_k, 0.0, 0.0)
}
