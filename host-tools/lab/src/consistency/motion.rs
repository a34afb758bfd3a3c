//! The true equations of motion without their noise, and the coordinates in which the bound is taken.
//!
//! # Coordinates of the bound
//! The bound averages the curvature of log p(x_{k+1} | x_k) over the ensemble before anything is inverted. In the
//! filter's own coordinates ẋ = R(Θ) ν is noise-free, so that over a step dt its weight is of the order 1 / (q dt³),
//! and the least spread of headings over the ensemble looks like information about the velocity, without limit as dt
//! goes to zero. The bound stays valid but is far too low to be of use. In y = [p, Θ, R ν, Θ̇] position and attitude
//! are integrals of other coordinates, the noise-free equations are linear, and the effect does not arise.

use hil_sim::truth::{Actuators, Parameters, Plant, State, Water, runge_kutta_4};
use nalgebra::{DMatrix, DVector, Matrix3, SVector, Vector3};

/// Vehicle coordinates of the bound: position, Euler angles, velocity through the water in NED, Euler rates.
pub type Smooth = SVector<f64, 12>;

/// How the vehicle moves.
#[derive(Clone, Debug)]
pub enum Motion {
    /// The simulator's 6-DOF plant.
    Dynamic {
        /// As declared.
        parameters: Box<Parameters>,
        /// Its forces.
        plant: Box<Plant>,
    },
    /// Constant body velocity and rates.
    Kinematic,
}

impl Motion {
    /// The plant of a vehicle in unbounded water.
    #[must_use]
    pub fn dynamic(parameters: &Parameters) -> Self {
        let mut motion = Self::Dynamic { parameters: Box::new(*parameters), plant: Box::new(submerged(parameters)) };
        motion.set_drag(0.0);
        motion
    }

    /// Adds linear surge drag to what is declared, N s/m.
    pub fn set_drag(&mut self, ns_per_m: f64) {
        if let Self::Dynamic { parameters, plant } = self {
            let linear = parameters.linear_surge_ns_per_m + ns_per_m;
            **plant = submerged(&Parameters { linear_surge_ns_per_m: linear, ..**parameters });
        }
    }

    /// One step with accelerations that are held over it.
    #[must_use]
    pub fn step(&self, state: &State, actuators: &Actuators, water: &Water, noise: &[f64; 6], step_s: f64) -> State {
        runge_kutta_4(state, step_s, |state| match self {
            Self::Dynamic { plant, .. } => plant.derivative(state, actuators, water, noise),
            Self::Kinematic => coasting(state, water, noise),
        })
    }

    /// One step of the coordinates of the bound, without noise and in water at rest.
    #[must_use]
    pub fn smooth_step(&self, y: &Smooth, actuators: &Actuators, step_s: f64) -> Smooth {
        /// Longest step of the integrator, s.
        const LONGEST_S: f64 = 0.05;
        let steps = (step_s / LONGEST_S).ceil().max(1.0);
        let mut state = from_smooth(y);
        for _ in 0..steps as usize {
            state = self.step(&state, actuators, &Water::default(), &[0.0; 6], step_s / steps);
        }
        to_smooth(&state)
    }

    /// ∂y(t + step)/∂y(t) by central differences; `drag` as a last column where it is a state.
    #[must_use]
    pub fn transition(&self, y: &Smooth, actuators: &Actuators, step_s: f64, drag: Option<f64>) -> DMatrix<f64> {
        /// Differences: (cube root of the rounding) times the size of each coordinate.
        const STEP: f64 = 1.0e-5;
        let mut out = DMatrix::identity(12, 12 + usize::from(drag.is_some()));
        let slope = |above: &Smooth, below: &Smooth| {
            let mut slope = (above - below) / (2.0 * STEP);
            for i in 3..6 {
                slope[i] = libm::remainder(above[i] - below[i], std::f64::consts::TAU) / (2.0 * STEP);
            }
            slope
        };
        // In unbounded water nothing depends on the position.
        for column in 3..12 {
            let shift = Smooth::ith(column, STEP);
            let moved = slope(
                &self.smooth_step(&(y + shift), actuators, step_s),
                &self.smooth_step(&(y - shift), actuators, step_s),
            );
            out.fixed_view_mut::<12, 1>(0, column).copy_from(&moved);
        }
        if let Some(drag) = drag {
            let with = |drag: f64| {
                let mut motion = self.clone();
                motion.set_drag(drag);
                motion.smooth_step(y, actuators, step_s)
            };
            out.fixed_view_mut::<12, 1>(0, 12).copy_from(&slope(&with(drag + STEP), &with(drag - STEP)));
        }
        out
    }
}

