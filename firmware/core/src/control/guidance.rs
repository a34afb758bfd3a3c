//! Kappa guidance (3.31) corrected: cross-track and depth error become a heading and a pitch to hold.

use super::trackline::{Segment, TrackError};
use crate::dynamics::VehicleModel;
use crate::state::{self, VehicleState};

/// Gains of the guidance.
///
/// κ is an angle per distance, so the errors decay over the same distance at every speed, as the vehicle's own motion
/// does (its forces grow with the square of speed).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuidanceGains {
    /// κ of heading, rad per metre of cross-track error.
    pub kappa_psi: f64,
    /// Steepest approach to the line, rad.
    pub approach_max_rad: f64,
    /// κ of pitch, rad per metre of depth error.
    pub kappa_theta: f64,
    /// Steepest pitch away from trim, rad.
    pub pitch_max_rad: f64,
}

impl GuidanceGains {
    /// The cross-track error decays within 20 m and the depth error within 4 m, both slower than the loop that holds
    /// the angle.
    pub const DEFAULT: Self = Self {
        kappa_psi: 0.05,
        approach_max_rad: core::f64::consts::FRAC_PI_4,
        kappa_theta: 0.25,
        pitch_max_rad: core::f64::consts::FRAC_PI_6,
    };

    /// ψ_r: course plus crab angle, turned towards the line, rad.
    #[must_use]
    pub fn heading_rad(&self, error: &TrackError, crab_rad: f64) -> f64 {
        let approach = (self.kappa_psi * error.cross_m).max(-self.approach_max_rad).min(self.approach_max_rad);
        state::wrap_angle(error.course_rad + crab_rad - approach)
    }

    /// θ_r = θ_d + κ d_z (z is down: too deep raises the nose), rad.
    #[must_use]
    pub fn pitch_rad(&self, error: &TrackError, trim_rad: f64) -> f64 {
        trim_rad + (self.kappa_theta * error.depth_m).max(-self.pitch_max_rad).min(self.pitch_max_rad)
    }
}

/// Fastest turn that is commanded with one of the two vertical fins left, rad/s.
const LONE_FIN_TURN_RADPS: f64 = 0.15;

/// Fastest turn that a law may ask for, rad/s: no limit while top and bottom fin are whole.
///
/// A hull that its fins barely stabilise is unstable in yaw without one of them: at 1.3 m/s, deviations of the
/// reference vehicle grow by a factor of e^0.4 a second. It turns nearly as fast at 2° of the remaining fin as at 20°,
/// and stopping the turn takes 4 to 8 s at full deflection. A law without this limit swings from side to side for ever.
/// With it, some deflection stays in reserve, and the vehicle turns as fast as it can still stop. A lost fin is
/// diagnosed with some of its lift left; therefore the limit grows slowly with that lift.
#[must_use]
pub fn turn_rate_max_radps(model: &VehicleModel) -> f64 {
    let [top, bottom, ..] = model.fin_effectiveness();
    let lost = 1.0 - top.min(bottom);
    if lost > 0.0 { LONE_FIN_TURN_RADPS / lost } else { f64::INFINITY }
}

/// Slowest water speed for which a crab angle is computed, m/s: below it no heading holds a line.
const CRAB_MIN_SPEED_MPS: f64 = 0.3;
/// Largest |sine| of the crab angle (60°): a stronger current sets the vehicle off its line, but it still makes way.
const CRAB_MAX_SINE: f64 = 0.866_025_403_784_438_6;

/// Crab angle: heading minus course for which the current's push across the line is cancelled, rad.
///
/// With it the cross-track error of a known current vanishes without integral action.
#[must_use]
pub fn crab_angle_rad(segment: &Segment, x: &VehicleState, current_ne_mps: [f64; 2]) -> f64 {
    let (sin, cos) = libm::sincos(segment.course_rad());
    let across = cos * current_ne_mps[1] - sin * current_ne_mps[0];
    let sine = -across / x[state::U].max(CRAB_MIN_SPEED_MPS);
    if sine.is_finite() { libm::asin(sine.clamp(-CRAB_MAX_SINE, CRAB_MAX_SINE)) } else { 0.0 }
}
