//! Noise taken out of a log without delay.
//!
//! A low-pass filter takes noise out of what passes through the regressor, and with it some of the motion: |v| v of a filtered v
//! is not the filtered |v| v. Once a model is there, only what it leaves unexplained needs the filter: the trajectory is the
//! model's free run plus the filtered difference. What is filtered is then small, and the filter can be slow.

use crate::data::{PERIOD_S, Sample};
use crate::simulation::{self, OUTPUTS, Output, half_steps};
use backseat_core::dynamics::VehicleModel;
use backseat_core::state::VehicleState;
use core::f64::consts::PI;

/// A stretch at the samples and at the middle of each period between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Smoothed {
    /// States; position and heading are the model's.
    pub states: Vec<VehicleState>,
    /// The model's free run alone.
    pub model: Vec<VehicleState>,
}

/// Cut-off frequencies of the outputs, Hz.
pub type CutOffs = [f64; OUTPUTS];

/// The thesis' filter: attitude 1 Hz, velocities 0.5 Hz (EQUATIONS: v 0.5 Hz, s 1 Hz).
pub const PLAIN: CutOffs = [1.0, 1.0, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5];

/// Weights of a symmetric low-pass filter (sinc with a Hamming window, half amplitude at the cut-off), middle first.
fn taps(cutoff_hz: f64) -> Vec<f64> {
    let cutoff = cutoff_hz * PERIOD_S;
    let half = (1.7 / cutoff).ceil().max(4.0) as usize;
    let mut taps = vec![2.0 * cutoff];
    for k in 1..=half {
        let x = k as f64;
        taps.push((0.54 + 0.46 * (PI * x / half as f64).cos()) * (2.0 * PI * cutoff * x).sin() / (PI * x));
    }
    let sum = 2.0 * taps.iter().sum::<f64>() - taps[0];
    taps.iter().map(|tap| tap / sum).collect()
}

/// Zero-phase low-pass filter of every output; beyond its ends a stretch is taken to go on point-symmetrically.
#[must_use]
pub fn low_pass(values: &[Output], cutoffs_hz: &CutOffs) -> Vec<Output> {
    let mut filtered = vec![Output::zeros(); values.len()];
    let Some(last) = values.len().checked_sub(1) else { return filtered };
    for channel in 0..OUTPUTS {
        let at = |index: isize| {
            let reflect = |inside: usize, edge: usize| 2.0 * values[edge][channel] - values[inside][channel];
            match usize::try_from(index) {
                Err(_) => reflect(index.unsigned_abs().min(last), 0),
                Ok(index) if index > last => reflect((2 * last).saturating_sub(index), last),
                Ok(index) => values[index][channel],
            }
        };
        let taps = taps(cutoffs_hz[channel]);
        for (k, output) in filtered.iter_mut().enumerate() {
            let k = k as isize;
            let pairs = taps[1..].iter().zip(1..).map(|(tap, d)| tap * (at(k - d) + at(k + d)));
            output[channel] = taps[0] * at(k) + pairs.sum::<f64>();
        }
    }
    filtered
}

/// The trajectory of a stretch by a model's free run and the filtered difference to the measurements. Where the model's
/// run leaves what vehicles do, the measurements are filtered without it, at [`PLAIN`].
#[must_use]
pub fn with_model(model: &VehicleModel, samples: &[Sample], cutoffs_hz: &CutOffs) -> Smoothed {
    let Some(first) = samples.first() else { return Smoothed { states: Vec::new(), model: Vec::new() } };
    let mut run = simulation::free_run(model, &simulation::start(first), samples);
    let strayed = |x: &VehicleState| !simulation::output(x).iter().all(|value| value.abs() < 20.0);
    let mut cutoffs = *cutoffs_hz;
    if run.iter().any(strayed) {
        run = vec![VehicleState::zeros(); half_steps(samples.len())];
        cutoffs = PLAIN;
    }
    let differences: Vec<Output> =
        samples.iter().zip(run.iter().step_by(2)).map(|(sample, x)| simulation::residual(sample, x)).collect();
    let slow = low_pass(&differences, &cutoffs);
    let states = run.iter().enumerate().map(|(instant, x)| {
        let k = instant / 2;
        let difference = if instant % 2 == 0 { slow[k] } else { middle(&slow, k) };
        let mut x = *x;
        for (index, change) in simulation::OUTPUT_STATES.iter().zip(difference.iter()) {
            x[*index] += change;
        }
        x
    });
    Smoothed { states: states.collect(), model: run }
}

/// Half way from sample k to the next, by the cubic through four samples.
fn middle(values: &[Output], k: usize) -> Output {
    let near = (values[k] + values[k + 1]) * 0.5;
    match (k.checked_sub(1).and_then(|before| values.get(before)), values.get(k + 2)) {
        (Some(before), Some(after)) => near * 1.125 - (before + after) * 0.0625,
        _ => near,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    #[test]
    fn val_slow_signals_pass_in_phase_and_fast_ones_do_not() {
        let sine =
            |hz: f64| (0..2000).map(|k| Output::repeat((TAU * hz * k as f64 * PERIOD_S).sin())).collect::<Vec<_>>();
        for (hz, gain) in [(0.02, 1.0), (0.5, 0.5), (1.5, 0.0)] {
            let input = sine(hz);
            let output = low_pass(&input, &[0.5; OUTPUTS]);
            // A Hamming window leaves 0.3 % of ripple; the edges are not looked at.
            for k in 100..1900 {
                assert!((output[k] - input[k] * gain).amax() < 6.0e-3, "{hz} Hz at {k}");
            }
        }
    }

    #[test]
    fn a_ramp_passes_up_to_its_ends() {
        let ramp: Vec<Output> = (0..500).map(|k| Output::repeat(k as f64)).collect();
        for (filtered, value) in low_pass(&ramp, &PLAIN).iter().zip(&ramp) {
            assert!((filtered - value).amax() < 1.0e-9);
        }
    }
}
