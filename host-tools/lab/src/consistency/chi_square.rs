//! Bands of averages of normalised squares.

use backseat_logs::stats::chi_square_quantile;
use serde::{Deserialize, Serialize};

/// Where the average of normalised squares of a consistent filter lies with a probability of 95 %: χ² of all degrees of
/// freedom over the number averaged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Band {
    /// 2.5 % lie below.
    pub low: f64,
    /// 2.5 % lie above.
    pub high: f64,
}

impl Band {
    /// Of the average of `averaged` independent χ² numbers of `degrees` degrees of freedom each.
    #[must_use]
    pub fn of_mean(averaged: u64, degrees: u64) -> Self {
        let of = |p: f64| chi_square_quantile((averaged * degrees) as f64, p) / averaged as f64;
        Self { low: of(0.025), high: of(0.975) }
    }

    /// Whether a value lies inside.
    #[must_use]
    pub fn holds(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_the_band_is_that_of_the_textbook() {
        // Bar-Shalom, Li and Kirubarajan (2001), 5.4.2: 50 runs of two degrees of freedom, [1.5, 2.6].
        let band = Band::of_mean(50, 2);
        assert!((band.low - 1.484).abs() < 1e-3 && (band.high - 2.591).abs() < 1e-3, "{band:?}");
    }
}
