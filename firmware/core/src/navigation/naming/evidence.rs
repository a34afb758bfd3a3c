//! What the sums say for one cause from one onset on, beside everything that may have been there from the start.
//!
//! With H and s the sums of the whole time, H₁ and s₁ those since the onset, and Λ the prior of what was there from the
//! start, the change δ = V θ has, all else eliminated,
//!
//!   I = Vᵀ H₁ V − Vᵀ H₁ (H + Λ)⁻¹ H₁ V,        r = Vᵀ s₁ − Vᵀ H₁ (H + Λ)⁻¹ s
//!
//! and against no change the evidence, sizes before the data N(μ, Λ₁⁻¹),
//!
//!   ln B = ½ (r + Λ₁ μ)ᵀ (I + Λ₁)⁻¹ (r + Λ₁ μ) − ½ μᵀ Λ₁ μ − ½ ln det(1 + Λ₁⁻¹ I).

use super::causes::{Cause, Part, part};
use super::columns::{COLUMNS, DECLARED_SIGMA};
use super::onset::{DISTURBED, Onset, REMEMBERED};
use super::sums::{Sums, Triangle, along, packed};

/// Numbers of changes that are taken as there, and what they have done to the estimate within their first block.
pub(super) const BESIDE: usize = 4 + REMEMBERED.len();
/// Rows of the factor: what was there from the start, what is taken as there, everything that may have changed.
const ROWS: usize = COLUMNS + BESIDE + COLUMNS;

/// A change of anything is at most so many times what is left open from the start.
const OPEN: f64 = 5.0;

/// A number beside what was there from the start.
#[derive(Clone, Copy)]
pub(super) enum Number<'a> {
    /// Of a change since an onset.
    Change(Part, &'a Onset),
    /// What a change has done to the estimate within the block that its onset ends, by the place of the state.
    State(usize, &'a Onset),
}

impl Number<'_> {
    const fn onset(&self) -> &Onset {
        match self {
            Self::Change(_, onset) | Self::State(_, onset) => onset,
        }
    }

    /// Mean and sigma before anything is measured.
    fn prior(&self) -> (f64, f64) {
        match self {
            Self::Change(part, _) => (part.mean, part.sigma),
            Self::State(m, _) => (0.0, DISTURBED.get(*m).copied().unwrap_or(1.0)),
        }
    }

    fn products(&self, total: &Sums) -> [f64; COLUMNS] {
        match self {
            Self::Change(part, onset) => onset.products(total, &part.direction),
            Self::State(m, onset) => onset.state_products(*m),
        }
    }

    fn score(&self, total: &Sums) -> f64 {
        match self {
            Self::Change(part, onset) => onset.score(total, &part.direction),
            Self::State(m, onset) => onset.state_score(*m),
        }
    }

    /// Of the present block, long after the onset.
    fn by_columns(&self, products: &[f64; COLUMNS]) -> f64 {
        match self {
            Self::Change(part, _) => along(&part.direction, products),
            Self::State(..) => 0.0,
        }
    }

    /// Product of two of them. By the later onset the filter has forgotten how the earlier change began.
    fn times(&self, total: &Sums, other: &Self) -> f64 {
        let (earlier, later) = if self.onset().time_us > other.onset().time_us { (other, self) } else { (self, other) };
        let together = earlier.onset().time_us == later.onset().time_us;
        match (earlier, later) {
            (Self::Change(one, _), Self::Change(two, onset)) if together => {
                onset.between(total, &one.direction, &two.direction)
            }
            (Self::Change(one, _), Self::Change(two, onset)) => {
                along(&one.direction, &onset.products(total, &two.direction))
            }
            (Self::State(m, onset), Self::State(n, _)) if together => onset.between_states(*m, *n),
            (Self::State(m, onset), Self::Change(part, _)) | (Self::Change(part, _), Self::State(m, onset))
                if together =>
            {
                onset.state_between(*m, &part.direction)
            }
            (Self::Change(part, _), Self::State(m, onset)) => along(&part.direction, &onset.state_products(*m)),
            (Self::State(..), _) => 0.0,
        }
    }
}

/// L of H + Λ = L Lᵀ, and L⁻¹ s; behind the columns the numbers that are taken as there.
pub(super) struct Factor {
    l: Triangle<{ packed(ROWS) }>,
    y: [f64; ROWS],
    rows: usize,
}

impl Factor {
    pub(super) const NONE: Self = Self { l: Triangle::ZERO, y: [0.0; ROWS], rows: 0 };

