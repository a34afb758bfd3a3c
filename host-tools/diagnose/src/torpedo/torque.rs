//! The propeller's torque, judged where it acts: at stops of the motor. Over windows of many seconds a stop is a row of
//! forty, and a moment with u² explains the rest as well.

use backseat_identify::short_runs::stops::{Stops, stops};
use backseat_identify::short_runs::unknowns::Place;
use backseat_identify::short_runs::{Draft, Fit, Run, Unknown};
use backseat_logs::short_runs::COMMON;
use backseat_logs::stats::f_tail;

/// The effect of the catalogue.
pub const EFFECT: &str = "propeller_torque";
/// What tells how late the propeller's speed is recorded, which the stops show as well.
pub(super) const DELAY: &str = "input_delay";
/// Probability by chance up to which stops show a torque.
const LEVEL: f64 = 0.01;
/// One sigma of the delay of the recorded propeller speed that fits the stops best, s.
const DELAY_S: f64 = 0.15;
/// What all moments about the roll axis are measured by.
const SCALE: &str = "ln fin lift";

/// What the stops say of it.
#[derive(Clone, Debug)]
pub struct Torque {
    /// What each stop says.
    pub stops: Stops,
    /// Arm, K = −arm T, and its standard error over the stops, m.
    pub arm_m: [f64; 2],
    /// Probability by chance, by Student's t over the stops.
    pub p_value: f64,
}

impl Torque {
    /// By a model of the runs; `None`: too few stops.
    #[must_use]
    pub fn of(runs: &[Run], draft: &Draft) -> Option<Self> {
        let stops = stops(runs, draft);
        let [mean, sigma] = stops.mean()?;
        let p_value = f_tail((mean / sigma).powi(2), 1.0, (stops.each.len() - 1) as f64);
        Some(Self { stops, arm_m: [mean, sigma], p_value })
    }

    /// Whether they show a torque.
    #[must_use]
    pub fn is_shown(&self) -> bool {
        self.p_value < LEVEL
    }

    /// What the stops say of an unknown, in its own coordinate: prior and sigma.
    pub(super) fn inform(&self, unknown: &mut Unknown, base: &Draft) {
        let [arm_m, sigma_m] = self.arm_m;
        match unknown.place {
            Place::TorqueArm => (unknown.prior, unknown.sigma) = (arm_m - base.parameters.torque_arm_m, sigma_m),
            Place::Common(term) if COMMON[term].name == "propeller_delay_s" => {
                (unknown.prior, unknown.sigma) = (self.stops.delay_s - base.common[term], DELAY_S);
            }
            _ => {}
        }
    }

    /// 95 % interval around a fitted arm: of its logarithm, for the stops tell its sign, and runs tell moments about the
    /// roll axis no better than the lift of the fins, which damps the roll.
    pub(super) fn interval(&self, arm_m: f64, fit: &Fit, unknowns: &[Unknown], quantile: f64) -> [f64; 2] {
        let [mean, sigma] = self.arm_m;
        let scale = unknowns.iter().position(|unknown| unknown.name == SCALE);
        let scale = scale.map_or(0.0, |place| fit.sigmas()[place]);
        let factor = (quantile * (sigma / mean).hypot(scale)).exp();
        let [a, b] = [arm_m / factor, arm_m * factor];
        [a.min(b), a.max(b)]
    }
}
