//! `[backseat]`: how the backseat under test is configured.

use serde::Deserialize;

/// `[backseat]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Backseat {
    /// The app may fuse DVL velocities (it is simulated and logged either way).
    pub dvl: bool,
    /// Which law steers.
    pub control_law: ControlLaw,
    /// What is commanded.
    pub control_mode: ControlMode,
    /// Estimate a water current.
    pub current_state: bool,
}

/// Which law steers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ControlLaw {
    /// Linear-quadratic regulator.
    #[default]
    Lqr,
    /// Proportional-derivative with kappa guidance.
    Pd,
    /// Linear-quadratic regulator about the reference trajectory of 5.1, a forward simulation of model and PD.
    LqrOnReference,
}

/// What is commanded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ControlMode {
    /// Fins and motor directly (`$OMP`).
    #[default]
    Omp,
    /// Heading, depth and speed (`$OMS`).
    Oms,
}
