//! The model running free, and its sensitivities to the parameters and to where it started.

use crate::parameters::{EXTENDED, extended};
use crate::sample::{PERIOD_S, PeriodInput, STEPS, Sample, mean};
use backseat_core::dynamics::{ActuatorInput, Attitude, VehicleModel};
use backseat_core::identification::regressor::{Regressor, regressor};
use backseat_core::state::{self, P, PHI, THETA, U, VehicleState, wrap_angle};
use backseat_logs::interrupt;
use nalgebra::{SMatrix, SVector, Vector6};

/// Number of outputs: roll, pitch, u, v, w, p, q, r. Position and heading feed nothing back.
pub const OUTPUTS: usize = 8;
/// Where the outputs stand in the state.
pub const OUTPUT_STATES: [usize; OUTPUTS] = [PHI, THETA, U, U + 1, U + 2, P, P + 1, P + 2];
/// Columns of the sensitivities: the parameters, then the outputs at the start.
pub const COLUMNS: usize = EXTENDED + OUTPUTS;

/// Roll, pitch, u, v, w, p, q, r.
pub type Output = SVector<f64, OUTPUTS>;
/// ∂(outputs)/∂(parameters, start).
pub type Sensitivity = SMatrix<f64, OUTPUTS, COLUMNS>;

/// The outputs of a state.
#[must_use]
pub fn output(x: &VehicleState) -> Output {
    Output::from(OUTPUT_STATES.map(|index| x[index]))
}

/// What was measured of the outputs.
#[must_use]
pub fn measured(sample: &Sample) -> Output {
    let (a, v) = (&sample.attitude, &sample.velocity);
    Output::from([a.x, a.y, v[0], v[1], v[2], v[3], v[4], v[5]])
}

/// A sample as a state at the origin.
#[must_use]
pub fn start(sample: &Sample) -> VehicleState {
    let mut x = VehicleState::zeros();
    x.fixed_rows_mut::<3>(PHI).copy_from(&sample.attitude);
    x.fixed_rows_mut::<6>(U).copy_from(&sample.velocity);
    x
}

/// A start whose outputs have moved.
#[must_use]
pub fn moved(start: &VehicleState, by: &Output) -> VehicleState {
    let mut moved = *start;
    for (index, value) in OUTPUT_STATES.iter().zip(by.iter()) {
        moved[*index] += value;
    }
    moved
}

/// Measured minus predicted, roll wrapped.
#[must_use]
pub fn residual(sample: &Sample, x: &VehicleState) -> Output {
    let mut residual = measured(sample) - output(x);
    residual[0] = wrap_angle(residual[0]);
    residual
}

/// One classical Runge-Kutta step; the inputs go in a straight line from the first to the second.
#[must_use]
pub fn runge_kutta(model: &VehicleModel, x: &VehicleState, [from, to]: &[ActuatorInput; 2], dt: f64) -> VehicleState {
    let middle = mean(from, to);
    let k1 = model.derivative(x, from);
    let k2 = model.derivative(&(x + k1 * (0.5 * dt)), &middle);
    let k3 = model.derivative(&(x + k2 * (0.5 * dt)), &middle);
    let k4 = model.derivative(&(x + k3 * dt), to);
    x + (k1 + (k2 + k3) * 2.0 + k4) * (dt / 6.0)
}

/// The states at the samples and, between them, at each half period; as many as [`half_steps`]. They stop being finite
/// where the model does.
#[must_use]
pub fn free_run(model: &VehicleModel, start: &VehicleState, samples: &[Sample]) -> Vec<VehicleState> {
    let mut states = Vec::with_capacity(half_steps(samples.len()));
    let mut x = *start;
    for (k, sample) in samples.iter().enumerate() {
        interrupt::check();
        states.push(x);
        if k + 1 == samples.len() {
            break;
        }
        for step in 0..STEPS {
            x = runge_kutta(model, &x, sample.input.step(step), PERIOD_S / STEPS as f64);
            if step + 1 < STEPS {
                states.push(x);
            }
        }
    }
    states
}

/// Number of instants of so many samples when the middle of each period counts too.
#[must_use]
pub const fn half_steps(samples: usize) -> usize {
    if samples == 0 { 0 } else { STEPS * (samples - 1) + 1 }
}

