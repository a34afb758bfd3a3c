//! What the filter is fed: each sensor's rate, age and innovations.

use backseat_core::navigation::Sensor;
use backseat_wire::hostlink::FusionTelemetry;
use std::collections::VecDeque;

/// A rate is the mean over as many measurements; at 10 Hz two seconds, of ranges several minutes.
const MEASUREMENTS: usize = 21;
/// Innovations of which the mean square is shown.
const REMEMBERED: f64 = 100.0;
/// The largest innovation of this time is shown, µs: the eye cannot follow ten a second.
const SHOWN_US: u64 = 1_000_000;

/// One measurement, of one or of several axes.
#[derive(Clone, Copy, Debug)]
struct Measurement {
    time_us: u64,
    /// The worst axis: |innovation| in its own sigmas.
    sigmas: f64,
    fused: bool,
}

/// One sensor as the filter sees it.
#[derive(Clone, Debug)]
pub struct SourceHistory {
    pub sensor: Sensor,
    last: VecDeque<Measurement>,
    /// Of innovation² / variance.
    mean_square: f64,
    scalars: f64,
    pub fused: u64,
    pub rejected: u64,
    /// Rejections since it was last fused.
    pub in_a_row: u32,
}

/// What a measurement changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Turn {
    /// The first of a row to be rejected, with its sigmas.
    Rejected(f64),
    /// Fused again after as many rejections.
    FusedAgain(u32),
}

impl SourceHistory {
    fn new(sensor: Sensor) -> Self {
        let last = VecDeque::with_capacity(MEASUREMENTS);
        Self { sensor, last, mean_square: 0.0, scalars: 0.0, fused: 0, rejected: 0, in_a_row: 0 }
    }

    fn note(&mut self, record: &FusionTelemetry) -> Option<Turn> {
        // Without an innovation nothing was compared.
        let compared = matches!(record.outcome, 0 | 1) && record.variance > 0.0;
        let square = if compared { record.innovation.powi(2) / record.variance } else { 0.0 };
        if compared {
            self.scalars = (self.scalars + 1.0).min(REMEMBERED);
            self.mean_square += (square - self.mean_square) / self.scalars;
        }
        let fused = record.outcome == 0;
        if let Some(last) = self.last.back_mut().filter(|last| last.time_us == record.time_us) {
            last.sigmas = last.sigmas.max(square.sqrt());
            return None;
        }
        if self.last.len() == MEASUREMENTS {
            self.last.pop_front();
        }
        self.last.push_back(Measurement { time_us: record.time_us, sigmas: square.sqrt(), fused });
        if fused {
            self.fused += 1;
            let row = std::mem::take(&mut self.in_a_row);
            return (row > 0).then_some(Turn::FusedAgain(row));
        }
        self.rejected += 1;
        self.in_a_row += 1;
        (self.in_a_row == 1).then(|| Turn::Rejected(square.sqrt()))
    }

    /// Since its last measurement, s.
    pub fn age_s(&self, board_us: u64) -> Option<f64> {
        self.last.back().map(|last| board_us.saturating_sub(last.time_us) as f64 * 1e-6)
    }

    /// Mean time between its measurements, s.
    pub fn interval_s(&self) -> Option<f64> {
        let (first, last) = (self.last.front()?, self.last.back()?);
        let intervals = self.last.len().checked_sub(1).filter(|count| *count > 0)?;
        Some(last.time_us.saturating_sub(first.time_us) as f64 * 1e-6 / intervals as f64)
    }

    /// Measurements a second; of one that has fallen silent, ever fewer.
    pub fn rate_hz(&self, board_us: u64) -> Option<f64> {
        let interval_s = self.interval_s().filter(|s| *s > 0.0)?;
        let count = self.last.len() as f64 - 1.0;
        let overdue_s = (self.age_s(board_us)? - interval_s).max(0.0);
        Some(count / (count * interval_s + overdue_s))
    }

