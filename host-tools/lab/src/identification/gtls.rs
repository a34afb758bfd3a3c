//! Generalised total least squares, the noise-whitened form of the thesis' nullspace method.
//!
//! It weights each axis by its own residual and takes out of Wᵀ W what sensor noise of known size puts into it:
//! (Wᵀ W − λ Σ) θ = 0, with λ = 1, or less where the noise is less than declared. It needs no hard filter against the
//! noise, and so distorts the motion less. Its rows are those of the intervals between samples, to fourth order: with
//! NBLS's central differences the rest that rolling leaves is larger than the noise, and weights and λ are those of a
//! noise that is not there. Linear drag and advance of the declared vehicle are left out.

use super::nullspace::{Filtered, filtered};
use backseat_core::dynamics::{ActuatorInput, Attitude, VehicleModel, VehicleParameters};
use backseat_core::identification::Theta;
use backseat_core::identification::aid::interval;
use backseat_core::identification::regressor::{Regressor, regressor};
use backseat_core::identification::theta::{M11, theta_of};
use backseat_identify::parameters::{self, D26, EXTENDED, Extended, ExtendedRegressor};
use backseat_identify::simulation::{self, Output};
use backseat_identify::{IdentificationData, IdentifyError, Options, PERIOD_S, smoothing};
use nalgebra::{DMatrix, DVector, Vector3, Vector6};

/// Cut-off of all signals, Hz.
const CUTOFF_HZ: f64 = 0.8;

/// One interval between filtered samples: its input and its ends, v, roll and pitch.
#[derive(Clone, Copy)]
struct Interval {
    acceleration: Vector6<f64>,
    velocity: [Vector6<f64>; 2],
    roll_pitch: [[f64; 2]; 2],
    input: ActuatorInput,
}

impl Interval {
    fn new(then: &Filtered, now: &Filtered) -> Self {
        Self {
            acceleration: (now.velocity - then.velocity) / PERIOD_S,
            velocity: [then.velocity, now.velocity],
            roll_pitch: [then.roll_pitch, now.roll_pitch],
            input: then.input,
        }
    }

    /// The rows of this interval, between whose ends `model` knows the way.
    fn rows(&self, model: &VehicleModel, theta: &Theta) -> ExtendedRegressor {
        let down = self.roll_pitch.map(|[roll, pitch]| Attitude::new(&Vector3::new(roll, pitch, 0.0)).down());
        let ends = [(&self.velocity[0], &down[0]), (&self.velocity[1], &down[1])];
        let mut rows = ExtendedRegressor::zeros();
        let mut y = Regressor::zeros();
        for at in interval(model, theta, ends, &self.input, PERIOD_S) {
            regressor(&self.acceleration, &at.velocity, &at.down, &at.actuators, &mut y);
            rows += parameters::extended(&y, &at.velocity) * 0.5;
        }
        rows
    }

    /// With an error (m/s, rad/s; m/s², rad/s²; rad) in one of fourteen directions.
    fn disturbed(&self, direction: usize, options: &Options, (value_gain, slope_gain): (f64, f64)) -> Self {
        let mut disturbed = *self;
        match direction {
            0..6 => {
                for velocity in &mut disturbed.velocity {
                    velocity[direction] += options.velocity_noise[direction] * value_gain;
                }
            }
            6..12 => disturbed.acceleration[direction - 6] += options.velocity_noise[direction - 6] * slope_gain,
            _ => {
                for angles in &mut disturbed.roll_pitch {
                    angles[direction - 12] += options.roll_pitch_noise_rad * value_gain;
                }
            }
        }
        disturbed
    }
}

/// Identifies the vehicle, its parameters inside the box of the options.
///
/// # Errors
/// If the prior is unusable or the data determine nothing.
pub fn gtls(
    data: &IdentificationData,
    prior: &VehicleParameters,
    options: &Options,
) -> Result<VehicleParameters, IdentifyError> {
    /// Rounds of the way between samples, by what the round before found.
    const PASSES: usize = 3;
    let mut values = parameters::of(prior);
    for _ in 0..PASSES {
        parameters::project(prior, options.box_ratio, &mut values);
        let model = VehicleModel::new(&parameters::with(prior, &values)).map_err(IdentifyError::Prior)?;
        values = whitened(data, prior, &model, options)?;
    }
    parameters::project(prior, options.box_ratio, &mut values);
    Ok(parameters::with(prior, &values))
}

