//! Plain statistics of errors and innovations.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal, StudentsT};
use statrs::function::beta::beta_reg;
use statrs::function::gamma::{gamma_lr, gamma_ur};

/// Value below which a share `q` (0 to 1) of the samples lies, interpolated linearly between order
/// statistics (type 7 of Hyndman and Fan 1996, the default of NumPy and R); `None` without samples.
#[must_use]
pub fn percentile(samples: &[f64], q: f64) -> Option<f64> {
    let mut sorted = samples.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    percentile_sorted(&sorted, q)
}

/// [`percentile`] of samples that are in ascending order already.
#[must_use]
pub fn percentile_sorted(sorted: &[f64], q: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let position = q.clamp(0.0, 1.0) * last as f64;
    let below = position as usize;
    let above = (below + 1).min(last);
    Some(sorted[below] + (position - below as f64) * (sorted[above] - sorted[below]))
}

/// Median; `None` without samples.
#[must_use]
pub fn median(samples: &[f64]) -> Option<f64> {
    percentile(samples, 0.5)
}

/// Arithmetic mean; `None` without samples.
#[must_use]
pub fn mean(samples: &[f64]) -> Option<f64> {
    (!samples.is_empty()).then(|| samples.iter().sum::<f64>() / samples.len() as f64)
}

/// Root of the mean square; `None` without samples.
#[must_use]
pub fn rms(samples: &[f64]) -> Option<f64> {
    (!samples.is_empty()).then(|| (samples.iter().map(|x| x * x).sum::<f64>() / samples.len() as f64).sqrt())
}

/// Standard deviation with n − 1; `None` below two samples.
#[must_use]
pub fn standard_deviation(samples: &[f64]) -> Option<f64> {
    if samples.len() < 2 {
        return None;
    }
    let mean = mean(samples)?;
    let sum: f64 = samples.iter().map(|x| (x - mean) * (x - mean)).sum();
    Some((sum / (samples.len() - 1) as f64).sqrt())
}