fn submerged(parameters: &Parameters) -> Plant {
    Plant::with(parameters, &hil_sim::truth::Undeclared { no_surface: true, ..hil_sim::truth::Undeclared::default() })
}

/// Body velocity and rates stay.
fn coasting(state: &State, water: &Water, noise: &[f64; 6]) -> State {
    let [_, _, _, a, b, c, d, _, _, _, p, q, r] = state.0;
    let [x, y, z] = state.velocity_ned_mps(water);
    let [n1, n2, n3, n4, n5, n6] = *noise;
    State([
        x,
        y,
        z,
        -0.5 * (b * p + c * q + d * r),
        0.5 * (a * p + c * r - d * q),
        0.5 * (a * q + d * p - b * r),
        0.5 * (a * r + b * q - c * p),
        n1,
        n2,
        n3,
        n4,
        n5,
        n6,
    ])
}

/// R, body to NED.
pub(super) fn rotation(euler: &Vector3<f64>) -> Matrix3<f64> {
    let state = State::new([0.0; 3], (*euler).into(), [0.0; 3], [0.0; 3]);
    let m = state.body_to_ned();
    Matrix3::from_fn(|i, j| m[i][j])
}

/// E: body rates of Euler rates, ω = E(Θ) Θ̇.
pub(super) fn rates_by_euler_rates(euler: &Vector3<f64>) -> Matrix3<f64> {
    let ((sr, cr), (sp, cp)) = (libm::sincos(euler.x), libm::sincos(euler.y));
    Matrix3::new(1.0, 0.0, -sp, 0.0, cr, sr * cp, 0.0, -sr, cr * cp)
}

pub(super) fn from_smooth(y: &Smooth) -> State {
    let part = |at: usize| Vector3::new(y[at], y[at + 1], y[at + 2]);
    let euler = part(3);
    let nu = rotation(&euler).tr_mul(&part(6));
    let omega = rates_by_euler_rates(&euler) * part(9);
    State::new(part(0).into(), euler.into(), nu.into(), omega.into())
}

pub(super) fn to_smooth(state: &State) -> Smooth {
    let euler = Vector3::from(state.euler_rad());
    let ned = Vector3::from(state.velocity_ned_mps(&Water::default()));
    let omega = Vector3::from(state.rates_radps());
    let turning = rates_by_euler_rates(&euler).try_inverse().map_or(omega, |inverse| inverse * omega);
    let mut y = Smooth::zeros();
    for (at, part) in [(0, Vector3::from(state.position_m())), (3, euler), (6, ned), (9, turning)] {
        y.fixed_rows_mut::<3>(at).copy_from(&part);
    }
    y
}

/// How accelerations in body axes enter the coordinates' rates: R into the velocities, E⁻¹ into the Euler rates.
pub(super) fn noise_input(y: &Smooth) -> DMatrix<f64> {
    let euler = Vector3::new(y[3], y[4], y[5]);
    let mut input = DMatrix::zeros(12, 6);
    input.fixed_view_mut::<3, 3>(6, 0).copy_from(&rotation(&euler));
    let turning = rates_by_euler_rates(&euler).try_inverse().unwrap_or_else(Matrix3::identity);
    input.fixed_view_mut::<3, 3>(9, 3).copy_from(&turning);
    input
}

/// ∂h/∂y by central differences.
pub(super) fn gradient(h: impl Fn(&DVector<f64>) -> DVector<f64>, y: &DVector<f64>, columns: &[usize]) -> DMatrix<f64> {
    const STEP: f64 = 1.0e-5;
    let rows = h(y).len();
    let mut out = DMatrix::zeros(rows, y.len());
    let mut at = y.clone();
    for &column in columns {
        at[column] = y[column] + STEP;
        let above = h(&at);
        at[column] = y[column] - STEP;
        out.set_column(column, &((above - h(&at)) / (2.0 * STEP)));
        at[column] = y[column];
    }
    out
}
