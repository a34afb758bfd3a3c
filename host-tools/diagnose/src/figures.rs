//! What a reader is shown: the residual that changes most, what it depends on, its spectrum.

use crate::samples::ResidualChannel;
use crate::whitener::{Pass, Residual, Trace};
use backseat_core::state::{PSI, R, THETA, U, Z};
use backseat_logs::stats::autocorrelation;
use std::f64::consts::TAU;

/// Values of one channel in order of time: (time in s, innovation, one sigma).
#[must_use]
pub fn channel(pass: &Pass, channel: ResidualChannel) -> Vec<&Residual> {
    pass.residuals.iter().filter(|r| r.channel == channel && r.used).collect()
}

/// The channel whose residual the effects change most; without effects the least white one.
#[must_use]
pub fn most_changed_channel(before: &Pass, after: &Pass) -> ResidualChannel {
    let square = |pass: &Pass, c| channel(pass, c).iter().map(|r| r.normalised().powi(2)).sum::<f64>();
    let score = |c: ResidualChannel| {
        let change = square(before, c) - square(after, c);
        if change.abs() > 1e-6 {
            return change;
        }
        let e: Vec<f64> = channel(before, c).iter().map(|r| r.normalised()).collect();
        // Far below any change of a sum of squares.
        autocorrelation(&e, 5.min(e.len() / 4)).iter().map(|r| r.abs()).sum::<f64>() * 1e-6
    };
    ResidualChannel::ALL.into_iter().max_by(|a, b| score(*a).total_cmp(&score(*b))).unwrap_or(ResidualChannel::Heading)
}

/// Means of `values` over `bin_s`: (time in h, mean).
#[must_use]
pub fn smooth(values: impl Iterator<Item = (f64, f64)>, bin_s: f64) -> Vec<(f64, f64)> {
    let mut bins: Vec<(f64, f64, f64)> = Vec::new();
    let mut current = f64::NAN;
    for (t_s, value) in values {
        let bin = (t_s / bin_s).floor();
        if bin != current {
            bins.push((0.0, 0.0, 0.0));
            current = bin;
        }
        if let Some((times, sum, count)) = bins.last_mut() {
            *times += t_s;
            *sum += value;
            *count += 1.0;
        }
    }
    bins.into_iter().map(|(times, sum, count)| (times / count / 3600.0, sum / count)).collect()
}

/// A quantity of the estimate.
pub type Variable = fn(&Trace) -> f64;

/// What a residual may depend on.
pub const VARIABLES: [(&str, Variable); 7] = [
    ("heading [deg]", |trace| trace.x[PSI].to_degrees()),
    ("speed through water [m/s]", |trace| trace.x[U]),
    ("depth [m]", |trace| trace.x[Z]),
    ("pitch [deg]", |trace| trace.x[THETA].to_degrees()),
    ("yaw rate [deg/s]", |trace| trace.x[R].to_degrees()),
    ("propeller [rad/s]", |trace| trace.input.at(trace.t_s).propeller_radps),
    ("time [min]", |trace| trace.t_s / 60.0),
];
/// Bins of a variable.
const BINS: usize = 18;

/// The variable that explains most of a residual, with the residual's mean in bins of it, before and after.
#[must_use]
pub fn best_variable(before: &Pass, after: &Pass, of: ResidualChannel) -> (&'static str, [Vec<(f64, f64)>; 2]) {
    let values = |pass: &Pass, variable: Variable| -> Vec<(f64, f64)> {
        let mut place = 0;
        channel(pass, of)
            .iter()
            .filter_map(|r| {
                while pass.trace.get(place + 1).is_some_and(|trace| trace.t_s <= r.t_s) {
                    place += 1;
                }
                Some((variable(pass.trace.get(place)?), r.innovation))
            })
            .collect()
    };
    let explained = |pairs: &[(f64, f64)]| {
        let mean = pairs.iter().map(|p| p.1).sum::<f64>() / pairs.len().max(1) as f64;
        let total: f64 = pairs.iter().map(|p| (p.1 - mean).powi(2)).sum();
        let within: f64 = binned(pairs).iter().map(|(_, m, count, squares)| squares - count * m * m).sum();
        1.0 - within / total.max(f64::MIN_POSITIVE)
    };
    let best = VARIABLES
        .iter()
        .map(|(name, variable)| {
            let pairs = values(before, *variable);
            (*name, *variable, explained(&pairs))
        })
        // Time explains a step or a ramp; where something else explains as much, that is the cause.
        .max_by(|a, b| weight(a.0, a.2).total_cmp(&weight(b.0, b.2)));
    let Some((name, variable, _)) = best else { return ("", [Vec::new(), Vec::new()]) };
    let line = |pass| binned(&values(pass, variable)).into_iter().map(|(x, mean, ..)| (x, mean)).collect();
    (name, [line(before), line(after)])
}