/// Autocorrelation at lags 1 to `lags` of a sequence of mean zero.
#[must_use]
pub fn autocorrelation(e: &[f64], lags: usize) -> Vec<f64> {
    let power: f64 = e.iter().map(|x| x * x).sum();
    (1..=lags)
        .map(
            |lag| {
                if power > 0.0 {
                    e.iter().zip(e.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>() / power
                } else {
                    0.0
                }
            },
        )
        .collect()
}

/// Ljung and Box (1978): probability that a white sequence has autocorrelations as large as this one's, `fitted`
/// numbers having been fitted to them.
#[must_use]
pub fn ljung_box(correlation: &[f64], count: usize, fitted: usize) -> f64 {
    let n = count as f64;
    if count <= correlation.len() + 1 {
        return 1.0;
    }
    let sum: f64 = correlation.iter().enumerate().map(|(k, r)| r * r / (n - (k + 1) as f64)).sum();
    chi_square_tail(n * (n + 2.0) * sum, correlation.len().saturating_sub(fitted))
}

/// Two-sided 95 % quantile of the standard normal distribution.
pub const Z_95: f64 = 1.959_963_984_540_054;

/// Two-sided 95 % quantile of Student's t with `degrees` of freedom.
fn t_95(degrees: f64) -> f64 {
    StudentsT::new(0.0, 1.0, degrees).map_or(f64::NAN, |t| t.inverse_cdf(0.975))
}

/// 95 % interval of a mean, mean ± t s/√n with Student's t; `None` below two samples.
#[must_use]
pub fn mean_ci95(samples: &[f64]) -> Option<(f64, f64)> {
    let half = t_95(samples.len() as f64 - 1.0) * standard_deviation(samples)? / (samples.len() as f64).sqrt();
    let mean = mean(samples)?;
    Some((mean - half, mean + half))
}

/// 95 % score interval (Wilson 1927) of a share of `hits` in `trials`; `None` without trials.
#[must_use]
pub fn wilson_ci95(hits: u64, trials: u64) -> Option<(f64, f64)> {
    if trials == 0 {
        return None;
    }
    let (n, p, z2) = (trials as f64, hits as f64 / trials as f64, Z_95 * Z_95);
    let centre = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = Z_95 / (1.0 + z2 / n) * (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
    Some(((centre - half).max(0.0), (centre + half).min(1.0)))
}

/// Degrees of freedom from which on the cube-root transformation of χ² is exact to 1e-6, and the incomplete gamma
/// function slow.
const MANY: f64 = 1.0e5;

/// Where the distribution function of χ² with `degrees` of freedom is `p`; NaN unless `degrees` is positive.
///
/// By bisection: `statrs` inverts it by a few steps of Newton's method, which leave 3e-6 with many degrees of freedom
/// and no number with one.
#[must_use]
pub fn chi_square_quantile(degrees: f64, p: f64) -> f64 {
    if degrees >= MANY {
        // Wilson and Hilferty (1931).
        let (c, z) = (2.0 / (9.0 * degrees), Normal::standard().inverse_cdf(p));
        return degrees * (1.0 - c + z * c.sqrt()).powi(3);
    }
    let Ok(distribution) = ChiSquared::new(degrees) else { return f64::NAN };
    let (mut low, mut high) = (0.0, 2.0 * degrees + 20.0);
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle = 0.5 * (low + high);
        if distribution.cdf(middle) < p { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// 95 % interval of the mean of `n` normalised squared innovations of a consistent filter: χ² with n degrees of freedom
/// over n; `None` for n = 0.
#[must_use]
pub fn nis_bounds95(n: u64) -> Option<(f64, f64)> {
    let of = |p: f64| chi_square_quantile(n as f64, p) / n as f64;
    (n > 0).then(|| (of(0.025), of(0.975)))
}

/// Probability that a chi-square variable with `degrees` of freedom exceeds `x`.
#[must_use]
pub fn chi_square_tail(x: f64, degrees: usize) -> f64 {
    if x.is_nan() || x <= 0.0 || degrees == 0 {
        return 1.0;
    }
    if x.is_finite() { gamma_ur(0.5 * degrees as f64, 0.5 * x) } else { 0.0 }
}

/// Probability that an F variable with `a` and `b` degrees of freedom exceeds `x`.
#[must_use]
pub fn f_tail(x: f64, a: f64, b: f64) -> f64 {
    if x.is_nan() || x <= 0.0 {
        return 1.0;
    }
    // Not by the distribution's own survival function: it loses the digits of a small b / (b + a x).
    beta_reg(0.5 * b, 0.5 * a, b / (b + a * x))
}

/// Probability that a Poisson variable of this mean is at least `hits`.
#[must_use]
pub fn poisson_tail(hits: usize, mean: f64) -> f64 {
    if hits == 0 { 1.0 } else { gamma_lr(hits as f64, mean) }
}

/// How large an error was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorSummary {
    /// How many samples.
    pub count: usize,
    /// Median, m.
    pub median_m: f64,
    /// 95th percentile, m.
    pub p95_m: f64,
    /// Maximum, m.
    pub max_m: f64,
    /// Root mean square, m.
    pub rms_m: f64,
}

impl ErrorSummary {
    /// Summary of error magnitudes, m; `None` without samples.
    #[must_use]
    pub fn of(errors_m: &[f64]) -> Option<Self> {
        let mut sorted = errors_m.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        Some(Self {
            count: sorted.len(),
            median_m: percentile_sorted(&sorted, 0.5)?,
            p95_m: percentile_sorted(&sorted, 0.95)?,
            max_m: *sorted.last()?,
            rms_m: rms(&sorted)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_percentiles_as_numpy() {
        // numpy.percentile([1, 2, 3, 4], [0, 25, 50, 95, 100])
        let samples = [4.0, 1.0, 3.0, 2.0];
        for (q, expected) in [(0.0, 1.0), (0.25, 1.75), (0.5, 2.5), (0.95, 3.85), (1.0, 4.0)] {
            let value = percentile(&samples, q).unwrap();
            assert!((value - expected).abs() < 1e-12, "{q}: {value}"); // rounding of one product
        }
    }

    #[test]
    fn val_student_t_as_in_tables() {
        // Abramowitz and Stegun, Table 26.10, to its three decimals.
        for (degrees, expected) in [(1.0, 12.706), (3.0, 3.182), (4.0, 2.776), (9.0, 2.262), (29.0, 2.045)] {
            assert!((t_95(degrees) - expected).abs() < 6e-4, "{degrees}: {}", t_95(degrees));
        }
    }

    #[test]
    fn nothing_in_nothing_out() {
        assert_eq!(percentile(&[], 0.5), None);
        assert_eq!(mean(&[]), None);
        assert_eq!(rms(&[]), None);
        assert_eq!(standard_deviation(&[1.0]), None);
        assert_eq!(ErrorSummary::of(&[]), None);
        assert_eq!(wilson_ci95(0, 0), None);
        assert_eq!(nis_bounds95(0), None);
    }

    #[test]
    fn val_spread() {
        let samples = [1.0, 2.0, 3.0, 4.0, 5.0];
        assert_eq!(standard_deviation(&samples), Some(2.5_f64.sqrt()));
        let (lo, hi) = mean_ci95(&samples).unwrap();
        // Student's t of four degrees, to the three decimals of the table.
        assert!((hi - lo - 2.0 * 2.776 * 0.5_f64.sqrt()).abs() < 1e-3);
        assert_eq!(rms(&[3.0, -3.0]), Some(3.0));
    }

    #[test]
    fn val_wilson() {
        // Textbook: 8 of 10 gives 0.4902 to 0.9433 (R: prop.test(8, 10, correct = FALSE)).
        let (lo, hi) = wilson_ci95(8, 10).unwrap();
        assert!((lo - 0.490_16).abs() < 1e-4 && (hi - 0.943_32).abs() < 1e-4, "{lo} {hi}"); // digits of the print
        assert_eq!(wilson_ci95(0, 5).unwrap().0, 0.0);
        assert_eq!(wilson_ci95(5, 5).unwrap().1, 1.0);
    }

    #[test]
    fn val_nis_bounds() {
        // χ² table: 95 % of a χ²(100) lies in 74.222..129.561, of a χ²(10) in 3.247..20.483.
        for (n, lo, hi) in [(100, 0.742_22, 1.295_61), (10, 0.3247, 2.0483)] {
            let bounds = nis_bounds95(n).unwrap();
            // Tolerance: the last digit of the table.
            assert!((bounds.0 - lo).abs() < 6e-5 && (bounds.1 - hi).abs() < 6e-5, "{n}: {bounds:?}");
        }
    }

    #[test]
    fn val_chi_square_tail_as_in_tables() {
        // Abramowitz and Stegun, Table 26.8: upper 5 % and 0.1 % points, to their digits.
        for (degrees, five, thousandth) in [
            (1, 3.841_46, 10.827_6),
            (2, 5.991_46, 13.815_5),
            (3, 7.814_73, 16.266_2),
            (5, 11.070_5, 20.515),
            (6, 12.591_6, 22.457_7),
        ] {
            assert!((chi_square_tail(five, degrees) / 0.05 - 1.0).abs() < 1e-4, "{degrees}");
            assert!((chi_square_tail(thousandth, degrees) / 1e-3 - 1.0).abs() < 1e-3, "{degrees}");
        }
        // The tail of two degrees is exp(-x/2), however small.
        assert!((chi_square_tail(600.0, 2) / (-300.0_f64).exp() - 1.0).abs() < 1e-10);
    }

    #[test]
    fn val_f_tail_as_in_tables() {
        // Abramowitz and Stegun, Table 26.9: upper 5 % and 0.1 % points of F(a, b), to their digits.
        for (a, b, five, thousandth) in [(1.0, 10.0, 4.96, 21.04), (2.0, 20.0, 3.49, 9.95), (3.0, 60.0, 2.76, 6.17)] {
            assert!((f_tail(five, a, b) / 0.05 - 1.0).abs() < 5e-3, "{a} {b}: {}", f_tail(five, a, b));
            assert!((f_tail(thousandth, a, b) / 1e-3 - 1.0).abs() < 5e-3, "{a} {b}");
        }
        // F(2, b) has the tail (b / (b + 2 x))^(b/2).
        let closed = (1000.0_f64 / 1040.0).powf(500.0);
        assert!((f_tail(20.0, 2.0, 1000.0) / closed - 1.0).abs() < 1e-9);
    }

    #[test]
    fn val_poisson_tail_by_hand() {
        // P(X >= 2) = 1 - e^-m (1 + m).
        assert!((poisson_tail(2, 1.0) - (1.0 - 2.0 * (-1.0_f64).exp())).abs() < 1e-12);
        assert_eq!(poisson_tail(0, 1.0), 1.0);
    }

    #[test]
    fn val_chi_square_quantiles_are_those_of_tables() {
        // R: qchisq(c(.025, .975), n). The last digit printed is rounded.
        for (degrees, low, high) in
            [(1.0, 0.000_982_069, 5.023_886), (12.0, 4.403_789, 23.336_66), (100.0, 74.221_93, 129.5612)]
        {
            let [a, b] = [0.025, 0.975].map(|p| chi_square_quantile(degrees, p));
            assert!((a / low - 1.0).abs() < 1e-6 && (b / high - 1.0).abs() < 1e-6, "{degrees} {a} {b}");
        }
        // The transformation takes over without a step: one degree more moves the quantile by 1e-5 of itself.
        let [exact, cubed] = [MANY - 1.0, MANY + 1.0].map(|degrees| chi_square_quantile(degrees, 0.975) / degrees);
        assert!((exact - cubed).abs() < 1e-6, "{exact} {cubed}");
    }

    #[test]
    fn summary() {
        let s = ErrorSummary::of(&[3.0, 1.0, 2.0]).unwrap();
        assert_eq!((s.count, s.median_m, s.max_m), (3, 2.0, 3.0));
        assert!((s.p95_m - 2.9).abs() < 1e-12); // rounding
    }
}
