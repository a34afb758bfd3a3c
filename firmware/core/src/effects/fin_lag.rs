//! `fin_lag`: the fins follow their commands with a first-order lag.

use super::{ActuatorMemory, EffectInfo, Enters, Hooks, ParameterInfo, Step};
use crate::dynamics::{ActuatorInput, FINS};

/// The catalogue's entry.
pub const INFO: EffectInfo = EffectInfo {
    name: "fin_lag",
    parameters: &[ParameterInfo::size("s", "s", 0.0, 5.0)],
    enters: Enters::Process,
    equations: "delta_dot = (delta_c - delta) / s",
    signature: "Body rates lag behind the model when the fins move. In steady flight nothing differs",
    confused_with: &[],
    hooks: Hooks { input: Some(input), fins_by: Some(fins_by), ..Hooks::NONE },
};

/// The mean of the fins' angles over the step, from which the impulse on the vehicle follows, and its derivative by the
/// lag. A lag of zero has a derivative as well: the angle that a small lag would have added.
fn input(values: &[f64], step: &Step, memory: &mut ActuatorMemory, input: &mut ActuatorInput) {
    let [lag_s] = values else { return };
    if step.h_s.is_nan() || step.h_s <= 0.0 {
        return;
    }
    let commanded = input.fins_rad;
    let before = memory.fins_rad.unwrap_or(commanded);
    // The part of the gap that is left at the end, its mean, and their derivatives by the lag.
    let (decay, mean, decay_by, mean_by) = if *lag_s > 0.0 {
        let steps = step.h_s / lag_s;
        let decay = libm::exp(-steps);
        let mean = (1.0 - decay) / steps;
        (decay, mean, decay * steps / lag_s, (1.0 - decay - steps * decay) / step.h_s)
    } else {
        (0.0, 0.0, 0.0, 1.0 / step.h_s)
    };
    let (mut after, before_by) = (commanded, memory.fins_by_lag);
    for i in 0..FINS {
        let gap = before[i] - commanded[i];
        after[i] += gap * decay;
        input.fins_rad[i] += gap * mean;
        memory.mean_by_lag[i] = before_by[i] * mean + gap * mean_by;
        memory.fins_by_lag[i] = before_by[i] * decay + gap * decay_by;
    }
    memory.fins_rad = Some(after);
}

fn fins_by(_: usize, memory: &ActuatorMemory) -> [f64; FINS] {
    memory.mean_by_lag
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_a_step_is_followed_exponentially_whatever_the_steps() {
        for steps in [1_u32, 7, 40] {
            let mut memory = ActuatorMemory { fins_rad: Some([0.0; FINS]), ..ActuatorMemory::default() };
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
