//! One row of H as a short list: a measurement sees few of the states.

use nalgebra::Vector3;

/// Most entries of one row: two bridged vehicle clones and a ship at both ends of a two-way path.
const CAPACITY: usize = 16;

/// Sparse row h. An index may come twice; its values then add.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    indices: [u8; CAPACITY],
    values: [f64; CAPACITY],
    len: usize,
}

impl Row {
    pub(crate) const EMPTY: Self = Self { indices: [0; CAPACITY], values: [0.0; CAPACITY], len: 0 };

    /// e_iᵀ.
    pub(crate) fn unit(index: usize) -> Self {
        let mut row = Self::EMPTY;
        row.push(index, 1.0);
        row
    }

    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }

    pub(crate) fn push(&mut self, index: usize, value: f64) {
        if let (Some(i), Some(v)) = (self.indices.get_mut(self.len), self.values.get_mut(self.len)) {
            *i = index as u8;
            *v = value;
            self.len += 1;
        }
    }

    /// States come to stand at `at`: those from there on are further behind.
    pub(crate) fn shift(&mut self, at: usize, count: usize) {
        for index in self.indices.iter_mut().take(self.len).filter(|index| usize::from(**index) >= at) {
            *index = index.wrapping_add(count as u8);
        }
    }

    /// a h.
    pub(crate) fn scale(&mut self, a: f64) {
        for value in self.values.iter_mut().take(self.len) {
            *value *= a;
        }
    }

    /// Adds a times another row; what both have stays one entry.
    pub(crate) fn add_scaled(&mut self, a: f64, other: &Self) {
        for (index, value) in other.iter() {
            let mine = self.indices.iter().take(self.len).position(|i| usize::from(*i) == index);
            match mine.and_then(|place| self.values.get_mut(place)) {
                Some(mine) => *mine += a * value,
                None => self.push(index, a * value),
            }
        }
    }

    /// Three states from `index` on.
    pub(crate) fn push_vector(&mut self, index: usize, values: &Vector3<f64>) {
        for (i, value) in values.iter().enumerate() {
            self.push(index + i, *value);
        }
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.indices.iter().zip(&self.values).take(self.len).map(|(&index, &value)| (usize::from(index), value))
    }

    /// Indices and values.
    pub(crate) fn as_slices(&self) -> (&[u8], &[f64]) {
        (self.indices.get(..self.len).unwrap_or_default(), self.values.get(..self.len).unwrap_or_default())
    }

    /// h a.
    pub(crate) fn dot(&self, a: &[f64]) -> f64 {
        self.iter().map(|(index, value)| value * a.get(index).copied().unwrap_or(0.0)).sum()
    }
}
