//! Propeller: thrust along body x (3.24), corrected for reverse, with advance; its reaction torque.

/// T = β5 ω|ω| − k ω u.
///
/// The advance term k ω u reduces the magnitude of the thrust while ω and u have the same sign, the
/// regime it stands for; at opposite signs it is the same formula, not a model of crash-back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Propeller {
    /// β5, N s²/rad².
    pub beta5: f64,
    /// k, N s²/(rad m).
    pub advance: f64,
    /// Of the reaction torque, K = −arm T, m.
    pub torque_arm: f64,
}

impl Propeller {
    pub(super) fn new(parameters: &super::VehicleParameters) -> Self {
        Self {
            beta5: parameters.beta5_n_s2_per_rad2,
            advance: parameters.advance_n_s2_per_rad_m,
            torque_arm: parameters.torque_arm_m,
        }
    }

    /// Thrust at propeller speed ω (rad/s) and surge u (m/s), N.
    #[must_use]
    pub fn thrust(&self, omega: f64, u: f64) -> f64 {
        (self.beta5 * omega.abs() - self.advance * u) * omega
    }

    /// ∂T/∂u, N s/m.
    #[must_use]
    pub fn thrust_by_surge(&self, omega: f64) -> f64 {
        -self.advance * omega
    }

    /// ∂T/∂ω, N s/rad.
    #[must_use]
    pub fn thrust_by_speed(&self, omega: f64, u: f64) -> f64 {
        2.0 * self.beta5 * omega.abs() - self.advance * u
    }
}