    /// Of the columns alone, with one sigma each before anything is measured. `left_out`: sums at the start (none: those of
    /// nothing) and the end of a time that is to be left out.
    pub(super) fn compute(&mut self, total: &Sums, left_out: [Option<&Sums>; 2], sigma: &[f64; COLUMNS]) {
        self.rows = 0;
        let signed = || left_out.into_iter().zip([1.0, -1.0]).filter_map(|(sums, sign)| Some((sums?, sign)));
        for (i, sigma) in sigma.iter().enumerate() {
            let mut row = [0.0; ROWS];
            let mut score = 0.0;
            for (sums, sign) in signed().chain([(total, 1.0)]) {
                row.iter_mut().zip(sums.information.row(i)).for_each(|(own, sum)| *own += sign * sum);
                score += sign * sums.score.get(i).copied().unwrap_or(0.0);
            }
            let diagonal = row.get(i).copied().unwrap_or(0.0) + 1.0 / (sigma * sigma);
            self.append(row, diagonal, score);
        }
    }

    /// One more row: its entries with those before it, its diagonal, its score.
    fn append(&mut self, mut row: [f64; ROWS], diagonal: f64, score: f64) {
        let at = self.rows;
        self.solve(&mut row);
        let squares: f64 = row.iter().take(at).map(|w| w * w).sum();
        let known: f64 = row.iter().zip(&self.y).take(at).map(|(w, y)| w * y).sum();
        // positive by construction; rounding must not make it otherwise
        let left = diagonal - squares;
        let floor = 1.0e-12 * diagonal;
        let pivot = libm::sqrt(if left > floor { left } else { floor });
        for (own, w) in self.l.row_mut(at).iter_mut().zip(&row) {
            *own = *w;
        }
        if let Some(last) = self.l.row_mut(at).last_mut() {
            *last = pivot;
        }
        if let Some(y) = self.y.get_mut(at) {
            *y = (score - known) / pivot;
        }
        self.rows += 1;
    }

    /// L⁻¹ of a vector, in place.
    fn solve(&self, vector: &mut [f64; ROWS]) {
        for i in 0..self.rows.min(ROWS) {
            let row = self.l.row(i);
            let Some((pivot, before)) = row.split_last() else { return };
            let known: f64 = before.iter().zip(vector.iter()).map(|(l, v)| l * v).sum();
            if let Some(own) = vector.get_mut(i) {
                *own = (*own - known) / pivot;
            }
        }
    }

