//! Fin servos of finite speed and a propeller that takes time to spin up.

use super::Parameters;

/// Where the actuators stand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Actuators {
    /// Propeller speed, rad/s.
    pub propeller_radps: f64,
    /// Fin angles, top, bottom, port, starboard, rad; positive leads the edge towards −z of the
    /// fin's own frame.
    pub fins_rad: [f64; 4],
}

/// The law of motion of the actuators over one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drive {
    fin_max_rad: f64,
    fin_step_rad: f64,
    propeller_max_radps: f64,
    /// Share of the remaining difference that the propeller covers in one step.
    propeller_share: f64,
}

impl Drive {
    pub(super) fn new(parameters: &Parameters, step_s: f64) -> Self {
        let lag = parameters.propeller_lag_s;
        Self {
            fin_max_rad: parameters.fin_max_rad,
            fin_step_rad: parameters.servo_rate_radps * step_s,
            propeller_max_radps: parameters.propeller_max_radps,
            propeller_share: if lag > 0.0 { -libm::expm1(-step_s / lag) } else { 1.0 },
        }
    }

    /// Moves the actuators towards their targets for one step.
    pub(super) fn step(&self, actuators: &mut Actuators, targets: &Actuators) {
        let omega = targets.propeller_radps.clamp(-self.propeller_max_radps, self.propeller_max_radps);
        actuators.propeller_radps += self.propeller_share * (omega - actuators.propeller_radps);
        for (fin, target) in actuators.fins_rad.iter_mut().zip(targets.fins_rad) {
            let target = target.clamp(-self.fin_max_rad, self.fin_max_rad);
            *fin += (target - *fin).clamp(-self.fin_step_rad, self.fin_step_rad);
        }
    }
}
