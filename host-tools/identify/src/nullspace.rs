//! Nullspace least squares: W θ = 0 stacks the equations of motion at every sample, and θ is the direction that W
//! shrinks most.
//!
//! As the thesis has it (NBLS, 4.3), every column of W is as noisy as it is and all noise counts alike: total least
//! squares whose bias grows with the noise until drags change sign. The noise-whitened form (GTLS) weights each axis by
//! its own residual and takes out of Wᵀ W what sensor noise of known size puts into it: (Wᵀ W − λ Σ) θ = 0, generalised
//! total least squares with λ = 1, or less where the noise is less than declared. It needs no hard filter against the
//! noise, and so distorts the motion less. Its rows are those of the intervals between samples, to fourth order: with
//! NBLS's central differences the rest that rolling leaves is larger than the noise, and weights and λ are those of a
//! noise that is not there.

use crate::data::IdentificationData;
use crate::estimate::Estimate;
use crate::excitation::described;
use crate::options::{IdentifyError, Method, Options};
use crate::parameters::{self, D26, D35, EXTENDED, Extended, ExtendedRegressor};
use crate::sample::{PERIOD_S, Sample, mean};
use crate::simulation::{self, Output};
use crate::smoothing::{self, CutOffs};
use backseat_core::dynamics::{ActuatorInput, Attitude, VehicleModel, VehicleParameters};
use backseat_core::identification::Theta;
use backseat_core::identification::aid::interval;
use backseat_core::identification::regressor::{Regressor, known_wrench, regressor};
use backseat_core::identification::theta::{B1, BETA1, M11, W, theta_of};
use nalgebra::{DMatrix, DVector, SMatrix, SVector, Vector3, Vector6};

/// Cut-off of all signals: NBLS's, Hz.
const CUTOFF_HZ: f64 = 0.3;
/// The same of the noise-whitened form, Hz.
const WHITENED_CUTOFF_HZ: f64 = 0.8;
/// Samples left out at either end of a stretch, where the filter sees less.
const MARGIN: usize = 30;
/// Number of NBLS's columns: θ without B1 and B2, with d26 and d35.
pub const COLUMNS: usize = EXTENDED - 2;
/// The parameter behind each of NBLS's columns, in the thesis' order: drags before weight.
pub const ORDER: [usize; COLUMNS] = {
    let mut order = [0; COLUMNS];
    let mut column = 0;
    while column < COLUMNS {
        order[column] = match column {
            0..12 => column,
            12 => D26,
            13 => D35,
            14 => W,
            15 => B1 + 2,
            _ => BETA1 + column - 16,
        };
        column += 1;
    }
    order
};

/// One instant, filtered.
struct Filtered {
    acceleration: Vector6<f64>,
    velocity: Vector6<f64>,
    roll_pitch: [f64; 2],
    input: ActuatorInput,
}

impl Filtered {
    fn down(&self) -> Vector3<f64> {
        Attitude::new(&Vector3::new(self.roll_pitch[0], self.roll_pitch[1], 0.0)).down()
    }

    /// The rows of this instant.
    fn rows(&self, model: &VehicleModel) -> ExtendedRegressor {
        let mut y = Regressor::zeros();
        let actuators = model.actuator_regressor(&self.velocity, &self.input);
        regressor(&self.acceleration, &self.velocity, &self.down(), &actuators, &mut y);
        parameters::extended(&y, &self.velocity)
    }
}

/// Everything through one filter, fins and propeller too: linear relations survive a filter that all share. The input
/// of an instant is `held` until the next, or else the mean of before and after.
fn filtered(samples: &[Sample], cutoff_hz: f64, held: bool) -> Vec<Filtered> {
    let all: CutOffs = [cutoff_hz; simulation::OUTPUTS];
    let outputs: Vec<Output> = samples.iter().map(simulation::measured).collect();
    let inputs: Vec<Output> = samples
        .iter()
        .enumerate()
        .map(|(k, sample)| {
            let before = &samples[if held { k } else { k.saturating_sub(1) }].input;
            let input = mean(&before.mean(), &sample.input.mean());
            let [top, bottom, port, starboard] = input.fins_rad;
            Output::from([input.propeller_radps, top, bottom, port, starboard, 0.0, 0.0, 0.0])
        })
        .collect();
    let (outputs, inputs) = (smoothing::low_pass(&outputs, &all), smoothing::low_pass(&inputs, &all));
    let velocity = |k: usize| outputs[k].fixed_rows::<6>(2).into_owned();
    (MARGIN..samples.len().saturating_sub(MARGIN))
        .map(|k| Filtered {
            acceleration: (velocity(k + 1) - velocity(k - 1)) / (2.0 * PERIOD_S),
            velocity: velocity(k),
            roll_pitch: [outputs[k][0], outputs[k][1]],
            input: ActuatorInput {
                propeller_radps: inputs[k][0],
                fins_rad: [inputs[k][1], inputs[k][2], inputs[k][3], inputs[k][4]],
            },
        })
        .collect()
}

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

/// The thesis' row block of NBLS: the columns of [`ORDER`].
#[must_use]
pub fn thesis_columns(rows: &ExtendedRegressor) -> SMatrix<f64, 6, COLUMNS> {
    SMatrix::from_fn(|axis, column| rows[(axis, ORDER[column])])
}

/// Sizes that bring every column of W to unit length.
#[must_use]
pub fn unit_length(normal: &SMatrix<f64, COLUMNS, COLUMNS>) -> SVector<f64, COLUMNS> {
    normal.diagonal().map(|square| if square > 0.0 { 1.0 / square.sqrt() } else { 1.0 })
}

