//! PD attitude control (3.32)-(3.33) corrected: damping acts on the rates, not on their derivatives.

use super::allocation::Moments;
use crate::state::{self, VehicleState};

/// Gains of the PD law up to 1 m/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PdGains {
    /// Kp on the heading error, N m/rad.
    pub kp_psi: f64,
    /// Kd on the yaw rate, N m s/rad.
    ///
    /// The PD's moments are totals, so the allocation cancels the fins' own damping: below some 20 N m s/rad what is
    /// left does not outweigh fin rate and saturation, and the reference vehicle yaws in a limit cycle.
    pub kd_r: f64,
    /// Kp on the pitch error, N m/rad.
    pub kp_theta: f64,
    /// Kd on the pitch rate, N m s/rad.
    pub kd_q: f64,
}

impl PdGains {
    /// Heading settles within some 5 s without overshoot, pitch within 2 s.
    pub const DEFAULT: Self = Self { kp_psi: 20.0, kd_r: 60.0, kp_theta: 25.0, kd_q: 30.0 };

    /// The gains for a leg at `speed_mps`: above 1 m/s Kp grows with u² and Kd with u, as the moments on hull and fins
    /// do, so that the loop keeps its shape over distance. With fixed gains the hull's own destabilising moment wins
    /// and the reference vehicle oscillates in pitch from 1.5 m/s. Below 1 m/s the keel's stiffness, which does not
    /// depend on speed, would win over smaller gains.
    #[must_use]
    pub fn at_speed(&self, speed_mps: f64) -> Self {
        let scale = speed_mps.max(1.0);
        let square = scale * scale;
        Self {
            kp_psi: self.kp_psi * square,
            kd_r: self.kd_r * scale,
            kp_theta: self.kp_theta * square,
            kd_q: self.kd_q * scale,
        }
    }

    /// Moments that the fins shall give in total for a heading and a pitch; `pitch_feed_nm` is what the fins give
    /// in trim. The heading error counts up to where the rate weighs against it at `turn_rate_max_radps`.
    #[must_use]
    pub fn moments(
        &self,
        x: &VehicleState,
        heading_rad: f64,
        pitch_rad: f64,
        pitch_feed_nm: f64,
        turn_rate_max_radps: f64,
    ) -> Moments {
        let turn = self.kp_psi * state::wrap_angle(heading_rad - x[state::PSI]);
        let turn_max = self.kd_r * turn_rate_max_radps;
        Moments {
            roll_nm: 0.0,
            pitch_nm: pitch_feed_nm + self.kp_theta * (pitch_rad - x[state::THETA]) - self.kd_q * x[state::Q],
            yaw_nm: turn.max(-turn_max).min(turn_max) - self.kd_r * x[state::R],
        }
    }
}
