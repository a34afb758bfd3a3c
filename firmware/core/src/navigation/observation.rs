//! What an aiding source hands to the update: ν, h and R of one to three scalars.

use super::FusionOutcome;
use super::row::Row;

/// One scalar z = h(x) + v.
#[derive(Clone, Copy)]
pub(super) struct Observation {
    /// ν = z − h(x̂).
    pub(super) innovation: f64,
    /// ∂h/∂x.
    pub(super) row: Row,
    /// R, variance of v.
    pub(super) variance: f64,
}

impl Observation {
    pub(super) const NONE: Self = Self { innovation: 0.0, row: Row::EMPTY, variance: 0.0 };

    /// Innovation and noise are numbers that an update can bear.
    pub(super) fn is_valid(&self) -> bool {
        self.innovation.is_finite() && self.variance.is_finite() && self.variance > 0.0
    }
}

/// The independent scalars of one measurement.
pub(super) struct Observations {
    pub(super) items: [Observation; 3],
    pub(super) len: usize,
}

impl Observations {
    pub(super) fn new<const K: usize>(items: [Observation; K]) -> Self {
        let mut all = Self { items: [Observation::NONE; 3], len: K.min(3) };
        for (place, item) in all.items.iter_mut().zip(items) {
            *place = item;
        }
        all
    }

    pub(super) fn as_slice(&self) -> &[Observation] {
        self.items.get(..self.len).unwrap_or(&self.items)
    }
}

/// A measurement that has no innovation, and why.
pub(super) type Refused = FusionOutcome;
