//! P → Φ P Φᵀ + Q_d of the live block; what is delayed only turns its cross covariances.

use super::covariance::Covariance;
use super::discretisation::{DRIVING, Discretisation};
use super::layout::N_MAX;
use crate::state::{PHI, PSI, VEHICLE_STATES, X, Y};

/// Rows that are moved together: a pair of doubles is one vector register.
const LANES: usize = 2;
const _: () = assert!(N_MAX.is_multiple_of(LANES) && VEHICLE_STATES.is_multiple_of(LANES));

/// The vehicle's part of the step: its own block and its cross covariances with all `n` states.
pub(super) fn propagate_vehicle(p: &mut Covariance, n: usize, step: &Discretisation) {
    let mut row = VEHICLE_STATES;
    // An odd last row takes its unused neighbour along.
    while row < n.min(N_MAX) {
        propagate_rows(p, row, step);
        row += LANES;
    }
    propagate_block(p, step);
}

/// Rows `row` and `row + 1` of the cross covariance: c → c Φᵀ.
fn propagate_rows(p: &mut Covariance, row: usize, step: &Discretisation) {
    let load = |p: &Covariance, state: usize| -> [f64; LANES] {
        core::array::from_fn(|lane| p.columns[state].get(row + lane).copied().unwrap_or(0.0))
    };
    let driving: [[f64; LANES]; DRIVING.len()] = core::array::from_fn(|k| load(p, DRIVING[k]));
    let heading = load(p, PSI);
    for i in 0..VEHICLE_STATES {
        let mut sum = if i < PHI || i == PSI { load(p, i) } else { [0.0; LANES] };
        if i == X || i == Y {
            for lane in 0..LANES {
                sum[lane] += step.phi_heading[i] * heading[lane];
            }
        }
        for (column, driving) in step.phi.iter().zip(&driving) {
            for lane in 0..LANES {
                sum[lane] += column[i] * driving[lane];
            }
        }
        for (p, sum) in p.columns[i].iter_mut().skip(row).zip(sum) {
            *p = sum;
        }
    }
}

/// The vehicle's own block.
fn propagate_block(p: &mut Covariance, step: &Discretisation) {
    let mut full = [[0.0; VEHICLE_STATES]; VEHICLE_STATES];
    p.vehicle_block(&mut full);
    // full → P Φᵀ, row by row.
    for row in &mut full {
        let old = *row;
        let mut new = [0.0; VEHICLE_STATES];
        new[..PHI].copy_from_slice(&old[..PHI]);
        new[PSI] = old[PSI];
        new[X] += step.phi_heading[0] * old[PSI];
        new[Y] += step.phi_heading[1] * old[PSI];
        for (column, &state) in step.phi.iter().zip(&DRIVING) {
            let a = old[state];
            for (new, phi) in new.iter_mut().zip(column) {
                *new += a * phi;
            }
        }
        *row = new;
    }
    // Lower triangle of Φ (P Φᵀ) + Q.
    for j in 0..VEHICLE_STATES {
        let mut sum = step.q[j];
        let mut accumulate = |a: f64, row: &[f64; VEHICLE_STATES]| {
            for (sum, b) in sum[j..].iter_mut().zip(&row[j..]) {
                *sum += a * b;
            }
        };
        if j < PHI || j == PSI {
            accumulate(1.0, &full[j]);
        }
        if j == X || j == Y {
            accumulate(step.phi_heading[j], &full[PSI]);
        }
        for (column, &state) in step.phi.iter().zip(&DRIVING) {
            accumulate(column[j], &full[state]);
        }
        p.columns[j][j..VEHICLE_STATES].copy_from_slice(&sum[j..]);
    }
}

/// A position and its velocity under white acceleration of PSD `q`: exact over `h`.
pub(super) fn propagate_double_integrator(
    p: &mut Covariance,
    n: usize,
    position: usize,
    velocity: usize,
    q: f64,
    h: f64,
) {
    p.shear(n, position, velocity, h);
    p.add(position, position, q * h * h * h / 3.0);
    p.add(position, velocity, q * h * h / 2.0);
    p.add(velocity, velocity, q * h);
}
