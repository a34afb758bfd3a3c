//! What the covariance of the position leaves out.
//!
//! The filter takes its sensors as they are declared: fixes and the ship's reports with white errors, and one of two
//! position solutions where fixes and ranges contradict each other. Its P is that of the thesis, and consistency is
//! judged by it. What a board *states* of its position is P and, per axis, the variance of
//!
//! - **the two GNSS receivers**, the vehicle's and, once a range was used, the ship's. A receiver's error is not white:
//!   no number of fixes averages it out, and no other sensor shows it;
//! - **ranges that S does not explain**, by the chi-square of [`Window`] over [`RANGES_S`]: slow drifts, of a clock, of
//!   fixes, of a receiver, that no single innovation betrays;
//! - **the rejected solution** ([`Disagreement`]), while fixes and ranges contradict each other, and after a range that
//!   the filter followed though S did not explain it: the filter follows one of them, and P is as small as if the other
//!   did not exist. Nothing on board says which of the two is right;
//! - **a range that contradicts before three have been used**: the position rests on fixes alone, and one line of sight
//!   has not confirmed them.
//!
//! Of depth it is what the depth cell's innovations have more than S explains, and the waves that the filter smooths.

use super::innovation_monitor::{InnovationMonitor, TURN_US};
use super::innovation_window::Window;
use super::waves::WAVES_S;
use crate::navigation::interface::measurement::{FusionOutcome, FusionRecord, Fusions, Sensor};
use crate::parameters::SensorNoise;
use crate::state::{X, Y, Z};

/// Time constants of the windows over ranges, s: with weights that forget, nine and sixty-three ranges at one every 30 s.
const RANGES_S: [f64; 2] = [120.0, 960.0];
/// A range enters its windows with so many sigmas at most: beyond, [`Filter::is_suspect`] decides. One that the main
/// filter has refused agrees with the mixture within as many.
const CLIP: f64 = 3.0;
/// A range with more sigmas that was used has moved the position: chance has one in sixteen thousand.
const FOLLOWED: f64 = 4.0;
/// The rejected solution is remembered for so long after the contradiction, µs.
const MEMORY_US: u64 = TURN_US;
/// Factor on the sigma of the ship's receiver, until the ship has gone around since the last fix: the filter takes the
/// difference of the two receivers for a current, which moves the position by as much again.
const SHIP_RECEIVER_FACTOR: f64 = 2.0;
/// Of the worst innovation of fixes, which see both axes; ranges see one direction of the difference only.
const SHARE: [f64; 2] = [1.0, 0.4];
/// By how much the rejected solution may have moved from the position, m/s: an undeclared current, and a vehicle that
/// drifts at the surface. What it says beyond cannot be true.
const RATE_MPS: [f64; 2] = [0.15, 0.5];

/// So many ranges that were used confirm the first fixes.
const CONFIRM: u32 = 3;
/// Largest one sigma by a range that contradicts before, m: fixes that are further off than three of it are contradicted
/// by the ranges that follow, and an outlier has no bound.
const UNCONFIRMED_M: f64 = 15.0;

/// A position solution that contradicts the one that the filter follows.
#[derive(Clone, Copy)]
struct Disagreement {
    /// When the contradiction began, µs, and whether it lasts.
    since_us: u64,
    lasts: bool,
    /// Worst innovation, m.
    worst_m: f64,
    /// When it ended, µs, how far the solutions were from each other then, m, by how much more with every second, m/s,
    /// and for how long at most, s.
    ended_us: u64,
    difference_m: f64,
    rate_mps: f64,
    lasted_s: f64,
}

impl Disagreement {
    const NEW: Self =
        Self { since_us: 0, lasts: false, worst_m: 0.0, ended_us: 0, difference_m: 0.0, rate_mps: 0.0, lasted_s: 0.0 };

    fn contradict(&mut self, since_us: u64, innovation_m: f64) {
        if !self.lasts {
            (self.lasts, self.since_us, self.worst_m) = (true, since_us, 0.0);
        }
        self.worst_m = self.worst_m.max(innovation_m.abs());
    }

