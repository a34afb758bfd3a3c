//! Recent samples of a sensor, interpolated.
//!
//! Sensors sample at their own rates and are heard late. The last few samples of each are kept, and its value at one
//! time in the recent past is interpolated, so that attitude, rates and velocity belong together.

use crate::inputs::Latest;
use backseat_core::state::wrap_angle;

/// Samples of one sensor: one a step, so that these reach back 0.8 s.
const SAMPLES: usize = 8;
/// Across a longer gap nothing is interpolated, µs: a sensor of 2 Hz may be late by a tenth.
const LONGEST_GAP_US: u64 = 550_000;

/// A sensor's recent samples, three numbers each.
pub struct RecentSamples {
    /// Oldest first.
    samples: [(u64, [f64; 3]); SAMPLES],
    count: usize,
}

impl RecentSamples {
    pub const fn new() -> Self {
        Self { samples: [(0, [0.0; 3]); SAMPLES], count: 0 }
    }

    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Takes the latest sample, if it is a new one.
    pub fn take(&mut self, latest: Latest<[f64; 3]>) {
        let Some((time_us, value)) = latest else { return };
        let kept = self.kept();
        if kept.last().is_some_and(|(last_us, _)| time_us <= *last_us) {
            return;
        }
        if self.count == SAMPLES {
            self.samples.rotate_left(1);
            self.count -= 1;
        }
        if let Some(place) = self.samples.get_mut(self.count) {
            *place = (time_us, value);
            self.count += 1;
        }
    }

    fn kept(&self) -> &[(u64, [f64; 3])] {
        self.samples.get(..self.count).unwrap_or_default()
    }

    /// Mean time between the kept samples, s; `None` with fewer than three.
    pub fn interval_s(&self) -> Option<f64> {
        let [(first_us, _), .., (last_us, _)] = self.kept() else { return None };
        let intervals = self.count.saturating_sub(1);
        (intervals >= 2).then(|| last_us.saturating_sub(*first_us) as f64 * 1e-6 / intervals as f64)
    }

    /// Its value at a time between two samples; `None` outside, or across a gap.
    pub fn at(&self, time_us: u64) -> Option<[f64; 3]> {
        self.interpolated(time_us, |change| change)
    }

    /// The same of angles, the short way round.
    pub fn angles_at(&self, time_us: u64) -> Option<[f64; 3]> {
        self.interpolated(time_us, wrap_angle)
    }

    fn interpolated(&self, time_us: u64, change: fn(f64) -> f64) -> Option<[f64; 3]> {
        let kept = self.kept();
        let behind = kept.partition_point(|(sample_us, _)| *sample_us < time_us);
        let (after_us, after) = kept.get(behind)?;
        if *after_us == time_us {
            return Some(*after);
        }
        let (before_us, before) = kept.get(behind.checked_sub(1)?)?;
        let gap_us = after_us.saturating_sub(*before_us);
        if gap_us > LONGEST_GAP_US {
            return None;
        }
        let share = time_us.saturating_sub(*before_us) as f64 / gap_us as f64;
        let mut value = *before;
        for (value, after) in value.iter_mut().zip(after) {
            *value += share * change(*after - *value);
        }
        Some(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_samples_are_interpolated_and_gaps_are_not() {
        let mut samples = RecentSamples::new();
        for (time_us, x) in [(100_000, 1.0), (100_000, 9.0), (300_000, 2.0), (400_000, -3.0), (1_000_000, 0.0)] {
            samples.take(Some((time_us, [x, 0.0, 0.0])));
        }
        let x = |time_us| samples.at(time_us).map(|value| value[0]);
        assert_eq!([x(99_999), x(100_000), x(150_000), x(350_000)], [None, Some(1.0), Some(1.25), Some(-0.5)]);
        assert_eq!([x(700_000), x(1_000_000), x(1_000_001)], [None, Some(0.0), None]);
        assert_eq!(samples.interval_s(), Some(0.3));
    }

    #[test]
    fn val_angles_go_the_short_way() {
        let mut samples = RecentSamples::new();
        samples.take(Some((0, [0.0, 0.0, 3.1])));
        samples.take(Some((100_000, [0.0, 0.0, -3.1])));
        // halfway between 3.1 and 2π − 3.1
        let heading = samples.angles_at(50_000).unwrap()[2];
        assert!((heading - core::f64::consts::PI).abs() < 1e-12, "{heading}");
    }

    #[test]
    fn only_the_last_samples_are_kept() {
        let mut samples = RecentSamples::new();
        for i in 0..20 {
            samples.take(Some((i * 100_000, [i as f64; 3])));
        }
        assert_eq!(samples.at(1_100_000), None);
        assert_eq!(samples.at(1_250_000), Some([12.5; 3]));
    }
}
