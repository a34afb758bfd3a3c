//! Nullspace least squares: W θ = 0 stacks the equations of motion at every sample, and θ is the direction that W
//! shrinks most.
//!
//! As the thesis has it (NBLS, 4.3), every column of W is as noisy as it is and all noise counts alike: total least
//! squares whose bias grows with the noise until drags change sign.

use backseat_core::dynamics::{ActuatorInput, Attitude, VehicleModel, VehicleParameters};
use backseat_core::identification::regressor::{Regressor, regressor};
use backseat_core::identification::theta::{B1, BETA1, M11, W};
use backseat_identify::parameters::{self, D26, D35, EXTENDED, Extended, ExtendedRegressor};
use backseat_identify::simulation::{self, Output};
use backseat_identify::smoothing::{self, CutOffs};
use backseat_identify::{IdentificationData, IdentifyError, Options, PERIOD_S, Sample, mean};
use nalgebra::{SMatrix, SVector, Vector3, Vector6};

/// Cut-off of all signals: NBLS's, Hz.
const CUTOFF_HZ: f64 = 0.3;
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
pub struct Filtered {
    /// u, v, w, p, q, r differentiated, m/s² and rad/s².
    pub acceleration: Vector6<f64>,
    /// u, v, w, p, q, r, m/s and rad/s.
    pub velocity: Vector6<f64>,
    /// rad.
    pub roll_pitch: [f64; 2],
    /// What the actuators do.
    pub input: ActuatorInput,
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
#[must_use]
pub fn filtered(samples: &[Sample], cutoff_hz: f64, held: bool) -> Vec<Filtered> {
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

/// NBLS of the thesis, kept inside the box of the options.
///
/// # Errors
/// If the prior is unusable.
pub fn nbls(
    data: &IdentificationData,
    prior: &VehicleParameters,
    options: &Options,
) -> Result<VehicleParameters, IdentifyError> {
    let mut values = unbounded(data, None, prior, options.scale.parameter(), CUTOFF_HZ)?;
    parameters::project(prior, options.box_ratio, &mut values);
    Ok(parameters::with(prior, &values))
}
