//! Waves: a peak in the spectrum of the DVL's innovations, and the amplitude behind it.
//!
//! Waves carry the vehicle along, so that its velocity over ground swings while its model does not. The innovations
//! show by a narrow peak that there are waves and of which period; how large they are follows from the
//! variance that the measured velocities have in that band beyond their neighbourhood.

use crate::samples::{LogEvent, Reading, ResidualChannel, Samples};
use crate::split::{DataPart, Split};
use crate::whitener::Residual;
use backseat_logs::stats::f_tail;
use std::f64::consts::TAU;

/// Length of a segment, s: a swell of 12 s has ten periods in it.
const SEGMENT_S: f64 = 120.0;
/// Periods searched, s.
const PERIODS_S: [f64; 2] = [2.5, 20.0];
/// Frequencies of a peak, and of the neighbourhood it is compared with, over the peak's.
const PEAK: [f64; 2] = [0.8, 1.25];
const NEIGHBOURHOOD: [f64; 2] = [0.5, 2.0];

/// Waves found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waves {
    /// Amplitude of the orbital velocity, m/s.
    pub amplitude_mps: f64,
    /// One sigma of it.
    pub amplitude_sigma_mps: f64,
    /// Period, s.
    pub period_s: f64,
    /// One sigma of it.
    pub period_sigma_s: f64,
    /// Probability of such a peak without waves, all periods considered.
    pub p: f64,
}

/// A spectrum: power by frequency bin, and how many values stand behind each.
struct Spectrum {
    bin_hz: f64,
    /// Per segment: power of each bin, all axes together, per sample (white noise of variance 1: 1 an axis).
    segments: Vec<Vec<f64>>,
}

impl Spectrum {
    /// Hann-windowed periodograms of half-overlapping segments in which nothing judges.
    fn of(axes: &[Vec<(f64, f64)>; 3], split: &Split) -> Option<Self> {
        let bin_hz = 1.0 / SEGMENT_S;
        let bins = (1.0 / PERIODS_S[0] * NEIGHBOURHOOD[1] / bin_hz) as usize + 1;
        let last_s = axes[0].last()?.0;
        let count = (last_s / (0.5 * SEGMENT_S)) as usize;
        let mut segments = Vec::new();
        for segment in 0..count.saturating_sub(1) {
            let from_s = 0.5 * SEGMENT_S * segment as f64;
            let blocks = (SEGMENT_S / split.block_s).ceil() as usize;
            let within = |block: usize| from_s + (SEGMENT_S - 1e-3) * block as f64 / blocks as f64;
            if (0..=blocks).any(|block| !split.is_at(DataPart::Seen, within(block))) {
                continue;
            }
            let mut power = vec![0.0; bins];
            for axis in axes {
                let first = axis.partition_point(|(t_s, _)| *t_s < from_s);
                let end = axis.partition_point(|(t_s, _)| *t_s < from_s + SEGMENT_S);
                let values = &axis[first..end];
                // A segment with a gap has no spectrum.
                if values.len() < 2 * bins {
                    continue;
                }
                let mean = values.iter().map(|(_, v)| v).sum::<f64>() / values.len() as f64;
                let window = |t_s: f64| 0.5 - 0.5 * (TAU * (t_s - from_s) / SEGMENT_S).cos();
                let norm: f64 = values.iter().map(|(t_s, _)| window(*t_s).powi(2)).sum();
                let windowed: Vec<(f64, f64)> =
                    values.iter().map(|(t_s, v)| (*t_s, window(*t_s) * (v - mean))).collect();
                for (bin, power) in power.iter_mut().enumerate().skip(1) {
                    let omega = TAU * bin as f64 * bin_hz;
                    // Rotation by a fixed step would lose the jitter of the times; a sine each is exact and cheap.
                    let (mut re, mut im) = (0.0, 0.0);
                    for (t_s, v) in &windowed {
                        let (sin, cos) = (omega * t_s).sin_cos();
                        re += v * cos;
                        im += v * sin;
                    }
                    *power += (re * re + im * im) / norm;
                }
            }
            segments.push(power);
        }
        (segments.len() >= 4).then_some(Self { bin_hz, segments })
    }

    fn mean(&self, bin: usize) -> f64 {
        self.segments.iter().map(|segment| segment[bin]).sum::<f64>() / self.segments.len() as f64
    }

    /// Mean power of a peak about `hz` and of its neighbourhood, with the number of bins in each.
    fn contrast(&self, mean: &[f64], hz: f64) -> ([f64; 2], [f64; 2]) {
        let (mut sums, mut counts) = ([0.0; 2], [0.0; 2]);
        for (bin, power) in mean.iter().enumerate().skip(1) {
            let ratio = bin as f64 * self.bin_hz / hz;
            let side = if (PEAK[0]..=PEAK[1]).contains(&ratio) {
                0
            } else if (NEIGHBOURHOOD[0]..=NEIGHBOURHOOD[1]).contains(&ratio) {
                1
            } else {
                continue;
            };
            sums[side] += power;
            counts[side] += 1.0;
        }
        ([sums[0] / counts[0], sums[1] / counts[1]], counts)
    }
}

