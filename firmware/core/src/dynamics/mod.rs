//! The vehicle's 6-DOF equations of motion (3.2)-(3.24), corrected.
//!
//! M v̇ = −ad(v) M v − D(v) v + [w s; B x s] + Σ fin wrenches + [T 0 0 −arm T 0 0]ᵀ
//!
//! Every velocity here is relative to the water. A steady current c moves the vehicle over ground by
//! ṗ = R ν + c and changes no force: the model is Galilean-invariant, so attitude and body velocity are
//! the same in still and in steadily moving water. A current that changes in time or space accelerates the
//! water itself, which this model leaves out.
//!
//! Zero speed, a fin without inflow and a vertical vehicle give finite values; a NaN in gives NaN out.

mod coriolis;
mod drag;
mod fins;
mod kinematics;
mod linearisation;
mod propeller;
mod restoring;

pub use crate::parameters::{FINS, FinGeometry, ParameterError, VehicleParameters, cross_drag_limit};
pub use coriolis::{coriolis, coriolis_by_velocity};
pub use drag::drag;
pub use kinematics::{Attitude, MIN_COS_PITCH, kinematic_linearise};
pub use linearisation::Linearisation;
pub use propeller::Propeller;
pub use restoring::Restoring;

use crate::state::{self, U, VehicleState};
use fins::{FREE, Fin, FinSection};
use nalgebra::{Matrix6x2, SMatrix, Vector3, Vector6};

/// Number of inputs: propeller, top, bottom, port, starboard.
pub const INPUTS: usize = 1 + FINS;

/// ξ: what the actuators do at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ActuatorInput {
    /// Propeller speed ω, rad/s (positive drives ahead).
    pub propeller_radps: f64,
    /// Fin angles δ [top, bottom, port, starboard], rad; +starboard: nose down, +port: nose up,
    /// +top: nose to starboard, +bottom: nose to port.
    pub fins_rad: [f64; FINS],
}

/// The dynamics of one vehicle, built from validated parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct VehicleModel {
    parameters: VehicleParameters,
    inverse_mass: Vector6<f64>,
    restoring: Restoring,
    propeller: Propeller,
    section: FinSection,
    fins: [Fin; FINS],
}

impl VehicleModel {
    /// Validates the parameters and precomputes what does not depend on the state.
    ///
    /// # Errors
    /// The first parameter that is not finite or outside its range.
    pub fn new(parameters: &VehicleParameters) -> Result<Self, ParameterError> {
        parameters.validate()?;
        Ok(Self::of(parameters))
    }

    /// The same of a vehicle with effects, which may take more linear drag or advance away than was declared.
    ///
    /// # Errors
    /// As of [`Self::new`].
    pub fn with_effects(parameters: &VehicleParameters) -> Result<Self, ParameterError> {
        parameters.validate_with_effects()?;
        Ok(Self::of(parameters))
    }

    fn of(parameters: &VehicleParameters) -> Self {
        Self {
            parameters: *parameters,
            inverse_mass: Vector6::from(parameters.m_diag.map(|m| 1.0 / m)),
            restoring: Restoring::new(parameters),
            propeller: Propeller::new(parameters),
            section: FinSection::new(parameters),
            fins: parameters.fins.each_ref().map(Fin::new),
        }
    }

    /// Takes over plant parameters that differ in anything but the fins' places; unchecked.
    pub(crate) fn retune(&mut self, parameters: &VehicleParameters) {
        self.parameters = *parameters;
        self.inverse_mass = Vector6::from(parameters.m_diag.map(|m| 1.0 / m));
        self.restoring = Restoring::new(parameters);
        self.propeller = Propeller::new(parameters);
        self.section = FinSection::new(parameters);
    }

    /// Gives the fins [top, bottom, port, starboard] these shares of the lift and drag that the parameters say: 1 for a
    /// whole fin, 0 for a lost one. Values outside 0 to 2, and NaN, count as 1.
    pub fn set_fin_effectiveness(&mut self, shares: &[f64; FINS]) {
        for (fin, &share) in self.fins.iter_mut().zip(shares) {
            fin.effectiveness = if (0.0..=2.0).contains(&share) { share } else { 1.0 };
        }
    }

    /// Shares of lift and drag that the fins have; 1 each unless set.
    #[must_use]
    pub fn fin_effectiveness(&self) -> [f64; FINS] {
        self.fins.each_ref().map(|fin| fin.effectiveness)
    }

