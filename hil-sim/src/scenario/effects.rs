//! `[effects]`: what the simulated world does that the declared vehicle does not.
//!
//! Biases are measured minus true, ratios measured / true − 1. A water current is not here: it is
//! `[environment.current]`.

use super::quantity;
use serde::Deserialize;

/// `[effects]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Effects {
    /// Compass error.
    pub heading_bias: HeadingBias,
    /// DVL scale.
    pub dvl_scale: Ratio,
    /// DVL mounting.
    pub dvl_misalignment: DvlMisalignment,
    /// True travel times are (1 + ratio) of what the declared sound speed gives.
    pub sound_speed: Ratio,
    /// Receiver's clock minus true time at time zero.
    pub clock_offset: ClockOffset,
    /// Rate error of the receiver's clock.
    pub clock_drift: ClockDrift,
}

/// A ratio, measured / true − 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ratio {
    /// The ratio.
    #[serde(deserialize_with = "quantity::ratio")]
    pub ratio: f64,
}

/// const + sin · sin ψ + cos · cos ψ, ψ the true heading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HeadingBias {
    /// Constant part, rad.
    #[serde(deserialize_with = "quantity::angle")]
    pub const_rad: f64,
    /// Amplitude of sin ψ, rad.
    #[serde(deserialize_with = "quantity::angle")]
    pub sin_rad: f64,
    /// Amplitude of cos ψ, rad.
    #[serde(deserialize_with = "quantity::angle")]
    pub cos_rad: f64,
}

/// v_measured = Rz(yaw)ᵀ Ry(pitch)ᵀ v.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DvlMisalignment {
    /// Yaw of the DVL in the vehicle, rad.
    #[serde(deserialize_with = "quantity::angle")]
    pub yaw_rad: f64,
    /// Pitch of the DVL in the vehicle, rad.
    #[serde(deserialize_with = "quantity::angle")]
    pub pitch_rad: f64,
}

/// An offset of a clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClockOffset {
    /// The offset, s.
    #[serde(deserialize_with = "quantity::clock")]
    pub s: f64,
}

/// A rate error of a clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClockDrift {
    /// The rate error, parts per million.
    #[serde(deserialize_with = "quantity::ppm")]
    pub ppm: f64,
}
