//! Limits on the commands to the actuators: ranges, fin rate, propeller acceleration.

use crate::dynamics::{ActuatorInput, FINS, VehicleParameters};

/// Limits on the commanded actuator input; every command passes them last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActuatorLimits {
    /// Largest fin angle commanded, rad; also bounded by the vehicle's `delta_max_rad`.
    pub fin_rad: f64,
    /// Largest fin rate, rad/s.
    pub fin_rate_radps: f64,
    /// Largest propeller speed, rad/s; also bounded by the vehicle's `omega_max_radps`. The smallest is 0: no law
    /// brakes with the propeller.
    pub propeller_radps: f64,
    /// Largest propeller acceleration, rad/s².
    pub propeller_radps2: f64,
}

impl ActuatorLimits {
    /// 20° keeps the fins below their stall (29° with the reference lift curve) with 9° of side slip in hand;
    /// 30°/s is half the no-load rate of a small servo.
    pub const DEFAULT: Self = Self {
        fin_rad: 0.349_065_850_398_865_9,
        fin_rate_radps: 0.523_598_775_598_298_8,
        propeller_radps: 200.0,
        propeller_radps2: 100.0,
    };

    /// Neutral, always.
    pub(super) const NONE: Self =
        Self { fin_rad: 0.0, fin_rate_radps: 0.0, propeller_radps: 0.0, propeller_radps2: 0.0 };

    /// These limits inside those of the vehicle.
    #[must_use]
    pub fn within(&self, vehicle: &VehicleParameters) -> Self {
        Self {
            fin_rad: self.fin_rad.min(vehicle.delta_max_rad),
            propeller_radps: self.propeller_radps.min(vehicle.omega_max_radps),
            ..*self
        }
    }
}

/// Keeps successive commands within [`ActuatorLimits`]; remembers the last one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limiter {
    limits: ActuatorLimits,
    last: ActuatorInput,
}

impl Limiter {
    /// Starts from neutral fins and a stopped propeller.
    #[must_use]
    pub const fn new(limits: ActuatorLimits) -> Self {
        Self { limits, last: ActuatorInput { propeller_radps: 0.0, fins_rad: [0.0; FINS] } }
    }

    /// The last command that passed.
    #[must_use]
    pub fn last(&self) -> &ActuatorInput {
        &self.last
    }

    /// The limits in force.
    #[must_use]
    pub fn limits(&self) -> &ActuatorLimits {
        &self.limits
    }

    /// Replaces the limits; the next command moves from the last one at the new rates.
    pub fn set_limits(&mut self, limits: ActuatorLimits) {
        self.limits = limits;
    }

    /// Starts again from neutral fins and a stopped propeller.
    pub fn reset(&mut self) {
        self.last = ActuatorInput::default();
    }

    /// The admissible command nearest to `wanted`, `dt_s` after the last one. A component that is not finite
    /// is taken as neutral.
    pub fn apply(&mut self, wanted: &ActuatorInput, dt_s: f64) -> ActuatorInput {
        let l = self.limits;
        let dt_s = if dt_s.is_finite() { dt_s.max(0.0) } else { 0.0 };
        let propeller = finite_or_zero(wanted.propeller_radps).max(0.0).min(l.propeller_radps);
        self.last.propeller_radps = towards(self.last.propeller_radps, propeller, l.propeller_radps2 * dt_s);
        for (last, &fin) in self.last.fins_rad.iter_mut().zip(&wanted.fins_rad) {
            let fin = finite_or_zero(fin).max(-l.fin_rad).min(l.fin_rad);
            *last = towards(*last, fin, l.fin_rate_radps * dt_s);
        }
        self.last
    }
}

fn finite_or_zero(x: f64) -> f64 {
    if x.is_finite() { x } else { 0.0 }
}

fn towards(from: f64, to: f64, step: f64) -> f64 {
    if (to - from).abs() <= step {
        to
    } else if to > from {
        from + step
    } else {
        from - step
    }
}