    /// Fins [top, bottom, port, starboard] that stand at an angle whatever is commanded, rad.
    pub fn set_standing_fins(&mut self, stands_rad: &[Option<f64>; FINS]) {
        for (fin, stands_rad) in self.fins.iter_mut().zip(stands_rad) {
            fin.stands_rad = stands_rad.filter(|angle| angle.is_finite()).unwrap_or(FREE);
        }
    }

    /// The angles at which fins stand, rad; none unless set.
    #[must_use]
    pub fn standing_fins(&self) -> [Option<f64>; FINS] {
        self.fins.each_ref().map(|fin| Some(fin.stands_rad).filter(|angle| *angle != FREE))
    }

    /// M⁻¹ times a wrench, m/s² and rad/s².
    pub(crate) fn acceleration_of(&self, wrench: &Vector6<f64>) -> Vector6<f64> {
        wrench.component_mul(&self.inverse_mass)
    }

    /// The parameters this model was built from.
    #[must_use]
    pub fn parameters(&self) -> &VehicleParameters {
        &self.parameters
    }

    /// Weight and buoyancy.
    #[must_use]
    pub fn restoring(&self) -> &Restoring {
        &self.restoring
    }

    /// Thrust along body x.
    #[must_use]
    pub fn propeller(&self) -> &Propeller {
        &self.propeller
    }

    /// ad(v) M v (3.8), on the left of the equation of motion: N and N m.
    #[must_use]
    pub fn coriolis(&self, v: &Vector6<f64>) -> Vector6<f64> {
        coriolis(&self.parameters.m_diag, v)
    }

    /// D(v) v, on the left of the equation of motion (opposes motion): N and N m.
    #[must_use]
    pub fn drag(&self, v: &Vector6<f64>) -> Vector6<f64> {
        drag(&self.parameters, v)
    }

    /// Wrench of each fin at the centre of gravity, order of [`ActuatorInput::fins_rad`]: N and N m.
    #[must_use]
    pub fn fin_wrenches(&self, v: &Vector6<f64>, fins_rad: &[f64; FINS]) -> [Vector6<f64>; FINS] {
        let mut wrenches = [Vector6::zeros(); FINS];
        for ((wrench, fin), &delta) in wrenches.iter_mut().zip(&self.fins).zip(fins_rad) {
            *wrench = fin.wrench(&self.section, v, delta);
        }
        wrenches
    }

    /// G_a(v, ξ) of (4.37): the actuators' wrench per unit of β1…β5, so that G_a β is the sum of all
    /// fin wrenches and the thrust without advance.
    #[must_use]
    pub fn actuator_regressor(&self, v: &Vector6<f64>, input: &ActuatorInput) -> SMatrix<f64, 6, 5> {
        let mut columns = SMatrix::zeros();
        for (fin, &delta) in self.fins.iter().zip(&input.fins_rad) {
            fin.add_regressor(&self.section, v, delta, &mut columns);
        }
        columns[(0, 4)] = input.propeller_radps * input.propeller_radps.abs();
        columns[(3, 4)] = -self.propeller.torque_arm * columns[(0, 4)];
        columns
    }

    /// ∂wrench/∂δ of each fin, order of [`ActuatorInput::fins_rad`]: N and N m per rad.
    pub(crate) fn fin_wrenches_by_delta(&self, v: &Vector6<f64>, fins_rad: &[f64; FINS]) -> [Vector6<f64>; FINS] {
        let mut wrenches = [Vector6::zeros(); FINS];
        for ((wrench, fin), &delta) in wrenches.iter_mut().zip(&self.fins).zip(fins_rad) {
            *wrench = fin.wrench_by_delta(&self.section, v, delta);
        }
        wrenches
    }

    /// ∂(actuator wrench)/∂ξ, ξ = [propeller, top, bottom, port, starboard]: N and N m per rad/s or rad.
    #[must_use]
    pub fn wrench_by_input(&self, v: &Vector6<f64>, input: &ActuatorInput) -> SMatrix<f64, 6, INPUTS> {
        let mut jacobian = SMatrix::<f64, 6, INPUTS>::zeros();
        jacobian[(0, 0)] = self.propeller.thrust_by_speed(input.propeller_radps, v[0]);
        jacobian[(3, 0)] = -self.propeller.torque_arm * jacobian[(0, 0)];
        for (i, (fin, &delta)) in self.fins.iter().zip(&input.fins_rad).enumerate() {
            jacobian.set_column(1 + i, &fin.wrench_by_delta(&self.section, v, delta));
        }
        jacobian
    }

