//! Normal equations of the whitened regression, block of time by block.
//!
//! With e the normalised innovations and S = ∂e/∂θ, a block keeps Σ SᵀS, −Σ Sᵀe, Σ e² and the count. Training,
//! held-out and whole log are sums of blocks; so is every hypothesis a choice of columns.

use rayon::Scope;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

/// Rows summed into the information matrix at a time: its row stays in the cache meanwhile.
const ROWS: usize = 8;
/// So many full blocks may wait for a thread: where all are busy with passes of their own, a long log's would fill the
/// memory.
const MOST_WAITING: usize = 8;

/// A column, or one less another: what begins with the first and ends with the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Column {
    at: usize,
    less: Option<usize>,
}

impl Column {
    /// The column `at` less the column `end`, where there is one.
    #[must_use]
    pub fn until(at: usize, end: Option<usize>) -> Self {
        Self { at, less: end }
    }
}

impl From<usize> for Column {
    fn from(at: usize) -> Self {
        Self { at, less: None }
    }
}

/// Normal equations of one block of time, or of several together.
#[derive(Clone, Debug, Default)]
pub struct NormalEquations {
    /// Σ SᵀS, full rows of the lower triangle.
    information: Vec<f64>,
    /// −Σ Sᵀe: half the slope of Σ e² by θ, downhill.
    score: Vec<f64>,
    /// Σ e².
    pub square: f64,
    /// Number of scalars.
    pub count: usize,
}

/// Normal equations block by block.
#[derive(Clone, Debug, Default)]
pub struct BlockEquations {
    /// Number of columns.
    pub columns: usize,
    /// In order of time; empty where nothing was measured.
    pub blocks: Vec<NormalEquations>,
}

impl NormalEquations {
    /// From the lower triangle of SᵀS, row by row, and −Sᵀe.
    #[must_use]
    pub fn new(information: Vec<f64>, score: Vec<f64>) -> Self {
        Self { information, score, ..Self::default() }
    }

    /// (SᵀS)_ij: the information matrix.
    #[must_use]
    pub fn information(&self, i: impl Into<Column>, j: impl Into<Column>) -> f64 {
        let (i, j) = (i.into(), j.into());
        let one = |i: usize, j: usize| {
            let (i, j) = (i.max(j), i.min(j));
            self.information.get(i * (i + 1) / 2 + j).copied().unwrap_or(0.0)
        };
        let mut sum = one(i.at, j.at);
        if let Some(i) = i.less {
            sum -= one(i, j.at);
        }
        if let Some(j) = j.less {
            sum -= one(i.at, j) - i.less.map_or(0.0, |i| one(i, j));
        }
        sum
    }

    /// (−Sᵀe)_i.
    #[must_use]
    pub fn score(&self, i: impl Into<Column>) -> f64 {
        let i = i.into();
        let one = |i: usize| self.score.get(i).copied().unwrap_or(0.0);
        one(i.at) - i.less.map_or(0.0, one)
    }
}

impl BlockEquations {
    pub(crate) fn collect(columns: usize, blocks: Vec<Arc<Mutex<NormalEquations>>>) -> Self {
        let take = |block: Arc<Mutex<NormalEquations>>| {
            block.lock().map(|mut block| std::mem::take(&mut *block)).unwrap_or_default()
        };
        Self { columns, blocks: blocks.into_iter().map(take).collect() }
    }

    /// Σ e² of the blocks that `choose` wants.
    #[must_use]
    pub fn square(&self, choose: impl Fn(usize) -> bool) -> f64 {
        self.blocks.iter().enumerate().filter(|(index, _)| choose(*index)).map(|(_, block)| block.square).sum()
    }

    /// Sum of the blocks that `choose` wants.
    #[must_use]
    pub fn sum(&self, choose: impl Fn(usize) -> bool) -> NormalEquations {
        let mut sum = NormalEquations {
            information: vec![0.0; self.columns * (self.columns + 1) / 2],
            score: vec![0.0; self.columns],
            ..NormalEquations::default()
        };
        for (_, block) in self.blocks.iter().enumerate().filter(|(index, block)| choose(*index) && block.count > 0) {
            for (total, part) in sum.information.iter_mut().zip(&block.information) {
                *total += part;
            }
            for (total, part) in sum.score.iter_mut().zip(&block.score) {
                *total += part;
            }
            sum.square += block.square;
            sum.count += block.count;
        }
        sum
    }
}

