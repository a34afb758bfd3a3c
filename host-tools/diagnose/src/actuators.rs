//! Actuators that are not where they are commanded to be at once: fins whose servos turn at a rate, a propeller that
//! comes to its speed with a lag.

use backseat_core::dynamics::{ActuatorInput, FINS};
use backseat_core::effects::Step;

/// How slow they are; zero is at once.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Slowness {
    /// Of the fins: one over the rate of their servos, s/rad.
    pub fins_s_per_rad: f64,
    /// Of the propeller: time constant of its first-order lag, s.
    pub propeller_s: f64,
}

/// Where they were at the end of the last step.
#[derive(Clone, Debug, Default)]
pub struct Actuators(Option<ActuatorInput>);

impl Actuators {
    /// The means over a step of what follows a command. Small numbers have a derivative at zero: what they would leave.
    pub fn follow(&mut self, slowness: &Slowness, step: &Step, commanded: &ActuatorInput) -> ActuatorInput {
        let h_s = step.h_s;
        let before = self.0.unwrap_or(*commanded);
        if h_s.is_nan() || h_s <= 0.0 {
            return before;
        }
        let (mut mean, mut after) = (*commanded, *commanded);
        for i in 0..FINS {
            let gap = commanded.fins_rad[i] - before.fins_rad[i];
            let needed_s = slowness.fins_s_per_rad * gap.abs();
            if needed_s > h_s {
                after.fins_rad[i] = before.fins_rad[i] + gap * h_s / needed_s;
                mean.fins_rad[i] = 0.5 * (before.fins_rad[i] + after.fins_rad[i]);
            } else {
                mean.fins_rad[i] -= gap * 0.5 * needed_s / h_s;
            }
        }
        let gap = before.propeller_radps - commanded.propeller_radps;
        let steps = h_s / slowness.propeller_s.max(f64::MIN_POSITIVE);
        let left = (-steps).exp();
        after.propeller_radps += gap * left;
        mean.propeller_radps += gap * (1.0 - left) / steps;
        self.0 = Some(after);
        mean
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn commanded(fin_rad: f64, propeller_radps: f64) -> ActuatorInput {
        ActuatorInput { propeller_radps, fins_rad: [fin_rad; FINS] }
    }

    /// A fin commanded from 0 to 0.3 rad at 1 rad/s is there after 0.3 s, and has missed 0.3 × 0.3 / 2 rad s; a propeller
    /// that lags by 0.2 s has missed 50 × 0.2 rad in the end. Whatever the steps.
    #[test]
    fn val_a_step_is_followed_at_a_rate_and_with_a_lag() {
        let slowness = Slowness { fins_s_per_rad: 1.0, propeller_s: 0.2 };
        for steps in [20_u32, 55, 400] {
            let mut actuators = Actuators::default();
            let h_s = 4.0 / f64::from(steps);
            let step = Step { t_s: 0.0, h_s };
            actuators.follow(&slowness, &step, &commanded(0.0, 100.0));
            let missed = (0..steps).map(|_| {
                let mean = actuators.follow(&slowness, &step, &commanded(0.3, 150.0));
                [0.3 - mean.fins_rad[1], 150.0 - mean.propeller_radps].map(|gap| gap * h_s)
            });
            let missed = missed.fold([0.0; 2], |sum, gap| [sum[0] + gap[0], sum[1] + gap[1]]);
            assert!((missed[0] - 0.045).abs() < 1e-12, "{steps}: {missed:?}"); // rounding
            assert!((missed[1] - 10.0).abs() < 1e-6, "{steps}: {missed:?}"); // exp(-20) of 10 is left
        }
    }

    #[test]
    fn at_once_is_as_commanded_and_has_a_derivative() {
        let step = Step { t_s: 0.0, h_s: 0.1 };
        let gap = |slowness: Slowness| {
            let mut actuators = Actuators::default();
            actuators.follow(&slowness, &step, &commanded(0.0, 100.0));
            let mean = actuators.follow(&slowness, &step, &commanded(0.3, 150.0));
            [0.3 - mean.fins_rad[0], 150.0 - mean.propeller_radps]
        };
        assert_eq!(gap(Slowness::default()), [0.0; 2]);
        let little = gap(Slowness { fins_s_per_rad: 1e-4, propeller_s: 1e-4 });
        // 0.3² / 2 / 0.1 and 50 / 0.1 per unit
        assert!((little[0] / 1e-4 - 0.45).abs() < 1e-9 && (little[1] / 1e-4 - 500.0).abs() < 1e-9, "{little:?}");
    }
}
