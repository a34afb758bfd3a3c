//! Is the filter consistent? Normalised squares of innovations and errors.

use crate::navigation::interface::measurement::{FusionOutcome, FusionRecord, Sensor};
use crate::state::VehicleState;
use nalgebra::SMatrix;

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
    /// Range rates while the position was too uncertain for them.
    pub position_uncertain: u32,
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
        Self {
            tallies: [NisTally { sum: 0.0, count: 0, rejected: 0, invalid: 0, position_uncertain: 0 };
                Sensor::ALL.len()],
        }
    }

    /// Adds one record.
    pub fn add(&mut self, record: &FusionRecord) {
        let tally = &mut self.tallies[record.sensor as usize];
        match record.outcome {
            FusionOutcome::Fused => {
                tally.sum += record.nis();
                tally.count = tally.count.saturating_add(1);
            }
            FusionOutcome::Gated => tally.rejected = tally.rejected.saturating_add(1),
            FusionOutcome::Invalid | FusionOutcome::StaleClone => tally.invalid = tally.invalid.saturating_add(1),
            FusionOutcome::Redundant => {}
            FusionOutcome::PositionUncertain => tally.position_uncertain = tally.position_uncertain.saturating_add(1),
        }
    }

    /// The tally of one sensor.
    #[must_use]
    pub fn tally(&self, sensor: Sensor) -> &NisTally {
        &self.tallies[sensor as usize]
    }
}

/// eᵀ P⁻¹ e of the vehicle's twelve states, expected 12; `None` when P is not positive definite.
/// The heading's error must be the shorter way round.
#[must_use]
#[allow(non_snake_case)]
pub fn nees_vehicle(error: &VehicleState, P: &SMatrix<f64, 12, 12>) -> Option<f64> {
    P.cholesky().map(|factor| error.dot(&factor.solve(error)))
}

/// eᵀ P⁻¹ e of north and east, expected 2; `None` when P is not positive definite.
#[must_use]
pub fn nees_position(error_m: [f64; 2], var_x: f64, cov_xy: f64, var_y: f64) -> Option<f64> {
    let determinant = var_x * var_y - cov_xy * cov_xy;
    let [x, y] = error_m;
    (var_x > 0.0 && determinant > 0.0).then(|| (var_y * x * x - 2.0 * cov_xy * x * y + var_x * y * y) / determinant)
}
