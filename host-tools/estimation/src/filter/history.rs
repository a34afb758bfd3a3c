//! Every fusion of a log. A long one has tens of millions of scalars: what those of one measurement share is kept once.

use backseat_core::navigation::{FusionOutcome, FusionRecord, Sensor};

/// One scalar of a measurement, as the filter met it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FusedScalar {
    /// Which sensor.
    pub sensor: Sensor,
    /// Which component of it (0 = x, roll, u…).
    pub axis: u8,
    /// Filter time, µs.
    pub time_us: u64,
    /// z − h(x), in the sensor's unit.
    pub innovation: f64,
    /// S = H P Hᵀ + R, unit squared.
    pub variance: f64,
    /// Used or why not.
    pub outcome: FusionOutcome,
}

impl FusedScalar {
    /// Normalised innovation squared ν²/S.
    pub fn nis(&self) -> f64 {
        self.innovation * self.innovation / self.variance
    }
}

/// Consecutive axes of one sensor, time and outcome.
#[derive(Clone, Copy, Debug)]
struct Group {
    time_us: u64,
    sensor: Sensor,
    first_axis: u8,
    count: u8,
    outcome: FusionOutcome,
}

/// All fusions, in order.
#[derive(Clone, Debug, Default)]
pub struct FusionHistory {
    groups: Vec<Group>,
    /// Innovation and variance of each scalar.
    numbers: Vec<[f64; 2]>,
}

impl FusionHistory {
    /// Adds a record.
    pub fn push(&mut self, record: &FusionRecord) {
        let &FusionRecord { sensor, axis, time_us, innovation, variance, outcome, .. } = record;
        self.numbers.push([innovation, variance]);
        let goes_on = |group: &&mut Group| {
            (group.time_us, group.sensor, group.outcome) == (time_us, sensor, outcome)
                && group.first_axis.checked_add(group.count) == Some(axis)
        };
        match self.groups.last_mut().filter(goes_on) {
            Some(group) => group.count += 1,
            None => self.groups.push(Group { time_us, sensor, first_axis: axis, count: 1, outcome }),
        }
    }

    /// The scalars, in the order in which they were fused.
    pub fn iter(&self) -> impl Iterator<Item = FusedScalar> + '_ {
        let axes = self.groups.iter().flat_map(|group| (0..group.count).map(move |place| (group, place)));
        axes.zip(&self.numbers).map(|((group, place), &[innovation, variance])| FusedScalar {
            sensor: group.sensor,
            axis: group.first_axis + place,
            time_us: group.time_us,
            innovation,
            variance,
            outcome: group.outcome,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_in_comes_out() {
        let record = |time_us, sensor, axis, outcome| FusionRecord {
            sensor,
            axis,
            time_us,
            innovation: f64::from(axis) + 0.1,
            variance: time_us as f64,
            test_ratio: 0.5,
            outcome,
        };
        let (fused, gated) = (FusionOutcome::Fused, FusionOutcome::Gated);
        let records = [
            record(1, Sensor::Depth, 0, fused),
            record(1, Sensor::Attitude, 0, fused),
            record(1, Sensor::Attitude, 1, fused),
            record(1, Sensor::Attitude, 2, gated),
            record(2, Sensor::VehicleGnss, 1, fused),
            record(2, Sensor::VehicleGnss, 0, fused),
            record(2, Sensor::VehicleGnss, 1, fused),
            record(2, Sensor::VehicleGnss, 0, fused),
        ];
        let mut history = FusionHistory::default();
        records.iter().for_each(|record| history.push(record));
        assert_eq!(history.groups.len(), 6, "{history:?}");
        let found: Vec<_> = history.iter().map(|f| (f.time_us, f.sensor, f.axis, f.outcome, f.nis())).collect();
        let expected = records.map(|r| (r.time_us, r.sensor, r.axis, r.outcome, r.nis()));
        assert_eq!(found, expected);
    }
}
