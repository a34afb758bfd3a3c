//! `fin_lag`: the fins follow their commands with a first-order lag.

use super::{ActuatorMemory, EffectInfo, Enters, Hooks, ParameterInfo, Step};
use crate::dynamics::{ActuatorInput, FINS};

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "fin_lag",
    parameters: &[ParameterInfo::size("s", "s", 0.0, 5.0)],
    enters: Enters::Process,
    equations: "delta_dot = (delta_c - delta) / s",
    signature: "rates lag the model where fins move; nothing in steady flight",
    confused_with: &[],
    hooks: Hooks { input: Some(input), ..Hooks::NONE },
};

/// The mean of the fins' angles over the step, from which the impulse on the vehicle follows.
fn input(values: &[f64], step: &Step, memory: &mut ActuatorMemory, input: &mut ActuatorInput) {
    let [lag_s] = values else { return };
    if !(*lag_s > 0.0 && step.h_s > 0.0) {
        return;
    }
    let commanded = input.fins_rad;
    let before = memory.fins_rad.unwrap_or(commanded);
    let decay = libm::exp(-step.h_s / lag_s);
    let mean = (1.0 - decay) * lag_s / step.h_s;
    let mut after = commanded;
    for i in 0..FINS {
        let gap = before[i] - commanded[i];
        after[i] += gap * decay;
        input.fins_rad[i] += gap * mean;
    }
    memory.fins_rad = Some(after);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_a_step_is_followed_exponentially_whatever_the_steps() {
        for steps in [1_u32, 7, 40] {
            let mut memory = ActuatorMemory { fins_rad: Some([0.0; FINS]) };
            let mut area = 0.0;
            let h_s = 0.8 / f64::from(steps);
            for _ in 0..steps {
                let mut fins = ActuatorInput { propeller_radps: 0.0, fins_rad: [0.2; FINS] };
                input(&[0.5], &Step { t_s: 0.0, h_s }, &mut memory, &mut fins);
                area += h_s * fins.fins_rad[2];
            }
            let decay = libm::exp(-0.8 / 0.5);
            let end = memory.fins_rad.unwrap_or_default()[2];
            // Closed forms of the lag's response and its integral; rounding only.
            assert!((end - 0.2 * (1.0 - decay)).abs() < 1e-15);
            assert!((area - 0.2 * (0.8 - 0.5 * (1.0 - decay))).abs() < 1e-15);
        }
    }
}
