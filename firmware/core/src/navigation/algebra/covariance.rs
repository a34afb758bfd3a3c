//! P as its lower triangle, and the operations on it that cost.
//!
//! Only entries (i, j) with i ≥ j are stored and touched: symmetric by construction, at half the
//! work. Columns are contiguous, so that the long loops run along memory.

use super::layout::N_MAX;
use super::row::Row;
use crate::state::VEHICLE_STATES;

/// Rows of a column: whole blocks of four.
pub(crate) const ROWS: usize = N_MAX.next_multiple_of(4);
/// One number a state, zero behind the last.
pub(crate) type Vector = [f64; ROWS];

#[derive(Clone)]
pub(crate) struct Covariance {
    /// `columns[j][i]` is P_ij for i ≥ j; what stands above the diagonal means nothing.
    pub(crate) columns: [Vector; N_MAX],
}

impl Covariance {
    pub(crate) const fn new() -> Self {
        Self { columns: [[0.0; ROWS]; N_MAX] }
    }

    /// Diagonal of the given sigmas.
    pub(crate) fn set_vehicle(&mut self, sigma: &[f64]) {
        self.columns = [[0.0; ROWS]; N_MAX];
        self.set_diagonal(0, sigma);
    }

    /// Variances of states `at`…
    pub(crate) fn set_diagonal(&mut self, at: usize, sigma: &[f64]) {
        for (i, sigma) in sigma.iter().enumerate() {
            *self.at_mut(at + i, at + i) = sigma * sigma;
        }
    }

    /// P_ij; 0 outside.
    pub(crate) fn get(&self, i: usize, j: usize) -> f64 {
        let (row, column) = if i >= j { (i, j) } else { (j, i) };
        self.columns.get(column).and_then(|c| c.get(row)).copied().unwrap_or(0.0)
    }

    /// P_ij of i ≥ j for writing; indices come from the layout and are below `N_MAX`.
    fn at_mut(&mut self, i: usize, j: usize) -> &mut f64 {
        let (row, column) = if i >= j { (i, j) } else { (j, i) };
        &mut self.columns[column.min(N_MAX - 1)][row.min(N_MAX - 1)]
    }

    /// P_ij = a.
    pub(crate) fn set(&mut self, i: usize, j: usize, a: f64) {
        *self.at_mut(i, j) = a;
    }

    /// P_ij += a.
    pub(crate) fn add(&mut self, i: usize, j: usize, a: f64) {
        *self.at_mut(i, j) += a;
    }

    /// g = P hᵀ of the first `n` states; what is behind them stays.
    pub(crate) fn times_row(&self, n: usize, h: &Row, g: &mut Vector) {
        let n = n.min(N_MAX);
        let (mut indices, mut values) = h.as_slices();
        if indices.is_empty() {
            *g = [0.0; ROWS];
        }
        let mut first = true;
        // States that follow each other cost less together.
        loop {
            let follow = |pair: &&[u8]| pair.first().map(|first| first.wrapping_add(1)) == pair.last().copied();
            let run = 1 + indices.windows(2).take(5).take_while(follow).count();
            let done = match (run, indices, values) {
                (6, &[k, ..], &[a, b, c, d, e, f, ..]) => self.add_block(n, k, [a, b, c, d, e, f], first, g),
                (3.., &[k, ..], &[a, b, c, ..]) => self.add_block(n, k, [a, b, c], first, g),
                (2, &[k, ..], &[a, b, ..]) => self.add_block(n, k, [a, b], first, g),
                (_, &[k, ..], &[a, ..]) => self.add_block(n, k, [a], first, g),
                _ => return,
            };
            first = false;
            indices = indices.get(done..).unwrap_or_default();
            values = values.get(done..).unwrap_or_default();
        }
    }

    fn add_block<const W: usize>(&self, n: usize, k: u8, a: [f64; W], first: bool, g: &mut Vector) -> usize {
        if first { self.block::<W, false>(n, k, a, g) } else { self.block::<W, true>(n, k, a, g) }
    }

