//! Is the filter as good as it says? Normalised innovations and errors squared.

use super::{FusionRecord, Sensor};

/// Sum of ν²/S of the fused scalars of one sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NisTally {
    /// Σ ν²/S over the fused scalars.
    pub sum: f64,
    /// Fused scalars: the degrees of freedom of `sum`.
    pub count: u32,
    /// Gated scalars.
    pub rejected: u32,
    /// Invalid scalars and stale clones.
    pub invalid: u32,
}

impl NisTally {
    /// Mean NIS, expected 1; `None` before the first fusion.
    #[must_use]
    pub fn mean(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / f64::from(self.count))
    }
}

/// The tallies of all sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Consistency {
    tallies: [NisTally; Sensor::ALL.len()],
}

impl Consistency {
    /// Empty.
    #[must_use]
    pub const fn new() -> Self {
        Self { tallies: [NisTally { sum: 0.0, count: 0, rejected: 0, invalid: 0 }; Sensor::ALL.len()] }
    }

    /// Adds one record.
    pub fn add(&mut self, _record: &FusionRecord) {
        todo!()
    }

    /// The tally of one sensor.
    #[must_use]
    pub fn tally(&self, sensor: Sensor) -> &NisTally {
        &self.tallies[sensor as usize]
    }
}
