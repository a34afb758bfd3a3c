//! The pre-filter against what a symmetric low-pass filter is.

use super::support::Random;
use backseat_core::dynamics::ActuatorInput;
use backseat_core::identification::{DELAY, Measured, PreFilter};
use core::f64::consts::TAU;
use nalgebra::{Vector3, Vector6};

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

/// Worst |output − gain · input, DELAY samples ago| of a sine of so many cycles a sample, over all channels.
fn worst(frequency: f64, gain: f64) -> f64 {
    let signal = |step: f64| libm::sin(TAU * frequency * step + 0.3);
    let mut filter = PreFilter::new();
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
    // A vehicle's periods pass in phase: what is missing grows with the sixth power of the frequency, by 64 from 10 to
    // 5 s (the next term takes an eighth off that). Of noise faster than 1 Hz side lobes are left.
    let missing = [0.01, 0.02].map(|frequency| worst(frequency, 1.0));
    assert!(missing[0] < 2.0e-4 && (50.0..64.0).contains(&(missing[1] / missing[0])), "{missing:?}");
    for frequency in [0.1, 0.2, 0.3, 0.45] {
        assert!(worst(frequency, 0.0) < 0.2, "{frequency}: {}", worst(frequency, 0.0));
    }
}

#[test]
fn val_quintics_pass_as_they_are() {
    let polynomial = |step: usize| {
        let x = 0.05 * step as f64 - 4.0;
        1.0 - x * (2.0 + x * (0.3 - x * (1.0 + x * (0.25 - 0.1 * x))))
    };
    let mut filter = PreFilter::new();
    for step in 0..150 {
        let Some(output) = filter.push(&sample(step, polynomial(step))) else { continue };
        for value in channels(&output) {
            // Rounding of sums of numbers up to 1e2.
            assert!((value - polynomial(step - DELAY)).abs() < 1.0e-11, "{step}: {value}");
        }
    }
}

#[test]
fn val_noise_gain_is_that_of_noise() {
    let (mut filter, mut random) = (PreFilter::new(), Random(10));
    let (mut square, mut count) = (0.0, 0.0);
    for step in 0..200_000 {
        if let Some(output) = filter.push(&sample(step, random.normal())) {
            square += output.velocity[0] * output.velocity[0];
            count += 1.0;
        }
    }
    // Some 20 000 independent samples: the variance is known to 1 %, three of which are allowed.
    let ratio = square / count / (PreFilter::noise_gain() * PreFilter::noise_gain());
    assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
}
