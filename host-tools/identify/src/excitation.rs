//! Which parameters the motion determines, which only in combination, and which manoeuvres determine the others.

use crate::data::IdentificationData;
use crate::estimate::{Estimate, EstimatedParameter, Unseen};
use crate::identifier::run_identifier;
use crate::options::{Method, Options};
use crate::parameters::{self, D26, EXTENDED, Extended, ExtendedRegressor};
use crate::smoothing;
use backseat_core::dynamics::{Attitude, VehicleModel, VehicleParameters};
use backseat_core::identification::Visibility;
use backseat_core::identification::aid::{Instant, model_acceleration};
use backseat_core::identification::regressor::{Regressor, regressor};
use backseat_core::identification::theta::theta_of;
use backseat_core::state;
use backseat_logs::interrupt;
use backseat_logs::stats::Z_95;
use nalgebra::{DMatrix, SMatrix};

/// Estimates that vary together more than this are one group.
const COLLINEAR: f64 = 0.95;

/// The manoeuvre that shows a parameter.
fn manoeuvre(parameter: usize) -> &'static str {
    match parameter {
        0 | 6 | 20 => "speed steps from slow to fast and back, a minute each",
        1 | 7 => "turns at several rudder angles and speeds: sideslip",
        2 | 8 => "dives and climbs at several elevator angles: heave",
        3 | 9 => "all four fins to one side and back at speed: roll",
        4 | 10 => "elevator steps to either side: pitch rate",
        5 | 11 => "rudder steps to either side (zigzag): yaw rate",
        12 => "slow straight flight at constant depth, or drifting with the propeller stopped",
        13 | 15 => "straight flight at several pitch angles, slow and fast",
        14 => "drifting level with the propeller stopped: roll at rest",
        16 => "coasting with the propeller stopped, and speed steps with fins at small and at large angles",
        17 => "speed lost in turns with large fin angles",
        18 => "rudder and elevator steps at several speeds",
        19 => "fins near their stops",
        D26 => "tight turns at several speeds: sway in turns",
        _ => "tight dives and climbs: heave while pitching",
    }
}

/// The estimate with all that can be said about it.
pub(crate) fn described(
    method: Method,
    data: &IdentificationData,
    prior: &VehicleParameters,
    options: &Options,
    values: &Extended,
    covariance: Option<&DMatrix<f64>>,
) -> Estimate {
    let vehicle = parameters::with(prior, values);
    let declared = parameters::of(prior);
    let excitation = run_identifier(data, &vehicle, options).map(|identifier| identifier.excitation()).ok();
    let identifies_cross = (D26..EXTENDED).any(|j| values[j] != declared[j]);
    let visibility = |j: usize| match &excitation {
        Some(excitation) if j < D26 => excitation[j].visibility,
        _ if identifies_cross => Visibility::Separate,
        _ => Visibility::Known,
    };
    let parameters = (0..EXTENDED)
        .map(|j| EstimatedParameter {
            name: parameters::name(j),
            unit: parameters::unit(j),
            value: values[j],
            ci95: covariance.filter(|c| c[(j, j)] > 0.0).map(|c| {
                let reach = Z_95 * c[(j, j)].sqrt();
                [values[j] - reach, values[j] + reach]
            }),
            prior: declared[j],
            visibility: visibility(j),
        })
        .collect();
    let seen: Vec<usize> =
        (0..EXTENDED).filter(|&j| matches!(visibility(j), Visibility::Separate | Visibility::Collinear)).collect();
    let unseen = (0..D26)
        .filter(|&j| visibility(j) == Visibility::Frozen)
        .map(|j| Unseen { name: parameters::name(j), manoeuvre: manoeuvre(j) })
        .collect();
    let collinear = correlation(data, &vehicle, &seen).map(|c| groups(&seen, &c)).unwrap_or_default();
    let mut notes = data.notes.clone();
    notes.push(format!(
        "{} is taken as known: the log holds no forces, so that one parameter must give the scale",
        parameters::name(options.scale.parameter())
    ));
    for group in &collinear {
        let last = group.iter().filter_map(|name| (0..EXTENDED).find(|&j| parameters::name(j) == *name)).next_back();
        let names: Vec<&str> = group.clone();
        notes.push(format!(
            "this log determines only a combination of {}; to separate them: {}",
            names.join(", "),
            last.map_or("", manoeuvre)
        ));
    }
    let covariance = covariance.cloned();
    Estimate { method, parameters, vehicle, covariance, collinear, unseen, steps: Vec::new(), notes }
}

/// Correlation of the errors that least squares on the accelerations would make: every axis weighted by its own
/// scatter.
fn correlation(data: &IdentificationData, vehicle: &VehicleParameters, seen: &[usize]) -> Option<DMatrix<f64>> {
    let model = VehicleModel::new(vehicle).ok()?;
    let theta = theta_of(vehicle);
    let mut rows: Vec<ExtendedRegressor> = Vec::new();
    let mut energy = [0.0; 6];
    let mut y = Regressor::zeros();
    for samples in data.stretches() {
        let smoothed = smoothing::with_model(&model, samples, &smoothing::PLAIN);
        for (sample, x) in samples.iter().zip(smoothed.states.iter().step_by(2)).step_by(5) {
            let velocity = state::velocity(x);
            let at = Instant::new(&model, &velocity, &Attitude::new(&state::attitude(x)).down(), &sample.input.mean());
            let acceleration = model_acceleration(&theta, &at);
            regressor(&acceleration, &velocity, &at.down, &at.actuators, &mut y);
            for (axis, energy) in energy.iter_mut().enumerate() {
                *energy += (acceleration[axis] * vehicle.m_diag[axis]).powi(2);
            }
            rows.push(parameters::extended(&y, &velocity));
        }
    }
    let scale = parameters::scale(vehicle);
    let count = rows.len().max(1) as f64;
    let weight = energy.map(|energy| count / energy.max(1.0e-12));
    let mut gram_matrix = SMatrix::<f64, EXTENDED, EXTENDED>::zeros();
    for row in &rows {
        interrupt::check();
        let mut weighted = *row;
        for (axis, weight) in weight.iter().enumerate() {
            weighted.row_mut(axis).scale_mut(*weight / count);
        }
        gram_matrix.gemm_tr(1.0, &weighted, row, 1.0);
    }
    let matrix = DMatrix::from_fn(seen.len(), seen.len(), |i, j| {
        let (a, b) = (seen[i], seen[j]);
        // A thousandth of the accelerations as noise, and the box as the prior.
        gram_matrix[(a, b)] * scale[a] * scale[b] * 1.0e6 + if a == b { 1.0 } else { 0.0 }
    });
    let inverse = matrix.cholesky()?.inverse();
    Some(DMatrix::from_fn(seen.len(), seen.len(), |i, j| inverse[(i, j)] / (inverse[(i, i)] * inverse[(j, j)]).sqrt()))
}

/// Parameters that correlate, directly or through others.
fn groups(seen: &[usize], correlation: &DMatrix<f64>) -> Vec<Vec<&'static str>> {
    let mut group: Vec<usize> = (0..seen.len()).collect();
    for i in 0..seen.len() {
        for j in 0..i {
            if correlation[(i, j)].abs() > COLLINEAR {
                let (from, to) = (group[i], group[j]);
                group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
            }
        }
    }
    let members = |root: usize| -> Vec<&'static str> {
        (0..seen.len()).filter(|&i| group[i] == root).map(|i| parameters::name(seen[i])).collect()
    };
    (0..seen.len()).map(members).filter(|group| group.len() > 1).collect()
}
