//! Random numbers of an identification.

use backseat_core::dynamics::ActuatorInput;
use nalgebra::{Vector3, Vector6};

pub use crate::random::Random;
pub use crate::shared::{VEHICLE, assert_close, ident, input, matrix, model, number, numbers, state};

impl Random {
    pub fn velocity(&mut self) -> Vector6<f64> {
        Vector6::from([2.5, 0.6, 0.6, 1.0, 0.8, 0.8].map(|scale| self.within(scale)))
    }

    pub fn attitude(&mut self) -> Vector3<f64> {
        Vector3::from([3.0, 1.4, 3.0].map(|scale| self.within(scale)))
    }

    pub fn inputs(&mut self) -> ActuatorInput {
        ActuatorInput { propeller_radps: self.within(150.0), fins_rad: [(); 4].map(|()| self.within(0.5)) }
    }
}