    /// g += P a (`ADD`) or g = P a, with a from state `k` on; returns W. Four rows at a time are what the registers
    /// hold.
    #[inline(never)]
    fn block<const W: usize, const ADD: bool>(&self, n: usize, k: u8, a: [f64; W], g: &mut Vector) -> usize {
        let (n, k) = (n.min(N_MAX), usize::from(k).min(N_MAX - W));
        let (above, rest) = self.columns.split_at(k);
        let Some(block) = rest.first_chunk::<W>() else { return W };
        let old = |g: f64, product: f64| if ADD { g + product } else { product };
        for (column, g) in above.iter().zip(g.iter_mut()) {
            let Some(p) = column.get(k..).and_then(<[f64]>::first_chunk::<W>) else { return W };
            let mut sum = old(*g, a[0] * p[0]);
            for w in 1..W {
                sum += a[w] * p[w];
            }
            *g = sum;
        }
        for i in 0..W {
            let mut sum = old(g[k + i], a[0] * block[0][k + i]);
            for w in 1..W {
                sum += a[w] * block[i.min(w)][k + i.max(w)];
            }
            g[k + i] = sum;
        }
        let mut i = k + W;
        while i + 3 < n {
            let mut sum = [0.0; 4];
            for lane in 0..4 {
                sum[lane] = old(g[i + lane], a[0] * block[0][i + lane]);
            }
            for w in 1..W {
                let p = &block[w];
                let p = [p[i], p[i + 1], p[i + 2], p[i + 3]];
                for lane in 0..4 {
                    sum[lane] += a[w] * p[lane];
                }
            }
            [g[i], g[i + 1], g[i + 2], g[i + 3]] = sum;
            i += 4;
        }
        while i < n {
            let mut sum = old(g[i], a[0] * block[0][i]);
            for w in 1..W {
                sum += a[w] * block[w][i];
            }
            g[i] = sum;
            i += 1;
        }
        W
    }

    /// a P bᵀ.
    pub(crate) fn bilinear(&self, a: &Row, b: &Row) -> f64 {
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
    #[inline(never)]
    pub(crate) fn update(&mut self, n: usize, gain: &Vector, g: &Vector) {
        // By blocks of four by four from the diagonal on: what is above it, and behind `n`, is computed in vain.
        let quads = n.min(N_MAX).div_ceil(4);
        let (gains, gs) = (gain.as_chunks::<4>().0, g.as_chunks::<4>().0);
        let (blocks, rest) = self.columns.as_chunks_mut::<4>();
        for (block, columns) in blocks.iter_mut().enumerate() {
            let (Some(gains), Some(&g)) = (gains.get(block..quads), gs.get(block)) else { return };
            subtract(columns, block, gains, g);
        }
        if let (Some(gain), Some(g)) = (gains.get(blocks.len()..quads).and_then(<[_]>::first), gs.get(blocks.len())) {
            for (column, g) in rest.iter_mut().zip(g) {
                if let Some(rows) = column.as_chunks_mut::<4>().0.get_mut(blocks.len()) {
                    *rows = less(*rows, gain, *g);
                }
            }
        }
    }

    /// Appends a state that is `h` times the present ones; `g` is scratch.
    pub(crate) fn append(&mut self, n: usize, h: &Row, g: &mut Vector) {
        let n = n.min(N_MAX - 1);
        self.times_row(n, h, g);
        for (column, g) in self.columns.iter_mut().zip(g.iter()).take(n) {
            column[n] = *g;
        }
        self.columns[n][n] = h.dot(g);
    }

    /// Makes room for `count` independent states at `at`.
    pub(crate) fn insert(&mut self, n: usize, at: usize, count: usize) {
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
            *column = [0.0; ROWS];
        }
    }

    /// Removes the `count` states at `at`.
    pub(crate) fn remove(&mut self, n: usize, at: usize, count: usize) {
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
    pub(crate) fn shear(&mut self, n: usize, target: usize, source: usize, a: f64) {
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

    /// The vehicle block as a full matrix.
    pub(crate) fn vehicle_block(&self, full: &mut [[f64; VEHICLE_STATES]; VEHICLE_STATES]) {
        for j in 0..VEHICLE_STATES {
            for i in j..VEHICLE_STATES {
                let p = self.columns[j][i];
                full[j][i] = p;
                full[i][j] = p;
            }
        }
    }
}

/// Four columns of P − K gᵀ from the block `first` of four rows on. Not inlined: the loop needs all registers.
#[inline(never)]
fn subtract(columns: &mut [Vector; 4], first: usize, gains: &[[f64; 4]], g: [f64; 4]) {
    let [a, b, c, d] = columns.each_mut().map(|column| column.as_chunks_mut::<4>().0.iter_mut().skip(first));
    for ((((a, b), c), d), gain) in a.zip(b).zip(c).zip(d).zip(gains) {
        *a = less(*a, gain, g[0]);
        *b = less(*b, gain, g[1]);
        *c = less(*c, gain, g[2]);
        *d = less(*d, gain, g[3]);
    }
}

/// p − gain g.
#[inline(always)]
fn less(p: [f64; 4], gain: &[f64; 4], g: f64) -> [f64; 4] {
    [p[0] - gain[0] * g, p[1] - gain[1] * g, p[2] - gain[2] * g, p[3] - gain[3] * g]
}