    /// Products of a number with the columns and with the numbers that are taken as there.
    fn products(&self, total: &Sums, number: &Number<'_>, beside: &[Number<'_>]) -> [f64; ROWS] {
        let mut row = [0.0; ROWS];
        row.iter_mut().zip(number.products(total)).for_each(|(own, product)| *own = product);
        row.iter_mut().skip(COLUMNS).zip(beside).for_each(|(own, other)| *own = number.times(total, other));
        row
    }

    /// Takes a number as there, behind those that are.
    pub(super) fn take(&mut self, total: &Sums, number: &Number<'_>, beside: &[Number<'_>]) {
        let row = self.products(total, number, beside);
        let (mean, sigma) = number.prior();
        let certainty = 1.0 / (sigma * sigma);
        self.append(row, number.times(total, number) + certainty, number.score(total) + certainty * mean);
    }

    /// Takes as there what a change may have done to the estimate within the block that an onset ends.
    pub(super) fn take_states<'a>(&mut self, total: &Sums, onset: &'a Onset) -> [Number<'a>; REMEMBERED.len()] {
        let states = core::array::from_fn(|m| Number::State(m, onset));
        for (m, state) in states.iter().enumerate() {
            self.take(total, state, states.get(..m).unwrap_or_default());
        }
        states
    }

    /// Lets column `column`, too, have changed since the onset; all before it have. Returns by how much that explains more,
    /// as χ² of one number or less.
    pub(super) fn open(&mut self, total: &Sums, column: usize, onset: &Onset, beside: &[Number<'_>]) -> f64 {
        let sigma = OPEN * DECLARED_SIGMA.get(column).copied().unwrap_or(1.0);
        let number = Number::Change(part(column, sigma), onset);
        let mut row = self.products(total, &number, beside);
        for (other, own) in row.iter_mut().skip(COLUMNS + beside.len()).take(column).enumerate() {
            *own = number.times(total, &Number::Change(part(other, 1.0), onset));
        }
        let diagonal = number.times(total, &number) + 1.0 / (sigma * sigma);
        self.append(row, diagonal, number.score(total));
        let y = self.rows.checked_sub(1).and_then(|last| self.y.get(last)).copied().unwrap_or(0.0);
        y * y
    }

    /// Keeps so many numbers behind the columns.
    pub(super) fn close(&mut self, beside: usize) {
        self.rows = self.rows.min(COLUMNS + beside);
    }

    /// I and r of up to two numbers.
    pub(super) fn left(
        &self,
        total: &Sums,
        numbers: &[Option<Number<'_>>; 2],
        beside: &[Number<'_>],
    ) -> ([[f64; 2]; 2], [f64; 2]) {
        let (mut information, mut score) = ([[0.0; 2]; 2], [0.0; 2]);
        let mut rows = [[0.0; ROWS]; 2];
        for (row, number) in rows.iter_mut().zip(numbers) {
            if let Some(number) = number {
                *row = self.products(total, number, beside);
                self.solve(row);
            }
        }
        let [first, second] = &rows;
        let dot =
            |a: &[f64; ROWS], b: &[f64; ROWS]| -> f64 { a.iter().zip(b).take(self.rows).map(|(a, b)| a * b).sum() };
        let [[own, between], [_, other]] = &mut information;
        let [score_own, score_other] = &mut score;
        if let [Some(one), _] = numbers {
            *own = one.times(total, one) - dot(first, first);
            *score_own = one.score(total) - dot(first, &self.y);
        }
        if let [Some(one), Some(two)] = numbers {
            *other = two.times(total, two) - dot(second, second);
            *score_other = two.score(total) - dot(second, &self.y);
            *between = one.times(total, two) - dot(first, second);
        }
        (information, score)
    }

    /// What the sums say for a cause since an onset. `colour`: by so much the innovations scatter more than white ones.
    pub(super) fn weigh(
        &self,
        total: &Sums,
        (cause, onset_h): (Cause, f64),
        onset: &Onset,
        beside: &[Number<'_>],
        colour: f64,
    ) -> Weighed {
        let parts = cause.parts(onset_h);
        let numbers = parts.map(|part| part.map(|part| Number::Change(part, onset)));
        let (information, score) = self.left(total, &numbers, beside);
        let mut certainty = [1.0; 2];
        let mut mean = [0.0; 2];
        for ((certainty, mean), part) in certainty.iter_mut().zip(&mut mean).zip(&parts) {
            if let Some(part) = part {
                (*certainty, *mean) = (1.0 / (part.sigma * part.sigma), part.mean);
            }
        }
        let share = 1.0 / colour;
        let [[a, b], [_, d]] = information.map(|row| row.map(|entry| entry * share));
        let (a, d) = (a.max(0.0) + certainty[0], d.max(0.0) + certainty[1]);
        let r = [score[0] * share + certainty[0] * mean[0], score[1] * share + certainty[1] * mean[1]];
        let determinant = a * d - b * b;
        let size = [(d * r[0] - b * r[1]) / determinant, (a * r[1] - b * r[0]) / determinant];
        let before = certainty[0] * mean[0] * mean[0] + certainty[1] * mean[1] * mean[1];
        let gain = r[0] * size[0] + r[1] * size[1] - before;
        let log_ratio = 0.5 * (gain - libm::log(determinant / (certainty[0] * certainty[1])));
        if !(determinant > 0.0 && log_ratio.is_finite()) {
            return Weighed::NOTHING;
        }
        let sigma = [libm::sqrt(d / determinant), libm::sqrt(a / determinant)];
        Weighed { log_ratio, gain, size, sigma }
    }

    /// Of the score of one column over a block with these products: what the estimate's error adds to its variance, and
    /// what the estimate expects.
    pub(super) fn expected(&self, products: &[f64; COLUMNS], beside: &[Number<'_>]) -> (f64, f64) {
        let mut row = [0.0; ROWS];
        for (own, product) in row.iter_mut().zip(products) {
            *own = *product;
        }
        for (own, other) in row.iter_mut().skip(COLUMNS).zip(beside) {
            *own = other.by_columns(products);
        }
        self.solve(&mut row);
        let variance = row.iter().take(self.rows).map(|w| w * w).sum();
        let mean = row.iter().zip(&self.y).take(self.rows).map(|(w, y)| w * y).sum();
        (variance, mean)
    }
}

/// What the sums say for one cause and one onset.
#[derive(Clone, Copy)]
pub(super) struct Weighed {
    /// ln B.
    pub(super) log_ratio: f64,
    /// Twice the same without what the prior's width costs.
    pub(super) gain: f64,
    pub(super) size: [f64; 2],
    pub(super) sigma: [f64; 2],
}

impl Weighed {
    pub(super) const ZERO: Self = Self { log_ratio: 0.0, gain: 0.0, size: [0.0; 2], sigma: [0.0; 2] };
    pub(super) const NOTHING: Self = Self { log_ratio: f64::NEG_INFINITY, gain: 0.0, size: [0.0; 2], sigma: [0.0; 2] };
}
