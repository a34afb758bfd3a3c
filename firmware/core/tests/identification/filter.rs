//! The pre-filter against what a symmetric low-pass filter is.

use super::support::Random;
use backseat_core::dynamics::ActuatorInput;
use backseat_core::identification::{DELAY, Measured, PreFilter};
use core::f64::consts::TAU;
use nalgebra::{Vector3, Vector6};

/// Cut-off of 0.6 Hz at 10 Hz.
const CUTOFF: f64 = 0.06;

/// Every channel holds the same number.
fn sample(step: usize, value: f64) -> Measured {
    Measured {
        time_us: step as u64 * 100_000,
        velocity: Vector6::repeat(value),
        down: Vector3::repeat(value),
        input: ActuatorInput { propeller_radps: value, fins_rad: [value; 4] },
    }
}

fn channels(measured: &Measured) -> impl Iterator<Item = f64> {
    let input = &measured.input;
    let inputs = [input.propeller_radps, input.fins_rad[0], input.fins_rad[1], input.fins_rad[2], input.fins_rad[3]];
    let states: Vec<_> = measured.velocity.iter().chain(measured.down.iter()).copied().collect();
    states.into_iter().chain(inputs)
}

fn filter(held: bool) -> PreFilter {
    let mut filter = PreFilter::new();
    filter.configure(CUTOFF, held);
    filter
}

/// Worst |output − gain · input, DELAY samples ago| of a sine of so many cycles a sample, over all channels.
fn worst(frequency: f64, gain: f64) -> f64 {
    let signal = |step: f64| libm::sin(TAU * frequency * step + 0.3);
    let mut filter = filter(false);
    let mut worst = 0.0_f64;
    for step in 0..300 {
        let Some(output) = filter.push(&sample(step, signal(step as f64))) else { continue };
        let middle = step - DELAY;
        assert_eq!(output.time_us, middle as u64 * 100_000);
        for value in channels(&output) {
            worst = worst.max((value - gain * signal(middle as f64)).abs());
        }
    }
    worst
}

#[test]
fn val_all_channels_are_delayed_alike_and_low_passed() {
    // A tenth of a hertz passes in phase, three hertz and more do not; a Hamming window leaves 0.2 to 0.3 % of ripple.
    assert!(worst(0.01, 1.0) < 5.0e-3, "{}", worst(0.01, 1.0));
    assert!(worst(CUTOFF, 0.5) < 2.0e-2, "{}", worst(CUTOFF, 0.5));
    for frequency in [0.2, 0.3, 0.45] {
        assert!(worst(frequency, 0.0) < 5.0e-3, "{frequency}: {}", worst(frequency, 0.0));
    }
}

#[test]
fn val_noise_gain_is_that_of_noise() {
    let (mut filter, mut random) = (filter(false), Random(10));
    let (mut square, mut count) = (0.0, 0.0);
    for step in 0..200_000 {
        if let Some(output) = filter.push(&sample(step, random.normal(1.0))) {
            square += output.velocity[0] * output.velocity[0];
            count += 1.0;
        }
    }
    // Some 20 000 independent samples: the variance is known to 1 %, three of which are allowed.
    let ratio = square / count / (filter.noise_gain() * filter.noise_gain());
    assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
}

#[test]
fn held_inputs_act_half_a_period_after_their_sample() {
    // A ramp held from sample to sample is on average half a step behind the ramp.
    let mut filter = filter(true);
    for step in 0..100 {
        let Some(output) = filter.push(&sample(step, step as f64)) else { continue };
        let middle = (step - DELAY) as f64;
        assert!((output.velocity[0] - middle).abs() < 1.0e-9);
        // But for the first window, whose first sample has no predecessor.
        if step > 2 * DELAY {
            assert!((output.input.propeller_radps - (middle - 0.5)).abs() < 1.0e-9);
            assert!((output.input.fins_rad[3] - (middle - 0.5)).abs() < 1.0e-9);
        }
    }
}
