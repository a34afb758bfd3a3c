//! `heading_bias`: the compass reads ψ + const + sin · sin ψ + cos · cos ψ.
//!
//! Hard iron makes the harmonics; a misaligned compass or a magnetic declination the constant.

use super::{
    EffectInfo, Enters, Hooks, Measure, Moment, ParameterInfo, SensorChannel, Slopes, hooks::diagonal, info::with,
};

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "heading_bias",
    parameters: &[
        ParameterInfo::symmetric("const_rad", "rad", 0.6),
        ParameterInfo::symmetric("sin_rad", "rad", 0.3),
        ParameterInfo::symmetric("cos_rad", "rad", 0.3),
    ],
    enters: Enters::Measurement,
    equations: "psi_m = psi + const + sin sin(psi) + cos cos(psi)",
    signature: "The dead-reckoned track is rotated by an angle that depends on heading as its first harmonic. \
                The integrated yaw rate differs from the heading change that the compass shows",
    confused_with: &[
        with(
            "water_current",
            "There is no DVL bottom track. On north-south lines the cosine part looks like an east \
                        current and the sine part like a north current",
            "Fly lines across the first ones, record DVL bottom track, or fly a surfaced \
                                   leg with GNSS on each heading",
        ),
        with(
            "dvl_misalignment",
            "Dead reckoning only: a constant bias rotates the track as a DVL turned in yaw does",
            "Turn with fins and propeller in the log: the modelled sway separates them",
        ),
    ],
    hooks: Hooks { measure: Some(Measure { channels: &[SensorChannel::Attitude], apply }), ..Hooks::NONE },
};

fn apply(values: &[f64], _: &Moment, reading: &mut [f64; 3]) -> Slopes {
    let &[constant, sine, cosine] = values else { return Slopes::IDENTITY };
    let (sin, cos) = libm::sincos(reading[2]);
    reading[2] += constant + sine * sin + cosine * cos;
    Slopes {
        by_reading: diagonal([1.0, 1.0, 1.0 + sine * cos - cosine * sin]),
        by_parameter: [[0.0, 0.0, 1.0], [0.0, 0.0, sin], [0.0, 0.0, cos]],
    }
}