/// Looks for waves in the innovations of a pass.
#[must_use]
pub fn find(samples: &Samples, residuals: &[Residual], split: &Split) -> Option<Waves> {
    let axis = |channel: ResidualChannel| -> Vec<(f64, f64)> {
        residuals.iter().filter(|r| r.channel == channel).map(|r| (r.t_s, r.normalised())).collect()
    };
    let axes = [ResidualChannel::DvlU, ResidualChannel::DvlV, ResidualChannel::DvlW].map(axis);
    let spectrum = Spectrum::of(&axes, split)?;
    let bins = spectrum.segments[0].len();
    let mean: Vec<f64> = (0..bins).map(|bin| spectrum.mean(bin)).collect();
    let range =
        (1.0 / PERIODS_S[1] / spectrum.bin_hz).ceil() as usize..=(1.0 / PERIODS_S[0] / spectrum.bin_hz) as usize;
    let tried = range.clone().count() as f64;
    let (hz, [peak, around], counts) = range
        .map(|bin| {
            let hz = bin as f64 * spectrum.bin_hz;
            let (powers, counts) = spectrum.contrast(&mean, hz);
            (hz, powers, counts)
        })
        .max_by(|a, b| (a.1[0] / a.1[1]).total_cmp(&(b.1[0] / b.1[1])))?;
    // Overlapping Hann segments have 1.9/2 of the freedom; neighbouring bins of the window two thirds. Three axes, two
    // quadratures each.
    let freedom = |bins: f64| 6.0 * bins / 1.5 * spectrum.segments.len() as f64 * 0.95 / 1.0;
    let p = (f_tail(peak / around, freedom(counts[0]), freedom(counts[1])) * tried).min(1.0);
    let (amplitude_mps, amplitude_sigma_mps, period_s, period_sigma_s) = size(samples, hz, split)?;
    Some(Waves { amplitude_mps, amplitude_sigma_mps, period_s, period_sigma_s, p })
}

/// Amplitude and period from the measured velocities about `hz`.
fn size(samples: &Samples, hz: f64, split: &Split) -> Option<(f64, f64, f64, f64)> {
    let mut axes: [Vec<(f64, f64)>; 3] = Default::default();
    for (t_s, event) in &samples.events {
        if let LogEvent::Reading(Reading::Dvl(velocity)) = event {
            for (axis, value) in axes.iter_mut().zip(velocity) {
                axis.push((*t_s, *value));
            }
        }
    }
    let spectrum = Spectrum::of(&axes, split)?;
    let step_s = samples_step(&axes[0])?;
    let bins = spectrum.segments[0].len();
    // Excess over the neighbourhood, by segment: its scatter is the interval.
    let mut amplitudes = Vec::new();
    let mut moments = Vec::new();
    for segment in &spectrum.segments {
        let ([_, around], _) = spectrum.contrast(segment, hz);
        let (mut excess, mut moment) = (0.0, 0.0);
        for bin in 1..bins {
            let f = bin as f64 * spectrum.bin_hz;
            if (PEAK[0]..=PEAK[1]).contains(&(f / hz)) {
                let power = segment[bin] - around;
                excess += power;
                moment += power * f;
            }
        }
        // Two-sided spectrum: variance = 2 Σ P · bin · step; orbital motion has a² over all axes.
        amplitudes.push(2.0 * excess * spectrum.bin_hz * step_s);
        moments.push((excess, moment));
    }
    let n = amplitudes.len() as f64;
    let mean = amplitudes.iter().sum::<f64>() / n;
    let variance = amplitudes.iter().map(|a| (a - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let amplitude = mean.max(0.0).sqrt();
    let (weight, centre) = moments.iter().fold((0.0, 0.0), |sum, of| (sum.0 + of.0, sum.1 + of.1));
    // The frequency is a ratio of sums: a segment without waves says nothing of it.
    let f = centre / weight;
    let scatter = moments.iter().map(|(e, m)| (m - f * e).powi(2)).sum::<f64>() / (n - 1.0) / (weight / n).powi(2);
    // Half-overlapping segments: two of three count.
    let independent = n / 1.5;
    let sigma = (variance / independent).sqrt() / (2.0 * amplitude).max(f64::MIN_POSITIVE);
    let f_sigma = (scatter / independent).sqrt();
    (f > 0.0).then(|| (amplitude, sigma, 1.0 / f, f_sigma / (f * f)))
}

fn samples_step(axis: &[(f64, f64)]) -> Option<f64> {
    let steps: Vec<f64> = axis.windows(2).map(|w| w[1].0 - w[0].0).collect();
    backseat_logs::stats::median(&steps).filter(|step| *step > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::split::FORECAST_SHARE;
    use hil_sim::rng::{Source, Stream};

    /// Orbits of 0.1 m/s every 5 s, in the first half of a log. Segments without waves say nothing of the period.
    #[test]
    fn val_amplitude_and_period_of_waves_in_half_of_a_log() {
        let mut stream = Stream::new(7, Source::Depth);
        let velocity = |k: usize, noise: [f64; 3]| {
            let (sin, cos) = (TAU / 5.0 * 0.2 * k as f64).sin_cos();
            let amplitude = if k < 6000 { 0.1 } else { 0.0 };
            [1.5 + amplitude * cos + noise[0], noise[1], amplitude * sin + noise[2]]
        };
        let noises = std::iter::repeat_with(|| std::array::from_fn(|_| 0.01 * stream.normal()));
        let readings = noises.take(12_000).enumerate().map(|(k, noise)| (0.2 * k as f64, velocity(k, noise)));
        let events = readings.map(|(t_s, dvl)| (t_s, LogEvent::Reading(Reading::Dvl(dvl)))).collect();
        let samples = Samples { events, ..Samples::default() };
        let split = Split::of_one_run(2400.0, 20.0, FORECAST_SHARE);
        let (amplitude_mps, amplitude_sigma_mps, period_s, period_sigma_s) = size(&samples, 0.2, &split).unwrap();
        assert!((period_s - 5.0).abs() < 3.0 * period_sigma_s && period_sigma_s < 0.1, "{period_s} {period_sigma_s}");
        // Half of the power is there.
        let mean = 0.1 / 2.0_f64.sqrt();
        assert!((amplitude_mps - mean).abs() < 3.0 * amplitude_sigma_mps, "{amplitude_mps} {amplitude_sigma_mps}");
    }
}
