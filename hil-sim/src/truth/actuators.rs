//! Fin servos of finite speed and a propeller that takes time to spin up.

use super::Parameters;
use super::undeclared::{FinFault, Undeclared};

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
    /// Share of the remaining difference that a fin covers in one step.
    fin_share: f64,
    faults: [FinFault; 4],
    decay_per_s: f64,
    /// Dead band, slope over thrust constant, saturation.
    thrust_curve: Option<[f64; 3]>,
    /// Where the servos stand.
    servos_rad: [f64; 4],
    /// Where they hold the fins; a faulty fin stands elsewhere.
    linkages_rad: [f64; 4],
}

/// Share of the remaining difference that a first-order lag covers in one step.
fn share(step_s: f64, lag_s: f64) -> f64 {
    if lag_s > 0.0 { -libm::expm1(-step_s / lag_s) } else { 1.0 }
}

impl Drive {
    pub(super) fn new(parameters: &Parameters, undeclared: &Undeclared, step_s: f64) -> Self {
        Self {
            fin_max_rad: parameters.fin_max_rad,
            fin_step_rad: parameters.servo_rate_radps * step_s,
            propeller_max_radps: parameters.propeller_max_radps,
            propeller_share: share(step_s, parameters.propeller_lag_s),
            fin_share: share(step_s, undeclared.fin_lag_s),
            faults: undeclared.fins,
            decay_per_s: undeclared.thrust_decay_per_s,
            thrust_curve: undeclared
                .thrust_curve
                .map(|[band, slope_n, top]| [band, slope_n / parameters.thrust_n_s2_per_rad2, top]),
            servos_rad: [0.0; 4],
            linkages_rad: [0.0; 4],
        }
    }

    /// The speed at which the declared propeller gives the thrust of the curve.
    fn driven(&self, commanded_radps: f64) -> f64 {
        let Some([band, slope, top]) = self.thrust_curve else { return commanded_radps };
        let share = (commanded_radps.abs() / self.propeller_max_radps).min(top);
        libm::sqrt(slope * (share - band).max(0.0)).copysign(commanded_radps)
    }

    /// Moves the actuators towards their targets for one step that begins at `time_s` and at the speed `u`, m/s.
    pub(super) fn step(&mut self, actuators: &mut Actuators, targets: &Actuators, time_s: f64, u: f64) {
        let omega = self.driven(targets.propeller_radps.clamp(-self.propeller_max_radps, self.propeller_max_radps))
            * (1.0 - self.decay_per_s * time_s).max(0.0);
        actuators.propeller_radps += self.propeller_share * (omega - actuators.propeller_radps);
        for i in 0..4 {
            let target = targets.fins_rad[i].clamp(-self.fin_max_rad, self.fin_max_rad);
            let (servo, fault) = (&mut self.servos_rad[i], &self.faults[i]);
            if !fault.is_out(time_s) {
                *servo += (self.fin_share * (target - *servo)).clamp(-self.fin_step_rad, self.fin_step_rad);
            }
            let linkage = &mut self.linkages_rad[i];
            *linkage = linkage.max(*servo - fault.play_rad).min(*servo + fault.play_rad);
            actuators.fins_rad[i] = match fault.stuck {
                Some(stuck) if stuck.when.holds(time_s) => stuck.rad,
                _ => *linkage / (1.0 + fault.slip_s2_per_m2 * u * u) + fault.bias_rad + fault.shift_rad.at(time_s),
            };
        }
    }
}
