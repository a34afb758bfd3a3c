//! The Fisher information of a motion about θ: normal equations of the accelerations, scaled by the prior of each
//! parameter.

use crate::{Sample, parameters};
use backseat_core::dynamics::{Attitude, VehicleModel, VehicleParameters};
use backseat_core::identification::ACCELERATION_NOISE;
use backseat_core::identification::aid::{Instant, model_acceleration};
use backseat_core::identification::regressor::{Regressor, regressor};
use backseat_core::identification::theta::{M11, PARAMETERS, Theta, theta_of};
use nalgebra::SMatrix;

/// Parameters but the scale.
const UNKNOWN: usize = PARAMETERS - 1;
/// Behind m11, the scale, which is the first.
const FIRST: usize = M11 + 1;
/// Share of its size by which a parameter may be wrong before anything is measured.
const PRIOR: f64 = 0.3;

type Matrix = SMatrix<f64, UNKNOWN, UNKNOWN>;

/// Collects the information about one vehicle.
pub struct Information<'a> {
    model: &'a VehicleModel,
    theta: Theta,
    scale: [f64; PARAMETERS],
}

/// Information collected, in units of the prior.
#[derive(Clone)]
pub struct Collected(Box<Matrix>);

impl Default for Collected {
    fn default() -> Self {
        Self(Box::new(Matrix::identity()))
    }
}

impl<'a> Information<'a> {
    /// About the vehicle of this model, with priors from its declaration.
    pub fn new(model: &'a VehicleModel, declared: &VehicleParameters) -> Self {
        let scale = parameters::scale(declared);
        Self { model, theta: theta_of(declared), scale: core::array::from_fn(|j| PRIOR * scale[j]) }
    }

    /// Adds every fifth sample; one stands for half a second.
    pub fn add<'s>(&self, samples: impl Iterator<Item = &'s Sample>, to: &mut Collected) {
        let mut y = Regressor::zeros();
        for sample in samples.step_by(5) {
            let down = Attitude::new(&sample.attitude).down();
            let at = Instant::new(self.model, &sample.velocity, &down, &sample.input.mean());
            let acceleration = model_acceleration(&self.theta, &at);
            regressor(&acceleration, &sample.velocity, &down, &at.actuators, &mut y);
            for axis in 0..6 {
                let weight = 1.0 / (ACCELERATION_NOISE[axis] * self.model.parameters().m_diag[axis]);
                let row: [f64; UNKNOWN] = core::array::from_fn(|k| {
                    let j = FIRST + k;
                    y[(axis, j)] * self.scale[j] * weight
                });
                for i in 0..UNKNOWN {
                    if row[i] != 0.0 {
                        for j in 0..UNKNOWN {
                            to.0[(i, j)] += 0.5 * row[i] * row[j];
                        }
                    }
                }
            }
        }
    }
}

impl Collected {
    /// Logarithm of the determinant; a D-optimal design has the largest. 0: nothing is known beyond the prior.
    pub fn log_determinant(&self) -> f64 {
        self.0
            .cholesky()
            .map_or(f64::NEG_INFINITY, |factor| 2.0 * (0..UNKNOWN).map(|i| factor.l_dirty()[(i, i)].ln()).sum::<f64>())
    }

    /// Root mean square of the standard deviations that are left (Cramér-Rao), relative to each parameter's size, %.
    pub fn remaining_percent(&self) -> f64 {
        self.0.cholesky().map_or(f64::NAN, |factor| 100.0 * PRIOR * (factor.inverse().trace() / UNKNOWN as f64).sqrt())
    }
}
