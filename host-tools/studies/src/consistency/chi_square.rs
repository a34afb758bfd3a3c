//! Bands of averages of normalised squares.

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Degrees of freedom from which on the cube-root transformation is exact to 1e-6 of the band, and the incomplete
/// gamma function slow.
const MANY: f64 = 1.0e5;

/// Where the average of normalised squares of a consistent filter lies with a probability of 95 %: χ² of all degrees of
/// freedom over the number averaged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// 2.5 % lie below.
    pub low: f64,
    /// 2.5 % lie above.
    pub high: f64,
}

impl Band {
    /// Of the average of `averaged` independent χ² numbers of `degrees` degrees of freedom each.
    ///
    /// # Panics
    /// If either is zero.
    #[must_use]
    pub fn of_mean(averaged: u64, degrees: u64) -> Self {
        let total = (averaged * degrees) as f64;
        let per = averaged as f64;
        if total < MANY {
            return Self { low: quantile(total, 0.025) / per, high: quantile(total, 0.975) / per };
        }
        // Wilson and Hilferty (1931).
        let c = 2.0 / (9.0 * total);
        let cube = |z: f64| total * (1.0 - c + z * c.sqrt()).powi(3) / per;
        Self { low: cube(-backseat_data::stats::Z_95), high: cube(backseat_data::stats::Z_95) }
    }

    /// Whether a value lies inside.
    #[must_use]
    pub fn holds(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}

/// Where the distribution function of χ² is `p`, by bisection: `statrs` inverts it by a few steps of Newton's method, which
/// leave 3e-6 with many degrees of freedom and no number with one.
fn quantile(degrees: f64, p: f64) -> f64 {
    let distribution = ChiSquared::new(degrees).expect("degrees of freedom are positive");
    let (mut low, mut high) = (0.0, 2.0 * degrees + 20.0);
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle = 0.5 * (low + high);
        if distribution.cdf(middle) < p {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_quantiles_are_those_of_tables() {
        // R: qchisq(c(.025, .975), n). The last digit printed is rounded.
        for (degrees, low, high) in
            [(1, 0.000_982_069, 5.023_886), (12, 4.403_789, 23.336_66), (100, 74.221_93, 129.5612)]
        {
            let band = Band::of_mean(1, degrees);
            assert!((band.low / low - 1.0).abs() < 1e-6 && (band.high / high - 1.0).abs() < 1e-6, "{degrees} {band:?}");
        }
        // Bar-Shalom, Li and Kirubarajan (2001), 5.4.2: 50 runs of two degrees of freedom, [1.5, 2.6].
        let band = Band::of_mean(50, 2);
        assert!((band.low - 1.484).abs() < 1e-3 && (band.high - 2.591).abs() < 1e-3, "{band:?}");
    }

    #[test]
    fn transformation_takes_over_without_a_step() {
        let (exact, cubed) = (Band::of_mean(99_999, 1), Band::of_mean(100_001, 1));
        // One degree more moves the band by 1e-8.
        assert!((exact.low - cubed.low).abs() < 1e-6 && (exact.high - cubed.high).abs() < 1e-6, "{exact:?} {cubed:?}");
    }
}