/// Adds a matrix (by columns) times a vector: written out, because the library's product of such sizes takes three
/// times as long.
fn add_product(matrix: &[[f64; OUTPUTS]], vector: &[f64], sum: &mut [f64; OUTPUTS]) {
    for (column, factor) in matrix.iter().zip(vector) {
        for (sum, element) in sum.iter_mut().zip(column) {
            *sum += element * factor;
        }
    }
}

/// State and sensitivity, moved together.
#[derive(Clone, Debug)]
pub struct Sensitive {
    /// State.
    pub state: VehicleState,
    /// ∂(outputs)/∂(parameters, start).
    pub sensitivity: Sensitivity,
    y: Regressor,
}

impl Sensitive {
    /// At the start.
    pub fn new(start: &VehicleState) -> Self {
        let mut sensitivity = Sensitivity::zeros();
        sensitivity.fixed_columns_mut::<OUTPUTS>(EXTENDED).fill_with_identity();
        Self { state: *start, sensitivity, y: Regressor::zeros() }
    }

    /// One period. The sensitivities move by the exponential of the Jacobian in the middle of each step.
    pub fn advance(&mut self, model: &VehicleModel, input: &PeriodInput) {
        interrupt::check();
        let dt = PERIOD_S / STEPS as f64;
        for step in 0..STEPS {
            let ends = input.step(step);
            let next = runge_kutta(model, &self.state, ends, dt);
            let middle = (self.state + next) * 0.5;
            let (by_output, by_parameter) = self.jacobians(model, &middle, &mean(&ends[0], &ends[1]));
            // G = ∫ exp(A t) dt to fourth order; Φ = I + A G.
            let a = by_output * dt;
            let one = SMatrix::<f64, OUTPUTS, OUTPUTS>::identity();
            let g = (one + a * (one + a * (one + a * 0.25) * (1.0 / 3.0)) * 0.5) * dt;
            let phi = one + by_output * g;
            let (phi, g) = (&phi.data.0, &g.data.0);
            for (column, target) in self.sensitivity.data.0.iter_mut().enumerate() {
                let mut moved = [0.0; OUTPUTS];
                add_product(phi, target, &mut moved);
                if let Some(forcing) = by_parameter.data.0.get(column) {
                    add_product(&g[2..], forcing, &mut moved);
                }
                *target = moved;
            }
            self.state = next;
        }
    }

    /// ∂ż/∂z, and the acceleration's derivative by the parameters.
    fn jacobians(
        &mut self,
        model: &VehicleModel,
        x: &VehicleState,
        input: &ActuatorInput,
    ) -> (SMatrix<f64, OUTPUTS, OUTPUTS>, SMatrix<f64, 6, EXTENDED>) {
        let linear = model.linearise(x, input);
        let mut by_output = SMatrix::<f64, OUTPUTS, OUTPUTS>::zeros();
        by_output.fixed_view_mut::<2, 2>(0, 0).copy_from(&linear.euler_by_roll_pitch.fixed_rows::<2>(0));
        by_output.fixed_view_mut::<2, 3>(0, 5).copy_from(&linear.euler_by_rates.fixed_rows::<2>(0));
        by_output.fixed_view_mut::<6, 2>(2, 0).copy_from(&linear.acceleration_by_roll_pitch);
        by_output.fixed_view_mut::<6, 6>(2, 2).copy_from(&linear.acceleration_by_velocity);

        let velocity = state::velocity(x);
        let down = Attitude::new(&state::attitude(x)).down();
        let acceleration: Vector6<f64> = linear.f.fixed_rows::<6>(U).into_owned();
        let actuators = model.actuator_regressor(&velocity, input);
        regressor(&acceleration, &velocity, &down, &actuators, &mut self.y);
        // Y θ = h, so that M δa = −Y δθ.
        let mut by_parameter = extended(&self.y, &velocity);
        for (axis, mass) in model.parameters().m_diag.iter().enumerate() {
            by_parameter.row_mut(axis).scale_mut(-1.0 / mass);
        }
        (by_output, by_parameter)
    }
}
