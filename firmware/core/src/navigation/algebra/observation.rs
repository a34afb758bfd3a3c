//! Input of the measurement update: ν, h and R of one to three scalars.

use super::row::Row;
use crate::navigation::interface::measurement::FusionOutcome;

/// One scalar z = h(x) + v.
#[derive(Clone)]
pub(crate) struct Observation {
    /// ν = z − h(x̂).
    pub(crate) innovation: f64,
    /// ∂h/∂x.
    pub(crate) row: Row,
    /// R, variance of v.
    pub(crate) variance: f64,
}

impl Observation {
    const NONE: Self = Self { innovation: 0.0, row: Row::EMPTY, variance: 0.0 };

    /// Innovation and noise are finite, and the noise is positive.
    pub(crate) fn is_valid(&self) -> bool {
        self.innovation.is_finite() && self.variance.is_finite() && self.variance > 0.0
    }
}

/// The independent scalars of one measurement, filled in place: half a kilobyte is not worth moving.
#[derive(Clone)]
pub(crate) struct Observations {
    items: [Observation; 3],
    len: usize,
}

impl Observations {
    pub(crate) const fn new() -> Self {
        Self { items: [const { Observation::NONE }; 3], len: 0 }
    }

    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }

    /// Appends a scalar with an empty row.
    pub(crate) fn add(&mut self, innovation: f64, variance: f64) -> &mut Observation {
        let place = self.len.min(2);
        self.len = place + 1;
        let item = &mut self.items[place];
        item.innovation = innovation;
        item.variance = variance;
        item.row.clear();
        item
    }

    /// Appends a scalar that measures state `index` itself.
    pub(crate) fn add_direct(&mut self, index: usize, innovation: f64, variance: f64) {
        self.add(innovation, variance).row.push(index, 1.0);
    }

    /// ν of one scalar.
    pub(crate) fn innovation(&self, axis: usize) -> f64 {
        self.as_slice().get(axis).map_or(f64::NAN, |item| item.innovation)
    }

    pub(crate) fn as_slice(&self) -> &[Observation] {
        self.items.get(..self.len).unwrap_or_default()
    }

    pub(crate) fn as_mut_slice(&mut self) -> &mut [Observation] {
        self.items.get_mut(..self.len).unwrap_or_default()
    }
}

/// Why a measurement has no innovation.
pub(crate) type Refused = FusionOutcome;