/// One pass.
fn whitened(
    data: &IdentificationData,
    prior: &VehicleParameters,
    model: &VehicleModel,
    options: &Options,
) -> Result<Extended, IdentifyError> {
    /// Rounds of reweighting the axes by their residuals.
    const ROUNDS: usize = 4;
    let known = options.scale.parameter();
    let used: Vec<usize> = (0..EXTENDED).filter(|&j| options.cross_drag || j < D26).collect();
    let n = used.len();
    let scale = parameters::scale(prior);
    let pick =
        |rows: &ExtendedRegressor, axis: usize| DVector::from_fn(n, |i, _| rows[(axis, used[i])] * scale[used[i]]);
    let (mut energy, mut noise) = (vec![DMatrix::zeros(n, n); 6], vec![DMatrix::zeros(n, n); 6]);
    let (gains, found) = (noise_gains(), theta_of(model.parameters()));
    for samples in data.stretches() {
        for (k, pair) in filtered(samples, CUTOFF_HZ, true).windows(2).enumerate().step_by(3) {
            let interval = Interval::new(&pair[0], &pair[1]);
            let rows = interval.rows(model, &found);
            for (axis, energy) in energy.iter_mut().enumerate() {
                let row = pick(&rows, axis);
                energy.ger(1.0, &row, &row, 1.0);
            }
            if k % 9 != 0 {
                continue;
            }
            // What one sigma in each direction changes, three times as rare as the rows.
            for direction in 0..14 {
                let change = interval.disturbed(direction, options, gains).rows(model, &found) - rows;
                for (axis, noise) in noise.iter_mut().enumerate() {
                    let row = pick(&change, axis);
                    noise.ger(3.0, &row, &row, 1.0);
                }
            }
        }
    }
    let declared = parameters::of(prior);
    let mut theta = DVector::from_fn(n, |i, _| declared[used[i]] / scale[used[i]]);
    let column = used.iter().position(|&j| j == known).unwrap_or(M11);
    let free: Vec<usize> = (0..n).filter(|&i| i != column).collect();
    for _ in 0..ROUNDS {
        let (mut a, mut sigma) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        for (energy, noise) in energy.iter().zip(&noise) {
            let residual = theta.dot(&(energy * &theta)).max(f64::MIN_POSITIVE);
            a += energy / residual;
            sigma += noise / residual;
        }
        let lambda = LEAST_SHARE * smallest_ratio(&a, &sigma)?;
        let matrix = a - sigma * lambda.min(1.0);
        let right = DVector::from_fn(free.len(), |i, _| -matrix[(free[i], column)] * theta[column]);
        let matrix = DMatrix::from_fn(free.len(), free.len(), |i, j| matrix[(free[i], free[j])]);
        let solution = matrix.lu().solve(&right).ok_or_else(degenerate)?;
        for (&i, value) in free.iter().zip(solution.iter()) {
            theta[i] = *value;
        }
    }
    let mut values = declared;
    for (&j, value) in used.iter().zip(theta.iter()) {
        values[j] = value * scale[j];
    }
    Ok(values)
}

/// Of the smallest λ for which A − λ Σ is singular, this much may be taken out.
const LEAST_SHARE: f64 = 0.95;

fn degenerate() -> IdentifyError {
    IdentifyError::Degenerate("noise-whitened least squares: a column is zero".into())
}

/// The smallest λ with det(A − λ Σ) = 0; A is positive definite, Σ need not be.
fn smallest_ratio(a: &DMatrix<f64>, sigma: &DMatrix<f64>) -> Result<f64, IdentifyError> {
    let n = a.nrows();
    let length = a.diagonal().map(|d| 1.0 / d.max(f64::MIN_POSITIVE).sqrt());
    let scaled = |m: &DMatrix<f64>| DMatrix::from_fn(n, n, |i, j| m[(i, j)] * length[i] * length[j]);
    let factor = (scaled(a) + DMatrix::identity(n, n) * 1.0e-13).cholesky().ok_or_else(degenerate)?;
    let inverse = factor.l().try_inverse().ok_or_else(degenerate)?;
    let largest = (&inverse * scaled(sigma) * inverse.transpose()).symmetric_eigen().eigenvalues.max();
    Ok(1.0 / largest.max(f64::MIN_POSITIVE))
}

/// Gain of the filter and of the difference after it for white noise.
fn noise_gains() -> (f64, f64) {
    const LENGTH: usize = 201;
    let mut impulse = vec![Output::zeros(); LENGTH];
    impulse[LENGTH / 2] = Output::repeat(1.0);
    let response = smoothing::low_pass(&impulse, &[CUTOFF_HZ; simulation::OUTPUTS]);
    let value: f64 = response.iter().map(|r| r[0] * r[0]).sum();
    let slope: f64 = response.windows(2).map(|r| ((r[1][0] - r[0][0]) / PERIOD_S).powi(2)).sum();
    (value.sqrt(), slope.sqrt())
}
