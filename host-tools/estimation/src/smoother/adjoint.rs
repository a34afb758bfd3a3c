//! λ and Λ, and how each step of the filter looks from behind.

use super::{Filtered, STRIDE, Step, Vector};
use crate::track::TrackSample;
use backseat_core::state::{PSI, VEHICLE_STATES, VehicleState, X, Y, wrap_angle};

/// Numbers that are computed together.
const LANES: usize = 4;

/// What the measurements behind a time say about the estimate at it: its error by them is P λ, and Λ is the covariance
/// of λ. Zero at the end of the log.
pub(super) struct Adjoint {
    /// Whole blocks of four that hold all states; nothing is behind them.
    width: usize,
    lambda: Vector,
    /// Λ, symmetric.
    information: Vec<Vector>,
    scratch: Vec<Vector>,
}

impl Adjoint {
    pub(super) fn new() -> Self {
        let zero = || vec![[0.0; STRIDE]; STRIDE];
        Self { width: STRIDE, lambda: [0.0; STRIDE], information: zero(), scratch: zero() }
    }

    /// Goes back over the steps; the smoothed samples from the last to the first.
    pub(super) fn back(&mut self, steps: &[Step]) -> Vec<TrackSample> {
        let mut smoothed = Vec::new();
        for step in steps.iter().rev() {
            match step {
                Step::Transition(states, columns, others) => self.transition(*states, columns, others),
                Step::Update { row, gain, innovation, variance } => self.update(row, gain, *innovation, *variance),
                Step::Append(at, rows) => self.append(*at, rows),
                Step::Insert(at, count) => self.insert(*at, *count),
                Step::Remove(at, count) => self.remove(*at, *count),
                Step::Sample(filtered) => smoothed.push(self.smoothed(filtered)),
            }
        }
        smoothed
    }

    /// x was Φ x: λ ← Φᵀ λ, Λ ← Φᵀ Λ Φ.
    fn transition(&mut self, states: usize, columns: &[[f64; VEHICLE_STATES]], others: &[(usize, usize, f64)]) {
        let width = states.next_multiple_of(LANES).min(STRIDE);
        self.width = width;
        let after = self.lambda;
        for (j, column) in columns.iter().enumerate() {
            let own = if j < VEHICLE_STATES { 0.0 } else { after[j] };
            self.lambda[j] = own + column.iter().zip(&after).map(|(a, b)| a * b).sum::<f64>();
        }
        for &(row, column, value) in others {
            self.lambda[column] += value * after[row];
        }
        times_transposed(width, &self.information, columns, others, &mut self.scratch);
        for (i, row) in self.information.iter_mut().enumerate().take(width) {
            row.iter_mut().zip(&self.scratch).take(width).for_each(|(to, from)| *to = from[i]);
        }
        times_transposed(width, &self.information, columns, others, &mut self.scratch);
        // Both halves are computed; one is kept, so that they cannot drift apart.
        for i in 0..width {
            for j in 0..=i {
                let value = self.scratch[i][j];
                (self.information[i][j], self.information[j][i]) = (value, value);
            }
        }
    }

    /// x was x + K ν: with C = 1 − K h, λ ← Cᵀ λ − hᵀ ν/S and Λ ← Cᵀ Λ C + hᵀ h/S.
    fn update(&mut self, row: &[(usize, f64)], gain: &[f64], innovation: f64, variance: f64) {
        let along: f64 = gain.iter().zip(&self.lambda).map(|(k, l)| k * l).sum();
        for &(i, h) in row {
            self.lambda[i] -= h * (along + innovation / variance);
        }
        let width = self.width;
        let mut spread = [0.0; STRIDE];
        for (k, information) in gain.iter().zip(&self.information) {
            spread.iter_mut().zip(information).take(width).for_each(|(sum, value)| *sum += k * value);
        }
        let square: f64 = gain.iter().zip(&spread).map(|(k, m)| k * m).sum();
        for &(i, h) in row {
            self.information[i].iter_mut().zip(&spread).take(width).for_each(|(value, m)| *value -= h * m);
            self.information.iter_mut().zip(&spread).take(width).for_each(|(row, m)| row[i] -= h * m);
        }
        for &(i, a) in row {
            for &(j, b) in row {
                self.information[i][j] += a * b * (square + 1.0 / variance);
            }
        }
    }

    /// x was \[x; C x\] with C behind `at`.
    fn append(&mut self, at: usize, rows: &[Vec<(usize, f64)>]) {
        for (from, row) in (at..).zip(rows) {
            for &(i, c) in row {
                self.lambda[i] += c * self.lambda[from];
                // Rows, then columns: [1 Cᵀ] Λ [1; C].
                let appended = self.information[from];
                self.information[i].iter_mut().zip(&appended).for_each(|(value, other)| *value += c * other);
            }
            for &(i, c) in row {
                self.information.iter_mut().for_each(|information| information[i] += c * information[from]);
            }
        }
        self.insert(at, rows.len());
    }