    fn agree(&mut self, time_us: u64, share: f64, rate_mps: f64) {
        if self.lasts {
            let (before_m, now_m) = (self.before_m(time_us), self.now_m(time_us, share, rate_mps));
            if now_m > before_m {
                self.lasted_s = seconds(self.since_us, time_us).max(1.0);
                self.rate_mps = now_m / self.lasted_s;
            }
            (self.difference_m, self.lasts, self.ended_us) = (before_m.max(now_m), false, time_us);
        }
    }

    /// The filter has followed an innovation that S does not explain: it was where it is now, or it was right before.
    fn follow(&mut self, time_us: u64, innovation_m: f64) {
        if innovation_m.abs() > self.before_m(time_us) {
            (self.difference_m, self.ended_us, self.rate_mps) = (innovation_m.abs(), time_us, 0.0);
        }
    }

    /// One sigma that covers what is remembered.
    fn before_m(&self, time_us: u64) -> f64 {
        let remembered = time_us < self.ended_us.saturating_add(MEMORY_US);
        let since_s = seconds(self.ended_us, time_us).min(self.lasted_s);
        if remembered { self.difference_m + self.rate_mps * since_s } else { 0.0 }
    }

    /// One sigma that covers what contradicts now.
    fn now_m(&self, time_us: u64, share: f64, rate_mps: f64) -> f64 {
        if self.lasts { (share * self.worst_m).min(rate_mps * seconds(self.since_us, time_us)) } else { 0.0 }
    }

    /// One sigma that covers both.
    fn sigma_m(&self, time_us: u64, share: f64, rate_mps: f64) -> f64 {
        self.before_m(time_us).max(self.now_m(time_us, share, rate_mps))
    }
}

fn seconds(from_us: u64, to_us: u64) -> f64 {
    1.0e-6 * to_us.saturating_sub(from_us) as f64
}

/// What the mixture of a bank, which is stated, predicts of a depth or range, against the main filter, whose records
/// are taken. Zero without a bank, and of other measurements.
#[derive(Clone, Copy, Debug, Default)]
pub struct MixtureOffset {
    /// The main filter predicts so much more, m.
    pub(crate) predicted_m: f64,
    /// The mixture's prediction has so much more variance, m².
    pub(crate) variance_m2: f64,
}

impl MixtureOffset {
    /// Innovation of the mixture, m, and its variance, m², which is that of the reading at least.
    fn innovation(&self, record: &FusionRecord, sigma_m: f64) -> (f64, f64) {
        (record.innovation + self.predicted_m, (record.variance + self.variance_m2).max(sigma_m * sigma_m))
    }
}

/// Watches the innovations of a filter, and says what its covariance leaves out.
#[derive(Clone)]
pub struct Integrity {
    /// Ranges that were used, up to [`CONFIRM`].
    ranges_used: u32,
    /// Worst innovation of the ranges that were refused before, since one was used, m.
    refused_m: f64,
    /// When the first range since the last fix was used, µs.
    ranged_us: Option<u64>,
    ranges: [Window; 2],
    depth: Window,
    /// Of ranges, and of fixes.
    disagreements: [Disagreement; 2],
}

