//! P as its lower triangle, and the operations on it that cost.
//!
//! Only entries (i, j) with i ≥ j count: symmetric by construction, at half the work. Columns are contiguous, so that
//! the long loops run along memory, and packed: each begins with the block of four by four on the diagonal.

use super::layout::N_MAX;
use super::row::Row;
use crate::state::VEHICLE_STATES;

/// Rows of a column: whole blocks of four.
pub(crate) const ROWS: usize = N_MAX.next_multiple_of(4);
/// One number a state, zero behind the last.
pub(crate) type Vector = [f64; ROWS];

/// Rows and columns of a block.
const BLOCK: usize = 4;
/// Numbers stored.
const SIZE: usize = ROWS * (ROWS + BLOCK) / 2;
/// Place of row 0 of each column, if it were stored.
const ROW_0: [u16; ROWS] = {
    let (mut places, mut start, mut j) = ([0; ROWS], 0, 0);
    while j < ROWS {
        let first_row = j / BLOCK * BLOCK;
        places[j] = (start - first_row) as u16;
        start += ROWS - first_row;
        j += 1;
    }
    assert!(start == SIZE);
    places
};

fn row_0(j: usize) -> usize {
    usize::from(ROW_0[j.min(ROWS - 1)]).min(SIZE - ROWS)
}

#[derive(Clone)]
pub(crate) struct Covariance {
    /// Column behind column, without the rows above the diagonal's block; what is above the diagonal means nothing.
    packed: [f64; SIZE],
}

impl Covariance {
    pub(crate) const fn new() -> Self {
        Self { packed: [0.0; SIZE] }
    }

    /// All entries 0.
    pub(crate) fn clear(&mut self) {
        self.packed = [0.0; SIZE];
    }

    /// Column `j`. Rows above the diagonal mean nothing.
    #[inline(always)]
    pub(crate) fn column(&self, j: usize) -> &Vector {
        self.packed[row_0(j)..].first_chunk().unwrap_or(&[0.0; ROWS])
    }

    /// Rows from `first` on of column `j`. Those above the diagonal's block are other columns'.
    #[inline(always)]
    pub(crate) fn rows_mut(&mut self, j: usize, first: usize) -> &mut [f64] {
        let (place, first) = (row_0(j), first.min(ROWS));
        &mut self.packed[place + first..place + ROWS]
    }

    /// Columns from the first on.
    fn columns(&self) -> impl Iterator<Item = &Vector> {
        (0..ROWS).map(|j| self.column(j))
    }

    /// Diagonal of the given sigmas.
    pub(crate) fn set_vehicle(&mut self, sigma: &[f64]) {
        self.clear();
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
        if row < N_MAX { self.packed[row_0(column) + row] } else { 0.0 }
    }

    /// P_ij of i ≥ j for writing; indices come from the layout and are below `N_MAX`.
    fn at_mut(&mut self, i: usize, j: usize) -> &mut f64 {
        let (row, column) = if i >= j { (i, j) } else { (j, i) };
        &mut self.packed[row_0(column) + row.min(N_MAX - 1)]
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
        let block: [&Vector; W] = core::array::from_fn(|w| self.column(k + w));
        let old = |g: f64, product: f64| if ADD { g + product } else { product };
        for (column, g) in self.columns().zip(g.iter_mut()).take(k) {
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
                let p = block[w];
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
        let quads = n.min(N_MAX).div_ceil(BLOCK);
        let (gains, gs) = (gain.as_chunks::<BLOCK>().0, g.as_chunks::<BLOCK>().0);
        let mut rest = &mut self.packed[..];
        for (block, g) in gs.iter().enumerate().take(quads) {
            let Some(gains) = gains.get(block..quads) else { return };
            let Some((columns, behind)) = rest.split_at_mut_checked(BLOCK * (ROWS - BLOCK * block)) else { return };
            rest = behind;
            subtract(columns, gains, *g);
        }
    }

    /// Appends a state that is `h` times the present ones; `g` is scratch.
    pub(crate) fn append(&mut self, n: usize, h: &Row, g: &mut Vector) {
        let n = n.min(N_MAX - 1);
        self.times_row(n, h, g);
        for (j, g) in g.iter().enumerate().take(n) {
            self.packed[row_0(j) + n] = *g;
        }
        self.set(n, n, h.dot(g));
    }

    /// Makes room for `count` independent states at `at`.
    pub(crate) fn insert(&mut self, n: usize, at: usize, count: usize) {
        let n = n.min(N_MAX - count.min(N_MAX));
        for j in 0..at.min(n) {
            let column = self.rows_mut(j, 0);
            column.copy_within(at.min(n)..n, at.min(n) + count);
            column.iter_mut().skip(at).take(count).for_each(|p| *p = 0.0);
        }
        for j in (at..n).rev() {
            for i in (j..n).rev() {
                *self.at_mut(i + count, j + count) = self.get(i, j);
            }
        }
        for j in at..(at + count).min(N_MAX) {
            self.rows_mut(j, j).fill(0.0);
        }
    }

    /// Removes the `count` states at `at`.
    pub(crate) fn remove(&mut self, n: usize, at: usize, count: usize) {
        let n = n.min(N_MAX);
        let behind = (at + count).min(n);
        for j in 0..at.min(n) {
            let column = self.rows_mut(j, 0);
            for i in behind..n {
                column[i.saturating_sub(count)] = column[i];
            }
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
        let (cross, variance) = (self.get(source, target), self.get(source, source));
        for j in 0..target {
            let place = row_0(j);
            self.packed[place + target] += a * self.packed[place + source];
        }
        let place = row_0(target);
        for j in target + 1..=source {
            self.packed[place + j] += a * self.packed[row_0(j) + source];
        }
        let (before, behind) = self.packed.split_at_mut(row_0(source) + source);
        if let Some(target) = before.get_mut(place + source..) {
            for (p, q) in target.iter_mut().zip(behind).take(n.saturating_sub(source)).skip(1) {
                *p += a * *q;
            }
        }
        self.add(target, target, a * (2.0 * cross + a * variance));
    }

    /// The vehicle block as a full matrix.
    pub(crate) fn vehicle_block(&self, full: &mut [[f64; VEHICLE_STATES]; VEHICLE_STATES]) {
        for j in 0..VEHICLE_STATES {
            let column = self.column(j);
            for i in j..VEHICLE_STATES {
                let p = column[i];
                full[j][i] = p;
                full[i][j] = p;
            }
        }
    }
}

/// Four columns of P − K gᵀ from their first block on. Not inlined: the loop needs all registers.
#[inline(never)]
fn subtract(columns: &mut [f64], gains: &[[f64; BLOCK]], g: [f64; BLOCK]) {
    let rows = columns.len() / BLOCK;
    let Some((a, columns)) = columns.split_at_mut_checked(rows) else { return };
    let Some((b, columns)) = columns.split_at_mut_checked(rows) else { return };
    let Some((c, d)) = columns.split_at_mut_checked(rows) else { return };
    let [a, b, c, d] = [a, b, c, d].map(|column| column.as_chunks_mut::<BLOCK>().0);
    for ((((a, b), c), d), gain) in a.iter_mut().zip(b).zip(c).zip(d).zip(gains) {
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