/// The direction that Wᵀ W shrinks most, columns multiplied by `sizes` first, with the eigenvalues of the scaled matrix
/// in ascending order. Its scale and sign are those of `known` = (column, value).
#[must_use]
pub fn nullspace(
    normal: &SMatrix<f64, COLUMNS, COLUMNS>,
    sizes: &SVector<f64, COLUMNS>,
    known: (usize, f64),
) -> (SVector<f64, COLUMNS>, SVector<f64, COLUMNS>) {
    let scaled = SMatrix::<f64, COLUMNS, COLUMNS>::from_fn(|i, j| normal[(i, j)] * sizes[i] * sizes[j]);
    let eigen = scaled.symmetric_eigen();
    let mut order: Vec<usize> = (0..COLUMNS).collect();
    order.sort_unstable_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let direction = eigen.eigenvectors.column(order[0]).component_mul(sizes);
    let theta = direction * (known.1 / direction[known.0]);
    (theta, SVector::from_fn(|i, _| eigen.eigenvalues[order[i]]))
}

/// NBLS of the thesis as it comes out, inside no box: parameters may have any size and sign. `accelerations` are
/// measured ones of every sample (u, v, w, p, q, r, m/s² and rad/s²); without them velocities are differentiated. All
/// signals pass a filter of `cutoff_hz` without phase. The parameter `known` of the prior sets the scale.
///
/// # Errors
/// If the prior is unusable.
pub fn unbounded(
    data: &IdentificationData,
    accelerations: Option<&[Vector6<f64>]>,
    prior: &VehicleParameters,
    known: usize,
    cutoff_hz: f64,
) -> Result<Extended, IdentifyError> {
    let model = VehicleModel::new(prior).map_err(IdentifyError::Prior)?;
    let mut normal = SMatrix::<f64, COLUMNS, COLUMNS>::zeros();
    let mut from = 0;
    for samples in data.stretches() {
        let measured = accelerations.and_then(|all| all.get(from..from + samples.len())).map(|of_stretch| {
            let outputs = of_stretch.iter().map(|a| Output::from_fn(|i, _| a.get(i).copied().unwrap_or(0.0)));
            smoothing::low_pass(&outputs.collect::<Vec<_>>(), &[cutoff_hz; simulation::OUTPUTS])
        });
        from += samples.len();
        for (k, mut instant) in filtered(samples, cutoff_hz, false).into_iter().enumerate() {
            if let Some(measured) = measured.as_ref().and_then(|measured| measured.get(k + MARGIN)) {
                instant.acceleration = measured.fixed_rows::<6>(0).into_owned();
            }
            let w = thesis_columns(&instant.rows(&model));
            normal.gemm_tr(1.0, &w, &w, 1.0);
        }
    }
    let column = ORDER.iter().position(|&j| j == known).unwrap_or(M11);
    let mut values = parameters::of(prior);
    let (theta, _) = nullspace(&normal, &unit_length(&normal), (column, values[known]));
    for (&j, value) in ORDER.iter().zip(theta.iter()) {
        values[j] = *value;
    }
    (values[B1], values[B1 + 1]) = (0.0, 0.0);
    Ok(values)
}

/// NBLS of the thesis, kept inside the box.
pub(crate) fn nbls(
    data: &IdentificationData,
    prior: &VehicleParameters,
    options: &Options,
) -> Result<Estimate, IdentifyError> {
    let values = unbounded(data, None, prior, options.scale.parameter(), CUTOFF_HZ)?;
    Ok(boxed(Method::Nbls, data, prior, options, values))
}

/// The noise-whitened form.
pub(crate) fn gtls(
    data: &IdentificationData,
    prior: &VehicleParameters,
    options: &Options,
) -> Result<Estimate, IdentifyError> {
    /// Rounds of the way between samples, by what the round before found.
    const PASSES: usize = 3;
    let mut values = parameters::of(prior);
    for _ in 0..PASSES {
        let mut vehicle = values;
        parameters::project(prior, options.box_ratio, &mut vehicle);
        let model = VehicleModel::new(&parameters::with(prior, &vehicle)).map_err(IdentifyError::Prior)?;
        values = whitened(data, prior, &model, options)?;
    }
    let mut estimate = boxed(Method::Gtls, data, prior, options, values);
    let beyond = |sample: &Sample| known_wrench(prior, &sample.velocity, &sample.input.mean()).amax() > 0.0;
    if data.samples.iter().any(beyond) {
        estimate.notes.push("linear drag and advance of the declared vehicle are left out by this method".into());
    }
    Ok(estimate)
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
        for (k, pair) in filtered(samples, WHITENED_CUTOFF_HZ, true).windows(2).enumerate().step_by(3) {
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
    let response = smoothing::low_pass(&impulse, &[WHITENED_CUTOFF_HZ; simulation::OUTPUTS]);
    let value: f64 = response.iter().map(|r| r[0] * r[0]).sum();
    let slope: f64 = response.windows(2).map(|r| ((r[1][0] - r[0][0]) / PERIOD_S).powi(2)).sum();
    (value.sqrt(), slope.sqrt())
}

/// The estimate inside the box, with a note of what left it.
fn boxed(
    method: Method,
    data: &IdentificationData,
    prior: &VehicleParameters,
    options: &Options,
    values: Extended,
) -> Estimate {
    let mut inside = values;
    parameters::project(prior, options.box_ratio, &mut inside);
    let moved: Vec<&str> = (0..EXTENDED).filter(|&j| inside[j] != values[j]).map(parameters::name).collect();
    let mut estimate = described(method, data, prior, options, &inside, None);
    if !moved.is_empty() {
        estimate.notes.push(format!("left their box and were put back to its edge: {}", moved.join(", ")));
    }
    estimate
}
