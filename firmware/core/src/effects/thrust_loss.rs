//! `thrust_loss`: thrust falls with the speed of advance, T = β5 ω|ω| − k ω u.
//!
//! Serves as the filter's thrust factor: its state is `k_n_s2_per_rad_m`.

use super::{EffectInfo, Enters, Hooks, Motion, ParameterInfo, info::with};
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
        with("linear_drag", "The log has one propeller speed only", "Hold two propeller speeds for some minutes each"),
        with("thrust_decay", "The log is too short for a decay to show", "Record a longer log at one propeller speed"),
        with(
            "water_current",
            "There is no DVL, and all lines have one heading",
            "Fly the same line in both directions, or record DVL bottom track",
        ),
        with(
            "dvl_scale",
            "A DVL but no ranges and no fixes, at one propeller speed",
            "Hold two propeller speeds for some minutes each",
        ),
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
