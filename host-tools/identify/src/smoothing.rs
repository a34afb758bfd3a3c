//! Noise taken out of a log without delay.
//!
//! A low-pass filter takes noise out of what passes through the regressor, and with it some of the motion: |v| v of a
//! filtered v is not the filtered |v| v. Once a model is there, only what it leaves unexplained needs the filter: the
//! trajectory is the model's free run plus the filtered difference. What is filtered is then small, and the filter can
//! be slow.

use crate::sample::{PERIOD_S, Sample};
use crate::simulation::{self, OUTPUTS, Output, half_steps};
use backseat_core::dynamics::{Attitude, VehicleModel};
use backseat_core::state::{P, PHI, THETA, VehicleState, wrap_angle};
use backseat_logs::interrupt;
use core::f64::consts::PI;
use nalgebra::{Vector2, Vector3};
use std::ops::Range;

/// A stretch at the samples and at the middle of each period between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Smoothed {
    /// States; position and heading are the model's.
    pub states: Vec<VehicleState>,
    /// The model's free run alone.
    pub model: Vec<VehicleState>,
}

/// Rounds of attitude from rates, whose Euler rates need the attitude: a round takes its error down by a factor of ten.
const ATTITUDE_ROUNDS: usize = 2;

/// Cut-off frequencies of the outputs, Hz.
pub type CutOffs = [f64; OUTPUTS];

/// Without knowledge of a model: what a torpedo does is slower than 0.5 Hz. Attitude's is where gyros take over.
pub const PLAIN: CutOffs = [0.05, 0.05, 0.5, 0.5, 0.5, 1.0, 1.0, 1.0];

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
    low_pass_channels(values, cutoffs_hz, 0..OUTPUTS)
}

/// The same of some outputs; the others become zero.
fn low_pass_channels(values: &[Output], cutoffs_hz: &CutOffs, channels: Range<usize>) -> Vec<Output> {
    let mut filtered = vec![Output::zeros(); values.len()];
    let Some(last) = values.len().checked_sub(1) else { return filtered };
    for channel in channels {
        let taps = taps(cutoffs_hz[channel]);
        let reach = taps.len() - 1;
        let reflect = |inside: usize, edge: usize| 2.0 * values[edge][channel] - values[inside][channel];
        let before = (1..=reach).rev().map(|d| reflect(d.min(last), 0));
        let after = (1..=reach).map(|d| reflect(last - d.min(last), last));
        let padded: Vec<f64> = before.chain(values.iter().map(|v| v[channel])).chain(after).collect();
        for (output, window) in filtered.iter_mut().zip(padded.windows(2 * reach + 1)) {
            interrupt::check();
            let (old, new) = window.split_at(reach);
            let mut sum = 0.0;
            for ((tap, old), new) in taps.iter().zip([&new[0]].into_iter().chain(old.iter().rev())).zip(new) {
                sum += tap * (old + new);
            }
            // The middle counted twice.
            output[channel] = sum - taps[0] * new[0];
        }
    }
    filtered
}

/// Roll and pitch at the samples from the rates alone: Simpson's rule over the Euler rates of states at the samples and
/// between. Drifts as the rates do, but not by itself: the Euler rates are those at the states' own angles.
fn integrated_attitude(states: &[VehicleState]) -> Vec<Vector2<f64>> {
    let slopes: Vec<Vector2<f64>> = states
        .iter()
        .map(|x| {
            let attitude = Attitude::new(&Vector3::new(x[PHI], x[THETA], 0.0));
            (attitude.euler_rate_matrix() * x.fixed_rows::<3>(P)).fixed_rows::<2>(0).into_owned()
        })
        .collect();
    let mut angles = states.first().map_or_else(Vector2::zeros, |x| Vector2::new(x[PHI], x[THETA]));
    let mut all = vec![angles];
    for period in slopes.windows(3).step_by(2) {
        angles += (period[0] + period[1] * 4.0 + period[2]) * (PERIOD_S / 6.0);
        all.push(angles);
    }
    all
}

/// The trajectory of a stretch by a model's free run and the filtered difference to the measurements. Where the model's
/// run leaves what vehicles do, the measured velocities are filtered without it, at [`PLAIN`]. Roll and pitch are
/// integrals of these rates and the filtered difference to the measured angles: gyros are far quieter than what
/// measures angles.
#[must_use]
pub fn with_model(model: &VehicleModel, samples: &[Sample], cutoffs_hz: &CutOffs) -> Smoothed {
    let Some(first) = samples.first() else { return Smoothed { states: Vec::new(), model: Vec::new() } };
    let mut run = simulation::free_run(model, &simulation::start(first), samples);
    let strayed = |x: &VehicleState| !simulation::output(x).iter().all(|value| value.abs() < 20.0);
    let mut cutoffs = *cutoffs_hz;
    if run.iter().any(strayed) {
        run = vec![VehicleState::zeros(); half_steps(samples.len())];
        cutoffs = core::array::from_fn(|i| if i < 2 { cutoffs[i] } else { PLAIN[i] });
    }
    let mut differences: Vec<Output> =
        samples.iter().zip(run.iter().step_by(2)).map(|(sample, x)| simulation::residual(sample, x)).collect();
    let first_cutoffs = core::array::from_fn(|i| if i < 2 { 0.5 } else { cutoffs[i] });
    let slow = low_pass(&differences, &first_cutoffs);
    let mut states = run.clone();
    for (instant, x) in states.iter_mut().enumerate() {
        let change = at_half(&slow, instant);
        for (output, index) in simulation::OUTPUT_STATES.into_iter().enumerate() {
            x[index] += change[output];
        }
    }
    for _ in 0..ATTITUDE_ROUNDS {
        let integrated = integrated_attitude(&states);
        for ((difference, sample), angles) in differences.iter_mut().zip(samples).zip(&integrated) {
            difference[0] = wrap_angle(sample.attitude.x - angles.x);
            difference[1] = sample.attitude.y - angles.y;
        }
        let mut slow = low_pass_channels(&differences, &cutoffs, 0..2);
        for (slow, angles) in slow.iter_mut().zip(&integrated) {
            slow[0] += angles.x;
            slow[1] += angles.y;
        }
        for (instant, x) in states.iter_mut().enumerate() {
            let angles = at_half(&slow, instant);
            (x[PHI], x[THETA]) = (angles[0], angles[1]);
        }
    }
    Smoothed { states, model: run }
}

/// Value at a sample or half way to the next.
fn at_half(values: &[Output], instant: usize) -> Output {
    if instant.is_multiple_of(2) { values[instant / 2] } else { middle(values, instant / 2) }
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
