//! P → Φ P Φᵀ + Q_d of the live block; what is delayed only turns its cross covariances.

use super::covariance::Covariance;
use super::discretisation::{AcceleratingEffect, DRIVING, Discretisation, add};
use super::layout::{EFFECTS, N_MAX, PLANT_STATES};
use crate::state::{PHI, PSI, VEHICLE_STATES, X, Y};

/// Rows that are moved together: a pair of doubles is one vector register.
const LANES: usize = 2;
const _: () = assert!(N_MAX.is_multiple_of(LANES) && VEHICLE_STATES.is_multiple_of(LANES));

type Pair = [f64; LANES];
type Column = [f64; VEHICLE_STATES];

/// The vehicle's part of the step: its own block and its cross covariances with all `n` states.
///
/// With e the augmented states that accelerate, x_v → Φ x_v + Γ e. In the order of the computation:
/// W = P_vv Φᵀ + P_ve Γᵀ; P_tv → P_tv Φᵀ + P_te Γᵀ of all states t behind the vehicle's; P_vv = Φ W + Γ P_ev + Q_d.
#[inline(never)]
pub(crate) fn propagate_vehicle(p: &mut Covariance, n: usize, step: &Discretisation) {
    let effects = step.effects.get(..step.effect_count).unwrap_or_default();
    let mut block = [[0.0; VEHICLE_STATES]; VEHICLE_STATES];
    half_block(p, step, effects, &mut block);
    // An odd last row takes its unused neighbour along.
    for pair in VEHICLE_STATES / LANES..n.min(N_MAX).div_ceil(LANES) {
        propagate_rows(p, pair, step, effects);
    }
    complete_block(p, step, effects, &block);
}

/// Two rows of the cross covariance: c → c Φᵀ + P_te Γᵀ.
#[inline(never)]
fn propagate_rows(p: &mut Covariance, pair: usize, step: &Discretisation, effects: &[AcceleratingEffect]) {
    let load = |p: &Covariance, state: usize| -> Pair {
        p.column(state).as_chunks::<LANES>().0.get(pair).copied().unwrap_or_default()
    };
    let driving = DRIVING.map(|state| load(p, state));
    let heading = load(p, PSI);
    let mut sums: [Pair; VEHICLE_STATES] = core::array::from_fn(|i| {
        let mut sum = if i < PHI || i == PSI { load(p, i) } else { [0.0; LANES] };
        if i == X || i == Y {
            add_pair(&mut sum, step.phi_heading[i], &heading);
        }
        for k in 0..DRIVING.len() {
            add_pair(&mut sum, step.phi[k][i], &driving[k]);
        }
        sum
    });
    for effect in effects {
        let source = EFFECTS + effect.slot;
        let cross: Pair = if source <= LANES * pair {
            load(p, source)
        } else {
            core::array::from_fn(|lane| p.column(LANES * pair + lane).get(source).copied().unwrap_or(0.0))
        };
        for (sum, gamma) in sums.iter_mut().zip(&effect.gamma) {
            add_pair(sum, *gamma, &cross);
        }
    }
    for (j, sum) in sums.iter().enumerate() {
        if let Some(rows) = p.rows_mut(j, LANES * pair).first_chunk_mut() {
            *rows = *sum;
        }
    }
}

#[inline(always)]
fn add_pair(sum: &mut Pair, a: f64, b: &Pair) {
    for lane in 0..LANES {
        sum[lane] += a * b[lane];
    }
}

/// W of the vehicle's own block, row by row. Whole columns are cheaper than their lower halves.
#[inline(never)]
fn half_block(
    p: &Covariance,
    step: &Discretisation,
    effects: &[AcceleratingEffect],
    full: &mut [Column; VEHICLE_STATES],
) {
    p.vehicle_block(full);
    for (j, row) in full.iter_mut().enumerate() {
        let column = p.column(j);
        let old = *row;
        let mut new = [0.0; VEHICLE_STATES];
        new[..PHI].copy_from_slice(&old[..PHI]);
        new[PSI] = old[PSI];
        new[X] += step.phi_heading[0] * old[PSI];
        new[Y] += step.phi_heading[1] * old[PSI];
        for k in 0..DRIVING.len() {
            add(&mut new, old[DRIVING[k]], &step.phi[k]);
        }
        for effect in effects {
            add(&mut new, column.get(EFFECTS + effect.slot).copied().unwrap_or(0.0), &effect.gamma);
        }
        *row = new;
    }
}

/// Φ W + Γ P_ev + Q, of which the lower triangle means something.
#[inline(never)]
fn complete_block(
    p: &mut Covariance,
    step: &Discretisation,
    effects: &[AcceleratingEffect],
    full: &[Column; VEHICLE_STATES],
) {
    let mut cross = [[0.0; VEHICLE_STATES]; PLANT_STATES];
    for (row, effect) in cross.iter_mut().zip(effects) {
        for (j, value) in row.iter_mut().enumerate() {
            *value = p.column(j).get(EFFECTS + effect.slot).copied().unwrap_or(0.0);
        }
    }
    for j in 0..VEHICLE_STATES {
        let mut sum = step.q[j];
        if j < PHI || j == PSI {
            add(&mut sum, 1.0, &full[j]);
        }
        if j == X || j == Y {
            add(&mut sum, step.phi_heading[j], &full[PSI]);
        }
        for k in 0..DRIVING.len() {
            add(&mut sum, step.phi[k][j], &full[DRIVING[k]]);
        }
        for (effect, row) in effects.iter().zip(&cross) {
            add(&mut sum, effect.gamma[j], row);
        }
        for (p, sum) in p.rows_mut(j, j).iter_mut().zip(sum.iter().skip(j)) {
            *p = *sum;
        }
    }
}

/// A position and its velocity under white acceleration of PSD `q`: exact over `h`.
pub(crate) fn propagate_double_integrator(
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
