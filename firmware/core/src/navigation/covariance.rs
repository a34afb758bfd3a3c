//! P as its lower triangle, and the operations on it that cost.
//!
//! Only entries (i, j) with i ≥ j are stored and touched: symmetric by construction, at half the
//! work. Columns are contiguous, so that the long loops run along memory.

use super::layout::N_MAX;
use super::row::Row;
use crate::state::VEHICLE_STATES;

type Pair = [f64; 2];

pub(super) struct Covariance {
    /// `columns[j][i]` is P_ij for i ≥ j; what stands above the diagonal means nothing.
    pub(super) columns: [[f64; N_MAX]; N_MAX],
}

impl Covariance {
    pub(super) const fn new() -> Self {
        Self { columns: [[0.0; N_MAX]; N_MAX] }
    }

    /// Diagonal of the given sigmas.
    pub(super) fn set_vehicle(&mut self, sigma: &[f64]) {
        self.columns = [[0.0; N_MAX]; N_MAX];
        self.set_diagonal(0, sigma);
    }

    /// Variances of states `at`…
    pub(super) fn set_diagonal(&mut self, at: usize, sigma: &[f64]) {
        for (i, sigma) in sigma.iter().enumerate() {
            *self.at_mut(at + i, at + i) = sigma * sigma;
        }
    }

    /// P_ij; 0 outside.
    pub(super) fn get(&self, i: usize, j: usize) -> f64 {
        let (row, column) = if i >= j { (i, j) } else { (j, i) };
        self.columns.get(column).and_then(|c| c.get(row)).copied().unwrap_or(0.0)
    }

    /// P_ij of i ≥ j for writing; indices come from the layout and are below `N_MAX`.
    fn at_mut(&mut self, i: usize, j: usize) -> &mut f64 {
        let (row, column) = if i >= j { (i, j) } else { (j, i) };
        &mut self.columns[column.min(N_MAX - 1)][row.min(N_MAX - 1)]
    }

    /// P_ij += a.
    pub(super) fn add(&mut self, i: usize, j: usize, a: f64) {
        *self.at_mut(i, j) += a;
    }

    /// g = P hᵀ of the first `n` states.
    pub(super) fn times_row(&self, n: usize, h: &Row, g: &mut [f64; N_MAX]) {
        let n = n.min(N_MAX);
        *g = [0.0; N_MAX];
        let (mut indices, mut values) = h.as_slices();
        // States that follow each other cost less together.
        loop {
            let follows = |by: u8| indices.get(usize::from(by)).copied() == indices.first().map(|first| first + by);
            let done = match (indices, values) {
                (&[k, ..], &[a, b, c, ..]) if follows(1) && follows(2) => self.add_block(n, k, [a, b, c], g),
                (&[k, ..], &[a, b, ..]) if follows(1) => self.add_block(n, k, [a, b], g),
                (&[k, ..], &[a, ..]) => self.add_block(n, k, [a], g),
                _ => return,
            };
            indices = indices.get(done..).unwrap_or_default();
            values = values.get(done..).unwrap_or_default();
        }
    }

    /// g += P a, with a from state `k` on; returns W. Two rows at a time: a third of a single row's work is the loop.
    #[inline(never)]
    fn add_block<const W: usize>(&self, n: usize, k: u8, a: [f64; W], g: &mut [f64; N_MAX]) -> usize {
        let (n, k) = (n.min(N_MAX), usize::from(k).min(N_MAX - W));
        for i in 0..k {
            for w in 0..W {
                g[i] += a[w] * self.columns[i][k + w];
            }
        }
        for i in k..k + W {
            for w in 0..W {
                g[i] += a[w] * self.columns[i.min(k + w)][i.max(k + w)];
            }
        }
        let mut i = k + W;
        while i + 1 < n {
            for lane in 0..2 {
                for w in 0..W {
                    g[i + lane] += a[w] * self.columns[k + w][i + lane];
                }
            }
            i += 2;
        }
        if i < n {
            for w in 0..W {
                g[i] += a[w] * self.columns[k + w][i];
            }
        }
        W
    }

    /// a P bᵀ.
    pub(super) fn bilinear(&self, a: &Row, b: &Row) -> f64 {
        let mut sum = 0.0;
        for (i, value) in a.iter() {
            sum += value * b.iter().map(|(j, other)| other * self.get(i, j)).sum::<f64>();
        }
        sum
    }

    /// Update by the optimal gain K = g / s, with g = P h and s = h g + R: P − K gᵀ.
    ///
    /// Joseph's form completes to squares, (I − K h) P (I − K h)ᵀ + K R Kᵀ = P − g gᵀ/s + s (K − g/s) (K − g/s)ᵀ,
    /// and its last term vanishes with the square of the rounding of K: this is that form at half its cost.
    pub(super) fn update(&mut self, n: usize, gain: &[f64; N_MAX], g: &[f64; N_MAX]) {
        // By blocks of two by two from the diagonal on: one entry above it is computed in vain.
        let pairs = n.min(N_MAX).div_ceil(2);
        let (gains, gs) = (gain.as_chunks::<2>().0, g.as_chunks::<2>().0);
        for (block, columns) in self.columns.as_chunks_mut::<2>().0.iter_mut().enumerate().take(pairs) {
            let [left, right] = columns;
            let (left, right) = (left.as_chunks_mut::<2>().0, right.as_chunks_mut::<2>().0);
            let rows = block..pairs;
            let (Some(left), Some(right), Some(gains), Some(&[g_0, g_1])) =
                (left.get_mut(rows.clone()), right.get_mut(rows.clone()), gains.get(rows), gs.get(block))
            else {
                break;
            };
            subtract(left, right, gains, g_0, g_1);
        }
    }