impl Integrity {
    /// Before the first measurement.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            ranges_used: 0,
            refused_m: 0.0,
            ranged_us: None,
            ranges: [Window::NEW; 2],
            depth: Window::NEW,
            disagreements: [Disagreement::NEW; 2],
        }
    }

    /// Takes the records that a measurement has left in the main filter, whose monitor is `monitor`; `offset` is that of
    /// the mixture before the measurement was fused.
    pub fn take(
        &mut self,
        fusions: &Fusions,
        monitor: &InnovationMonitor,
        sensors: &SensorNoise,
        offset: MixtureOffset,
    ) {
        for record in fusions.iter().filter(|record| record.variance > 0.0) {
            match (record.sensor, record.outcome) {
                (Sensor::Depth, FusionOutcome::Fused) => {
                    let (innovation, variance) = offset.innovation(record, sensors.depth_m);
                    self.depth.take(WAVES_S, record.time_us, innovation, variance);
                }
                (Sensor::Range, FusionOutcome::Fused | FusionOutcome::Gated) => {
                    let (innovation, variance) = offset.innovation(record, sensors.range_m);
                    let squared = innovation * innovation;
                    if record.outcome == FusionOutcome::Fused || squared <= CLIP * CLIP * variance {
                        self.range(record.time_us, innovation, variance);
                    } else {
                        self.contradict(0, monitor, record, innovation);
                        if self.ranges_used < CONFIRM {
                            self.refused_m = innovation.abs().min(UNCONFIRMED_M).max(self.refused_m);
                        }
                    }
                    if record.outcome == FusionOutcome::Fused && squared > FOLLOWED * FOLLOWED * variance {
                        let [ranges, _] = &mut self.disagreements;
                        ranges.follow(record.time_us, innovation);
                    }
                }
                (Sensor::VehicleGnss, FusionOutcome::Fused) => self.agree(monitor, record),
                (Sensor::VehicleGnss, FusionOutcome::Gated) => {
                    self.contradict(1, monitor, record, record.innovation);
                }
                _ => {}
            }
        }
    }

    fn range(&mut self, time_us: u64, innovation: f64, variance: f64) {
        self.ranges_used = (self.ranges_used + 1).min(CONFIRM);
        self.refused_m = 0.0;
        self.ranged_us.get_or_insert(time_us);
        let most = CLIP * libm::sqrt(variance);
        for (window, tau_s) in self.ranges.iter_mut().zip(RANGES_S) {
            window.take(tau_s, time_us, innovation.max(-most).min(most), variance);
        }
        let [ranges, _] = &mut self.disagreements;
        ranges.agree(time_us, SHARE[0], RATE_MPS[0]);
    }

    fn agree(&mut self, monitor: &InnovationMonitor, record: &FusionRecord) {
        if !monitor.is_suspect(record.sensor) {
            self.ranged_us = None;
            let [_, fixes] = &mut self.disagreements;
            fixes.agree(record.time_us, SHARE[1], RATE_MPS[1]);
        }
    }

    fn contradict(&mut self, place: usize, monitor: &InnovationMonitor, record: &FusionRecord, innovation_m: f64) {
        if let Some(disagreement) = self.disagreements.get_mut(place)
            && let Some(since_us) = monitor.suspect_since_us(record.sensor)
        {
            disagreement.contradict(since_us, innovation_m);
        }
    }

    /// What P, of which `variance` is the diagonal element, leaves out of the variance of vehicle state `i` at
    /// `time_us`; 0 of all states but position and depth. `receivers_m`: one sigma per axis of the slow errors of the
    /// vehicle's and of the ship's receiver; `wave_variance_m2`: what the main filter takes as noise of the depth cell by waves.
    #[must_use]
    pub fn unseen(
        &self,
        (i, variance): (usize, f64),
        time_us: u64,
        wave_variance_m2: f64,
        receivers_m: [f64; 2],
    ) -> f64 {
        match i {
            X | Y => {
                let [vehicle_m, ship_m] = receivers_m;
                let goes_around = self.ranged_us.is_some_and(|us| time_us < us.saturating_add(TURN_US));
                let ship_m = if goes_around { SHIP_RECEIVER_FACTOR * ship_m } else { ship_m };
                let mut sum = vehicle_m * vehicle_m + if self.ranges_used > 0 { ship_m * ship_m } else { 0.0 };
                sum += self.ranges.iter().map(Window::excess).fold(0.0, f64::max);
                for ((disagreement, share), rate_mps) in self.disagreements.iter().zip(SHARE).zip(RATE_MPS) {
                    let sigma_m = disagreement.sigma_m(time_us, share, rate_mps);
                    // P has grown by suspicion as well, where no other source holds the position
                    sum += (sigma_m * sigma_m - variance).max(0.0);
                }
                sum + (self.refused_m * self.refused_m - variance).max(0.0)
            }
            Z => self.depth.excess().max(wave_variance_m2),
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two solutions that diverged by 10 m in 100 s may do so for 100 s more; they are forgotten after 16 minutes.
    #[test]
    fn val_a_contradiction_grows_for_as_long_as_it_lasted() {
        let mut disagreement = Disagreement::NEW;
        disagreement.contradict(0, 10.0);
        disagreement.agree(100_000_000, 1.0, 0.15);
        for (time_s, sigma_m) in [(100, 10.0), (150, 15.0), (200, 20.0), (900, 20.0), (1060, 0.0)] {
            let stated_m = disagreement.sigma_m(1_000_000 * time_s, 1.0, 0.15);
            assert!((stated_m - sigma_m).abs() < 1e-9, "{time_s} s: {stated_m} m");
        }
    }
}
