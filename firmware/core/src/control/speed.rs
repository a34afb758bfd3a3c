//! Speed law with drag feed-forward (3.34) corrected.

use crate::dynamics::{ActuatorInput, Propeller, VehicleModel, VehicleParameters};
use crate::state::{self, VehicleState};

/// Gains of the speed law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedGains {
    /// Kp on the speed error, N s/m.
    pub kp_u: f64,
    /// Largest thrust asked for, N: it limits the acceleration from rest.
    pub thrust_max_n: f64,
}

impl SpeedGains {
    /// Time constant m11/Kp of 2 s; three times the thrust of 1 m/s.
    pub const DEFAULT: Self = Self { kp_u: 20.0, thrust_max_n: 12.0 };

    /// The gains for a vehicle that is heavier, or faster at `cruise_speed_mps`, than the one they were declared for: Kp at
    /// least m11 / 2 s, the largest thrust at least four times the drag in surge.
    #[must_use]
    pub fn for_vehicle(&self, vehicle: &VehicleParameters, cruise_speed_mps: f64) -> Self {
        const TIME_CONSTANT_S: f64 = 2.0;
        const THRUST_OVER_DRAG: f64 = 4.0;
        let u = cruise_speed_mps.max(1.0);
        let drag_n = (vehicle.quadratic_diag[0] * u + vehicle.linear_surge_ns_per_m) * u;
        Self {
            kp_u: self.kp_u.max(vehicle.m_diag[0] / TIME_CONSTANT_S),
            thrust_max_n: self.thrust_max_n.max(THRUST_OVER_DRAG * drag_n),
        }
    }

    /// F = Kp (u_d − u) + (C v + D v)_x − fins_x − restoring_x, N, between zero and the largest thrust.
    ///
    /// Everything but Kp (u_d − u) is what the model would do to the surge with the propeller at rest and the fins
    /// at `fins_rad`, so that any term the model gains is fed forward with it.
    #[must_use]
    pub fn thrust_n(&self, model: &VehicleModel, x: &VehicleState, fins_rad: &[f64; 4], speed_mps: f64) -> f64 {
        let coasting = ActuatorInput { propeller_radps: 0.0, fins_rad: *fins_rad };
        let acceleration = model.acceleration(&state::attitude(x), &state::velocity(x), &coasting);
        let force = self.kp_u * (speed_mps - x[state::U]) - model.parameters().m_diag[0] * acceleration[0];
        force.max(0.0).min(self.thrust_max_n)
    }
}

/// Propeller speed ω ≥ 0 that gives thrust T = β5 ω|ω| − k ω u, rad/s; 0 for thrusts the propeller cannot give
/// turning ahead.
#[must_use]
pub fn propeller_radps(propeller: &Propeller, thrust_n: f64, surge_mps: f64) -> f64 {
    let advance = propeller.advance * surge_mps;
    let discriminant = advance * advance + 4.0 * propeller.beta5 * thrust_n;
    let omega = (advance + libm::sqrt(discriminant.max(0.0))) / (2.0 * propeller.beta5);
    if omega.is_finite() { omega.max(0.0) } else { 0.0 }
}