fn weight(name: &str, explained: f64) -> f64 {
    if name.starts_with("time") { 0.8 * explained } else { explained }
}

/// (middle, mean, count, sum of squares) of bins that hold something.
fn binned(pairs: &[(f64, f64)]) -> Vec<(f64, f64, f64, f64)> {
    let (low, high) = pairs.iter().fold((f64::MAX, f64::MIN), |(low, high), (x, _)| (low.min(*x), high.max(*x)));
    let width = ((high - low) / BINS as f64).max(f64::MIN_POSITIVE);
    let mut bins = vec![(0.0, 0.0, 0.0, 0.0); BINS];
    for (x, value) in pairs {
        let (xs, sum, count, squares) = &mut bins[(((x - low) / width) as usize).min(BINS - 1)];
        *xs += x;
        *sum += value;
        *count += 1.0;
        *squares += value * value;
    }
    let least = (pairs.len() as f64 * 2e-4).max(5.0);
    let full = bins.into_iter().filter(|(_, _, count, _)| *count >= least);
    full.map(|(xs, sum, count, squares)| (xs / count, sum / count, count, squares)).collect()
}

/// Power spectrum of the normalised innovations of a channel: (frequency in Hz, power; 1 if white), in bands of equal
/// ratio.
#[must_use]
pub fn spectrum(pass: &Pass, of: ResidualChannel) -> Vec<(f64, f64)> {
    const SEGMENT: usize = 512;
    const BANDS: usize = 36;
    let e = channel(pass, of);
    let (Some(first), Some(last)) = (e.first(), e.last()) else { return Vec::new() };
    let step_s = (last.t_s - first.t_s) / (e.len().max(2) - 1) as f64;
    let size = SEGMENT.min(e.len());
    if size < 32 {
        return Vec::new();
    }
    let mut power = vec![0.0; size / 2];
    let segments = e.len() / size;
    for segment in e.chunks_exact(size) {
        for (k, power) in power.iter_mut().enumerate().skip(1) {
            let (mut re, mut im) = (0.0, 0.0);
            // Goertzel would save the sines; half a thousand of them are nothing.
            let (sin_step, cos_step) = (TAU * k as f64 / size as f64).sin_cos();
            let (mut sin, mut cos) = (0.0, 1.0);
            for r in segment {
                let value = r.normalised();
                re += value * cos;
                im += value * sin;
                (sin, cos) = (sin * cos_step + cos * sin_step, cos * cos_step - sin * sin_step);
            }
            *power += (re * re + im * im) / (size * segments) as f64;
        }
    }
    let ratio = (size as f64 / 2.0).powf(1.0 / BANDS as f64);
    let mut bands: Vec<(f64, f64)> = Vec::new();
    let mut low = 1.0;
    while low < (size / 2) as f64 {
        let high = (low * ratio).max(low + 1.0);
        let inside = &power[low as usize..(high as usize).min(size / 2)];
        if !inside.is_empty() {
            let middle = 0.5 * (low.floor() + high.floor() - 1.0);
            bands.push((middle / (size as f64 * step_s), inside.iter().sum::<f64>() / inside.len() as f64));
        }
        low = high;
    }
    bands
}