/// Gathers rows and hands each full block to another thread, or sums it itself where too many wait.
pub struct BlockEquationsBuilder<'s, 'scope> {
    columns: usize,
    block_s: f64,
    scope: &'s Scope<'scope>,
    /// e and S, row by row.
    rows: Vec<f64>,
    blocks: Vec<Arc<Mutex<NormalEquations>>>,
    waiting: Arc<AtomicUsize>,
}

impl<'s, 'scope> BlockEquationsBuilder<'s, 'scope> {
    pub(crate) fn new(columns: usize, block_s: f64, scope: &'s Scope<'scope>) -> Self {
        Self { columns, block_s, scope, rows: Vec::new(), blocks: Vec::new(), waiting: Arc::default() }
    }

    /// One scalar: its normalised innovation, and `slopes` times `scale` as its derivatives.
    pub(crate) fn row(&mut self, t_s: f64, e: f64, slopes: &[f64], scale: f64) {
        let block = (t_s / self.block_s) as usize;
        while self.blocks.len() <= block {
            self.flush();
            self.blocks.push(Arc::default());
        }
        self.rows.push(e);
        self.rows.extend(slopes.iter().map(|slope| slope * scale));
    }

    fn flush(&mut self) {
        let Some(block) = self.blocks.last().map(Arc::clone) else { return };
        let rows = std::mem::take(&mut self.rows);
        let columns = self.columns;
        self.rows.reserve(rows.len());
        let keep = move || {
            let sum = accumulate(columns, &rows);
            if let Ok(mut block) = block.lock() {
                *block = sum;
            }
        };
        if self.waiting.load(Ordering::Relaxed) >= MOST_WAITING {
            return keep();
        }
        self.waiting.fetch_add(1, Ordering::Relaxed);
        let waiting = Arc::clone(&self.waiting);
        self.scope.spawn(move |_| {
            keep();
            waiting.fetch_sub(1, Ordering::Relaxed);
        });
    }

    pub(crate) fn finish(mut self) -> Vec<Arc<Mutex<NormalEquations>>> {
        self.flush();
        self.blocks
    }
}

fn accumulate(columns: usize, rows: &[f64]) -> NormalEquations {
    let width = columns + 1;
    let mut block = NormalEquations {
        information: vec![0.0; columns * (columns + 1) / 2],
        score: vec![0.0; columns],
        square: 0.0,
        count: rows.len() / width,
    };
    for row in rows.chunks_exact(width) {
        let (e, slopes) = (row[0], &row[1..]);
        block.square += e * e;
        if e != 0.0 {
            for (score, slope) in block.score.iter_mut().zip(slopes) {
                *score -= e * slope;
            }
        }
    }
    for group in rows.chunks(ROWS * width) {
        let count = group.len() / width;
        let mut at = 0;
        for i in 0..columns {
            let target = &mut block.information[at..=at + i];
            at += i + 1;
            let factors: [f64; ROWS] = std::array::from_fn(|r| if r < count { group[r * width + 1 + i] } else { 0.0 });
            if factors.iter().all(|factor| *factor == 0.0) {
                continue;
            }
            if count == ROWS {
                let lines: [&[f64]; ROWS] = std::array::from_fn(|r| &group[r * width + 1..][..=i]);
                add(target, &factors, &lines);
            } else {
                for r in 0..count {
                    for (value, slope) in target.iter_mut().zip(&group[r * width + 1..]) {
                        *value += factors[r] * slope;
                    }
                }
            }
        }
    }
    block
}

/// target += Σ factor · line.
fn add(target: &mut [f64], factors: &[f64; ROWS], lines: &[&[f64]; ROWS]) {
    let n = target.len();
    let lines: [&[f64]; ROWS] = std::array::from_fn(|r| &lines[r][..n]);
    for j in 0..n {
        let mut sum = 0.0;
        for r in 0..ROWS {
            sum += factors[r] * lines[r][j];
        }
        target[j] += sum;
    }
}
