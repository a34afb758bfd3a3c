//! `cross_drag`: off-diagonal quadratic drag of (4.21), of a hull that is not alike fore and aft.
//!
//! Y −= d26 |r| r, N −= d26 |v| v; Z −= d35 |q| q, M −= d35 |w| w. The limit at which it would create energy
//! ([`crate::dynamics::cross_drag_limit`]) is the vehicle's own and checked with it.

use super::{EffectInfo, Enters, Hooks, ParameterInfo, info::with};
use crate::dynamics::VehicleParameters;

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "cross_drag",
    parameters: &[
        ParameterInfo::symmetric("d26", "N s^2/rad^2", 95.0),
        ParameterInfo::symmetric("d35", "N s^2/rad^2", 95.0),
    ],
    enters: Enters::Process,
    equations: "Y -= d26 |r| r, N -= d26 |v| v; Z -= d35 |q| q, M -= d35 |w| w",
    signature: "In turns, yaw rate and sway differ from the model; in dives, pitch rate and heave differ. On \
                straight lines nothing differs",
    confused_with: &[with("fin_bias", "All turns are to one side", "Turn to both sides")],
    hooks: Hooks { plant: Some(plant), ..Hooks::NONE },
};

fn plant(values: &[f64], _: f64, plant: &mut VehicleParameters) {
    if let [d26, d35] = values {
        plant.d26 += d26;
        plant.d35 += d35;
    }
}
