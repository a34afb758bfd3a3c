//! What is known of the noise before any effect: scale of each channel, isolated outliers of the ranges.

use crate::samples::{LogEvent, Reading, ResidualChannel, Samples};
use crate::split::{DataPart, Split};
use crate::whitener::Residual;
use backseat_core::navigation::SensorNoise;
use backseat_logs::stats::{median, poisson_tail};
use std::collections::BTreeMap;

/// Samples below which a channel's scale is not estimated.
const LEAST_SAMPLES: usize = 60;
/// Standard deviations of its own estimate by which a scale must exceed 1 to be believed.
const BELIEVED: f64 = 5.0;
/// Half the number of neighbours of a range that say what it should be.
const NEIGHBOURS: usize = 3;
/// A range this many sigmas from its neighbours is an outlier: of 120 good ones less than one in a hundred logs has
/// one.
const OUTLIER: f64 = 4.5;
/// Times that the neighbours are chosen again.
const PASSES: usize = 3;

/// Factor of each channel's noise on the declared one: from differences of successive normalised innovations,
/// which whatever is slow (an effect) leaves alone; a median, which outliers leave alone. Never below 1: data are not
/// trusted more than they were declared, nor less than a sensor of its kind deserves.
#[must_use]
pub fn scales(residuals: &[Residual], sensors: &SensorNoise) -> [f64; ResidualChannel::COUNT] {
    std::array::from_fn(|index| {
        // By what one reading is declared to scatter, whatever it is worth beside others.
        let single = |r: &Residual| r.normalised() * r.alike.sqrt();
        let e: Vec<f64> = residuals.iter().filter(|r| r.channel as usize == index).map(single).collect();
        if e.len() < LEAST_SAMPLES {
            return 1.0;
        }
        // Second differences: what moves steadily leaves them too.
        let jumps: Vec<f64> = e.windows(3).map(|w| ((w[2] - 2.0 * w[1] + w[0]) / 6.0_f64.sqrt()).abs()).collect();
        let scale = median(&jumps).unwrap_or(1.0) * 1.482_602;
        // A median deviation has 1.17/√n relative error; differences overlap and count by half.
        let error = 1.17 * (2.0 / e.len() as f64).sqrt();
        let most = ResidualChannel::ALL[index].most_scale(sensors);
        if scale > 1.0 + BELIEVED * error { scale.min(most) } else { 1.0 }
    })
}

/// Ranges, in order, that are far from what their neighbours of the same other end say: (time in s, is an outlier). How
/// far is too far is taken from the ranges that do not judge.
#[must_use]
pub fn outliers(residuals: &[Residual], split: &Split) -> Vec<(f64, bool)> {
    let is_range = |r: &&Residual| matches!(r.channel, ResidualChannel::Range | ResidualChannel::UsblAlong);
    let ranges: Vec<&Residual> = residuals.iter().filter(is_range).collect();
    let mut is_out = vec![false; ranges.len()];
    let mut distances = vec![0.0; ranges.len()];
    // A transponder that stands elsewhere makes no outliers of its ranges among those of others.
    let mut alike: BTreeMap<(ResidualChannel, Option<u32>), Vec<usize>> = BTreeMap::new();
    for (i, r) in ranges.iter().enumerate() {
        alike.entry((r.channel, r.station)).or_default().push(i);
    }
    // Neighbours that are outliers themselves say nothing: look again without them.
    for _ in 0..PASSES {
        for group in alike.values() {
            for (place, i) in group.iter().enumerate() {
                let near: Vec<f64> = (place.saturating_sub(NEIGHBOURS)..(place + NEIGHBOURS + 1).min(group.len()))
                    .filter(|j| *j != place && !is_out[group[*j]])
                    .map(|j| ranges[group[j]].innovation)
                    .collect();
                distances[*i] = (ranges[*i].innovation - median(&near).unwrap_or(0.0)) / ranges[*i].sigma;
            }
        }
        // Where an effect moves the ranges about, neighbours differ by more than their noise.
        let seen = ranges.iter().zip(&distances).filter(|(r, _)| split.is_at(DataPart::Seen, r.t_s));
        let spread = median(&seen.map(|(_, d)| d.abs()).collect::<Vec<_>>()).unwrap_or(0.0) * 1.482_602;
        let limit = OUTLIER * spread.max(1.0);
        for (is_out, distance) in is_out.iter_mut().zip(&distances) {
            *is_out = distance.abs() > limit;
        }
    }
    ranges.iter().map(|r| r.t_s).zip(is_out).collect()
}

/// For every acoustic reading, in order, whether its range is an outlier.
#[must_use]
pub fn flags(samples: &Samples, outliers: &[(f64, bool)]) -> Vec<bool> {
    let found: Vec<f64> = outliers.iter().filter(|(_, is)| *is).map(|(t_s, _)| *t_s).collect();
    let is_acoustic =
        |event: &LogEvent| matches!(event, LogEvent::Reading(Reading::Acoustic { .. } | Reading::Usbl { .. }));
    let acoustic = samples.events.iter().filter(|(_, event)| is_acoustic(event));
    acoustic.map(|(t_s, _)| found.contains(t_s)).collect()
}

/// Probability of so many outliers among so many good ranges.
#[must_use]
pub fn outlier_tail(hits: usize, count: usize) -> f64 {
    /// Probability that a good range is called one: its neighbours' median adds a quarter to its variance.
    const FALSE_ALARM: f64 = 1e-4;
    poisson_tail(hits, count as f64 * FALSE_ALARM)
}