    /// Appends a state that is `h` times the present ones; `g` is scratch.
    pub(super) fn append(&mut self, n: usize, h: &Row, g: &mut [f64; N_MAX]) {
        let n = n.min(N_MAX - 1);
        self.times_row(n, h, g);
        for (column, g) in self.columns.iter_mut().zip(g.iter()).take(n) {
            column[n] = *g;
        }
        self.columns[n][n] = h.dot(g);
    }

    /// Makes room for `count` independent states at `at`.
    pub(super) fn insert(&mut self, n: usize, at: usize, count: usize) {
        let n = n.min(N_MAX - count.min(N_MAX));
        for column in self.columns.iter_mut().take(at) {
            column.copy_within(at.min(n)..n, at.min(n) + count);
            column.iter_mut().skip(at).take(count).for_each(|p| *p = 0.0);
        }
        for j in (at..n).rev() {
            for i in (j..n).rev() {
                *self.at_mut(i + count, j + count) = self.get(i, j);
            }
        }
        for column in self.columns.iter_mut().skip(at).take(count) {
            *column = [0.0; N_MAX];
        }
    }

    /// Removes the `count` states at `at`.
    pub(super) fn remove(&mut self, n: usize, at: usize, count: usize) {
        let n = n.min(N_MAX);
        let behind = (at + count).min(n);
        for column in self.columns.iter_mut().take(at) {
            column.copy_within(behind..n, at.min(behind));
        }
        for j in behind..n {
            for i in j..n {
                *self.at_mut(i.saturating_sub(count), j.saturating_sub(count)) = self.get(i, j);
            }
        }
    }

    /// T P Tᵀ with T = I + a e_target e_sourceᵀ, source behind target.
    pub(super) fn shear(&mut self, n: usize, target: usize, source: usize, a: f64) {
        let source = source.min(N_MAX - 1);
        let (n, target) = (n.min(N_MAX), target.min(source));
        let (cross, variance) = (self.columns[target][source], self.columns[source][source]);
        for column in &mut self.columns[..target] {
            column[target] += a * column[source];
        }
        for j in target + 1..=source {
            self.columns[target][j] += a * self.columns[j][source];
        }
        let (before, behind) = self.columns.split_at_mut(source);
        if let (Some(target), Some(source_column)) = (before.get_mut(target), behind.first()) {
            for (p, q) in target.iter_mut().zip(source_column).take(n).skip(source + 1) {
                *p += a * q;
            }
        }
        self.columns[target][target] += a * (2.0 * cross + a * variance);
    }

    /// T P Tᵀ with T = I + Σ γ_i e_i e_sourceᵀ over the vehicle's states i, source behind them; `g` is scratch.
    pub(super) fn shear_vehicle(
        &mut self,
        n: usize,
        source: usize,
        gamma: &[f64; VEHICLE_STATES],
        g: &mut [f64; N_MAX],
    ) {
        self.times_row(n, &Row::unit(source), g);
        let variance = self.get(source, source);
        let n = n.min(N_MAX);
        for j in 0..VEHICLE_STATES {
            let (column, cross) = (&mut self.columns[j], g[j] + gamma[j] * variance);
            for i in j..VEHICLE_STATES {
                column[i] += gamma[j] * g[i] + gamma[i] * cross;
            }
            for (p, g) in column.iter_mut().zip(g.iter()).take(n).skip(VEHICLE_STATES) {
                *p += gamma[j] * g;
            }
        }
    }

    /// D P D with D = diag(`factor` at `index`, 1 elsewhere).
    pub(super) fn scale(&mut self, n: usize, index: usize, factor: f64) {
        for j in 0..n.min(N_MAX) {
            *self.at_mut(index, j) *= factor;
        }
        *self.at_mut(index, index) *= factor;
    }

    /// The vehicle block as a full matrix.
    pub(super) fn vehicle_block(&self, full: &mut [[f64; VEHICLE_STATES]; VEHICLE_STATES]) {
        for j in 0..VEHICLE_STATES {
            for i in j..VEHICLE_STATES {
                let p = self.columns[j][i];
                full[j][i] = p;
                full[i][j] = p;
            }
        }
    }
}

/// Two columns of P − K gᵀ from the diagonal down; `g_0` and `g_1` are g of the columns.
/// Not inlined: with a known bound it would be unrolled to 20 kB of code, and slower.
#[inline(never)]
fn subtract(left: &mut [Pair], right: &mut [Pair], gains: &[Pair], g_0: f64, g_1: f64) {
    let (left, last_left) = left.as_chunks_mut::<2>();
    let (right, last_right) = right.as_chunks_mut::<2>();
    let (gains, last_gain) = gains.as_chunks::<2>();
    for ((a, b), gain) in left.iter_mut().zip(right).zip(gains) {
        let ([gain_0, gain_1], [a_0, a_1], [b_0, b_1]) = (*gain, *a, *b);
        *a = [less(a_0, gain_0, g_0), less(a_1, gain_1, g_0)];
        *b = [less(b_0, gain_0, g_1), less(b_1, gain_1, g_1)];
    }
    if let ([a], [b], [gain]) = (last_left, last_right, last_gain) {
        (*a, *b) = (less(*a, *gain, g_0), less(*b, *gain, g_1));
    }
}

#[inline(always)]
fn less(p: Pair, gain: Pair, g: f64) -> Pair {
    [p[0] - gain[0] * g, p[1] - gain[1] * g]
}
