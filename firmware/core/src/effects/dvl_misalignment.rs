//! `dvl_misalignment`: the DVL is mounted turned by yaw, then pitch: v_m = Ry(pitch)ᵀ Rz(yaw)ᵀ v.

use super::{EffectInfo, Enters, Hooks, Measure, Moment, ParameterInfo, SensorChannel, Slopes, info::with};

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "dvl_misalignment",
    parameters: &[ParameterInfo::symmetric("yaw_rad", "rad", 0.3), ParameterInfo::symmetric("pitch_rad", "rad", 0.3)],
    enters: Enters::Measurement,
    equations: "v_m = Ry(pitch)^T Rz(yaw)^T v",
    signature: "The DVL shows sway or heave in proportion to surge, which the model does not. The \
                dead-reckoned track is rotated against the fixes",
    confused_with: &[
        with(
            "heading_bias",
            "Dead reckoning only: a constant heading bias rotates the track in the same way",
            "Turn with fins and propeller in the log: the modelled sway separates them",
        ),
        with(
            "pitch_sensor",
            "The log has no depth: a pitch bias and a pitch of the DVL look the same",
            "Log the depth and dive",
        ),
    ],
    hooks: Hooks { measure: Some(Measure { channels: &[SensorChannel::Dvl], apply }), ..Hooks::NONE },
};

fn apply(values: &[f64], _: &Moment, reading: &mut [f64; 3]) -> Slopes {
    let &[yaw, pitch] = values else { return Slopes::IDENTITY };
    let ((sy, cy), (sp, cp)) = (libm::sincos(yaw), libm::sincos(pitch));
    let [u, v, w] = *reading;
    let (ahead, across) = (cy * u + sy * v, cy * v - sy * u);
    *reading = [cp * ahead - sp * w, across, sp * ahead + cp * w];
    Slopes {
        by_reading: [[cp * cy, cp * sy, -sp], [-sy, cy, 0.0], [sp * cy, sp * sy, cp]],
        by_parameter: [[cp * across, -ahead, sp * across], [-reading[2], 0.0, reading[0]], [0.0; 3]],
    }
}