    /// The largest innovation of the last second, or the last one, in its own sigmas, and whether it was fused.
    pub fn worst(&self, board_us: u64) -> Option<(f64, bool)> {
        let last = self.last.back()?;
        let recent = self.last.iter().filter(|m| m.time_us + SHOWN_US >= board_us);
        let worst = recent.fold(*last, |worst, m| if m.sigmas > worst.sigmas { *m } else { worst });
        Some((worst.sigmas, worst.fused))
    }

    /// √mean(innovation² / variance) of the last hundred or so; 1 where the filter's covariance is right.
    pub fn rms_sigmas(&self) -> Option<f64> {
        (self.scalars > 0.0).then(|| self.mean_square.sqrt())
    }
}

/// All sensors that were heard.
#[derive(Default)]
pub struct Sources(Vec<SourceHistory>);

impl Sources {
    /// Takes a fusion; what it changed.
    pub fn note(&mut self, record: &FusionTelemetry) -> Option<(Sensor, Turn)> {
        let sensor = *Sensor::ALL.get(usize::from(record.sensor))?;
        let at = self.0.partition_point(|source| (source.sensor as u8) < sensor as u8);
        if self.0.get(at).is_none_or(|source| source.sensor != sensor) {
            self.0.insert(at, SourceHistory::new(sensor));
        }
        self.0[at].note(record).map(|turn| (sensor, turn))
    }

    /// In the order of the filter's list.
    pub fn iter(&self) -> impl Iterator<Item = &SourceHistory> {
        self.0.iter()
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// The board started again: its time has, too.
    pub fn forget(&mut self) {
        self.0.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fusion(time_us: u64, axis: u8, innovation: f64, outcome: u8) -> FusionTelemetry {
        FusionTelemetry { sensor: Sensor::Attitude as u8, axis, outcome, time_us, innovation, variance: 4.0 }
    }

    #[test]
    fn axes_of_one_instant_are_one_measurement() {
        let mut sources = Sources::default();
        for i in 0..30 {
            for axis in 0..3 {
                assert_eq!(sources.note(&fusion(i * 100_000, axis, f64::from(axis) * 2.0, 0)), None);
            }
        }
        let source = sources.iter().next().unwrap();
        assert_eq!((source.fused, source.rejected), (30, 0));
        assert_eq!(source.worst(2_900_000), Some((2.0, true)));
        // (0² + 1² + 2²) / 3
        assert!((source.rms_sigmas().unwrap().powi(2) - 5.0 / 3.0).abs() < 0.05, "of the last hundred");
        let rate_hz = |board_us| source.rate_hz(board_us).unwrap();
        assert!((rate_hz(2_900_000) - 10.0).abs() < 1e-9 && (rate_hz(2_950_000) - 10.0).abs() < 1e-9);
        // 20 intervals in 2 s, then nothing for 10 s
        assert!((rate_hz(12_900_000) - 20.0 / 11.9).abs() < 1e-9, "{}", rate_hz(12_900_000));
        assert_eq!(source.age_s(12_900_000), Some(10.0));
    }

    #[test]
    fn rows_of_rejections_are_told_at_both_ends() {
        let mut sources = Sources::default();
        let mut turns = Vec::new();
        for (time_us, innovation, outcome) in [(1, 1.0, 0), (2, 20.0, 1), (3, 22.0, 1), (4, 24.0, 1), (5, 1.0, 0)] {
            turns.extend(sources.note(&fusion(time_us, 0, innovation, outcome)));
        }
        let attitude = |turn| (Sensor::Attitude, turn);
        assert_eq!(turns, [attitude(Turn::Rejected(10.0)), attitude(Turn::FusedAgain(3))]);
        let source = sources.iter().next().unwrap();
        assert_eq!((source.fused, source.rejected, source.in_a_row), (2, 3, 0));
        assert_eq!(source.worst(5), Some((12.0, false)));
    }

    #[test]
    fn sensors_of_a_newer_board_are_passed_over() {
        let mut sources = Sources::default();
        assert_eq!(sources.note(&FusionTelemetry { sensor: 99, ..fusion(1, 0, 1.0, 0) }), None);
        assert_eq!(sources.len(), 0);
    }
}
