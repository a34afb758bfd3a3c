//! The vehicle's 6-DOF equations of motion (3.2)-(3.24), corrected.

mod parameters;

pub use parameters::{FinGeometry, ParameterError, VehicleParameters};

use crate::state::VehicleState;
use nalgebra::{SMatrix, Vector3, Vector6};

/// Number of fins; their order everywhere is top, bottom, port, starboard.
pub const FINS: usize = 4;

/// ξ: what the actuators do at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ActuatorInput {
    /// Propeller speed ω, rad/s (positive drives ahead).
    pub propeller_radps: f64,
    /// Fin angles δ [top, bottom, port, starboard], rad; +starboard: nose down, +port: nose up,
    /// +top: nose to starboard, +bottom: nose to port.
    pub fins_rad: [f64; FINS],
}

/// f and F = ∂f/∂x of the process model at one state.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(non_snake_case)]
pub struct Linearisation {
    /// ẋ = f(x, ξ).
    pub f: VehicleState,
    /// ∂f/∂x, 12 x 12.
    pub F: SMatrix<f64, 12, 12>,
}

/// The dynamics of one vehicle, built from validated parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct VehicleModel {
    parameters: VehicleParameters,
}

impl VehicleModel {
    /// Validates the parameters and precomputes what does not depend on the state.
    ///
    /// # Errors
    /// The first parameter that is not finite or outside its range.
    pub fn new(parameters: &VehicleParameters) -> Result<Self, ParameterError> {
        parameters.validate()?;
        Ok(Self { parameters: *parameters })
    }

    /// The parameters this model was built from.
    #[must_use]
    pub fn parameters(&self) -> &VehicleParameters {
        &self.parameters
    }

    /// Body acceleration v̇ = M⁻¹(…), m/s² and rad/s², of (3.2) corrected.
    #[must_use]
    pub fn acceleration(&self, _attitude: &Vector3<f64>, _v: &Vector6<f64>, _input: &ActuatorInput) -> Vector6<f64> {
        todo!()
    }

    /// ẋ = f(x, ξ) in still water.
    #[must_use]
    pub fn derivative(&self, _x: &VehicleState, _input: &ActuatorInput) -> VehicleState {
        todo!()
    }

    /// f and its analytic Jacobian F = ∂f/∂x in still water.
    #[must_use]
    pub fn linearise(&self, _x: &VehicleState, _input: &ActuatorInput) -> Linearisation {
        todo!()
    }
}
