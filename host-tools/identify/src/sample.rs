//! One instant of a log.

use backseat_core::dynamics::ActuatorInput;
use nalgebra::{Vector3, Vector6};

/// Time between samples, s.
pub const PERIOD_S: f64 = 0.1;

/// All channels at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time, µs.
    pub time_us: u64,
    /// Roll, pitch, heading, rad.
    pub attitude: Vector3<f64>,
    /// u, v, w through the water and p, q, r, m/s and rad/s.
    pub velocity: Vector6<f64>,
    /// What fins and propeller do from this instant until the next sample.
    pub input: ActuatorInput,
}