    /// ∂f/∂ξ, 12 x 5, ξ = [propeller, top, bottom, port, starboard]; only the acceleration rows are not zero.
    #[must_use]
    pub fn input_jacobian(&self, x: &VehicleState, input: &ActuatorInput) -> SMatrix<f64, 12, INPUTS> {
        let wrench = self.wrench_by_input(&state::velocity(x), input);
        let mut jacobian = SMatrix::<f64, 12, INPUTS>::zeros();
        for column in 0..INPUTS {
            for row in 0..6 {
                jacobian[(U + row, column)] = self.inverse_mass[row] * wrench[(row, column)];
            }
        }
        jacobian
    }

    /// Body acceleration v̇ = M⁻¹(…), m/s² and rad/s², of (3.2) corrected.
    #[must_use]
    pub fn acceleration(&self, attitude: &Vector3<f64>, v: &Vector6<f64>, input: &ActuatorInput) -> Vector6<f64> {
        self.acceleration_at(&Attitude::new(attitude), v, input)
    }

    fn acceleration_at(&self, attitude: &Attitude, v: &Vector6<f64>, input: &ActuatorInput) -> Vector6<f64> {
        let mut wrench = self.restoring.wrench(&attitude.down()) - self.coriolis(v) - self.drag(v);
        self.add_thrust(input, v, &mut wrench);
        for (fin, &delta) in self.fins.iter().zip(&input.fins_rad) {
            wrench += fin.wrench(&self.section, v, delta);
        }
        wrench.component_mul(&self.inverse_mass)
    }

    /// Thrust, and the torque that it costs.
    fn add_thrust(&self, input: &ActuatorInput, v: &Vector6<f64>, wrench: &mut Vector6<f64>) {
        let thrust = self.propeller.thrust(input.propeller_radps, v[0]);
        wrench[0] += thrust;
        wrench[3] -= self.propeller.torque_arm * thrust;
    }

    /// ẋ = f(x, ξ) in still water.
    #[must_use]
    pub fn derivative(&self, x: &VehicleState, input: &ActuatorInput) -> VehicleState {
        let attitude = Attitude::new(&state::attitude(x));
        let v = state::velocity(x);
        kinematics::state_derivative(
            &(attitude.rotation() * Vector3::new(v[0], v[1], v[2])),
            &(attitude.euler_rate_matrix() * Vector3::new(v[3], v[4], v[5])),
            &self.acceleration_at(&attitude, &v, input),
        )
    }

    /// f and its analytic Jacobian F = ∂f/∂x in still water.
    #[must_use]
    pub fn linearise(&self, x: &VehicleState, input: &ActuatorInput) -> Linearisation {
        let attitude = Attitude::new(&state::attitude(x));
        let v = state::velocity(x);

        let mut wrench = self.restoring.wrench(&attitude.down()) - self.coriolis(&v) - self.drag(&v);
        let mut by_velocity = -coriolis_by_velocity(&self.parameters.m_diag, &v);
        drag::subtract_drag_by_velocity(&self.parameters, &v, &mut by_velocity);
        self.add_thrust(input, &v, &mut wrench);
        let thrust_by_surge = self.propeller.thrust_by_surge(input.propeller_radps);
        by_velocity[(0, 0)] += thrust_by_surge;
        by_velocity[(3, 0)] -= self.propeller.torque_arm * thrust_by_surge;
        for (fin, &delta) in self.fins.iter().zip(&input.fins_rad) {
            fin.add_linearised(&self.section, &v, delta, &mut wrench, &mut by_velocity);
        }
        for mut column in by_velocity.column_iter_mut() {
            column.component_mul_assign(&self.inverse_mass);
        }

        let down = attitude.down_by_roll_pitch();
        let by_roll_pitch = Matrix6x2::from_columns(&[
            self.restoring.wrench(&down.column(0).into_owned()).component_mul(&self.inverse_mass),
            self.restoring.wrench(&down.column(1).into_owned()).component_mul(&self.inverse_mass),
        ]);
        let acceleration = wrench.component_mul(&self.inverse_mass);
        kinematics::linearise_with(&attitude, &v, &acceleration, by_roll_pitch, by_velocity)
    }
}