    /// `count` states came to stand at `at`: what is known about them says nothing about the others.
    fn insert(&mut self, at: usize, count: usize) {
        self.width = STRIDE;
        move_up(&mut self.lambda, at, count, 0.0);
        move_up(&mut self.information, at, count, [0.0; STRIDE]);
        self.information.iter_mut().for_each(|row| move_up(row, at, count, 0.0));
    }

    /// The `count` states at `at` were forgotten: no later measurement depends on them.
    fn remove(&mut self, at: usize, count: usize) {
        self.width = STRIDE;
        move_down(&mut self.lambda, at, count, 0.0);
        move_down(&mut self.information, at, count, [0.0; STRIDE]);
        self.information.iter_mut().for_each(|row| move_down(row, at, count, 0.0));
    }

    /// x̂ − P λ and P − P Λ P, with what the filter states beyond P.
    fn smoothed(&self, filtered: &Filtered) -> TrackSample {
        let smoothed = |i: usize| filtered.x[i] - dot(&filtered.covariance[i], &self.lambda);
        let mut covariance = self.covariance(filtered);
        for (i, variance) in filtered.unconfirmed_m2.iter().enumerate() {
            covariance[X + i][X + i] += variance;
        }
        let mut state = VehicleState::from_fn(|i, _| smoothed(i));
        state[PSI] = wrap_angle(state[PSI]);
        TrackSample {
            time_us: filtered.time_us,
            state,
            sigma: VehicleState::from_fn(|i, _| covariance[i][i].sqrt()),
            cov_xy_m2: covariance[X][Y],
            current_mps: filtered.current.map_or(filtered.fixed_current_mps, |at| [smoothed(at), smoothed(at + 1)]),
        }
    }

    /// P − P Λ P of the vehicle's states.
    pub(super) fn covariance(&self, filtered: &Filtered) -> [[f64; VEHICLE_STATES]; VEHICLE_STATES] {
        let p = &filtered.covariance;
        std::array::from_fn(|i| {
            let mut projected = [0.0; STRIDE];
            for (p, information) in p[i].iter().zip(&self.information).take(filtered.states) {
                projected.iter_mut().zip(information).for_each(|(sum, value)| *sum += p * value);
            }
            std::array::from_fn(|j| p[i][j] - dot(&projected, &p[j]))
        })
    }
}

fn dot(a: &Vector, b: &Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// out = Φᵀ a, of all rows.
fn times_transposed(
    width: usize,
    a: &[Vector],
    columns: &[[f64; VEHICLE_STATES]],
    others: &[(usize, usize, f64)],
    out: &mut [Vector],
) {
    for (out, a) in out.iter_mut().zip(a).take(width) {
        out[..width].copy_from_slice(&a[..width]);
    }
    let Some(vehicle) = a.first_chunk::<VEHICLE_STATES>() else { return };
    for (j, (column, out)) in columns.iter().zip(out.iter_mut()).enumerate() {
        // A position drives nothing.
        let is_identity =
            j < VEHICLE_STATES && column.iter().enumerate().all(|(i, a)| *a == f64::from(u8::from(i == j)));
        if is_identity {
            continue;
        }
        for (part, out) in out.as_chunks_mut::<LANES>().0.iter_mut().enumerate().take(width / LANES) {
            let mut sum = if j < VEHICLE_STATES { [0.0; LANES] } else { *out };
            for (factor, row) in column.iter().zip(vehicle) {
                let row = &row.as_chunks::<LANES>().0[part];
                for lane in 0..LANES {
                    sum[lane] += factor * row[lane];
                }
            }
            *out = sum;
        }
    }
    for &(row, column, value) in others {
        let from = a[row];
        out[column].iter_mut().zip(&from).for_each(|(out, from)| *out += value * from);
    }
}

/// Takes the `count` items at `at` out; the last are `empty`.
fn move_up<T: Copy>(items: &mut [T], at: usize, count: usize, empty: T) {
    items.copy_within(at + count.., at);
    let kept = items.len() - count;
    items[kept..].fill(empty);
}

/// Puts `count` items that are `empty` to `at`; the last fall off.
fn move_down<T: Copy>(items: &mut [T], at: usize, count: usize, empty: T) {
    let kept = items.len() - count;
    items.copy_within(at..kept, at + count);
    items[at..at + count].fill(empty);
}
