//! Tails of distributions and tests of whiteness.

use std::f64::consts::PI;

/// Probability that a chi-square variable with `degrees` of freedom exceeds `x` (closed forms of the incomplete gamma
/// function at whole and half arguments).
#[must_use]
pub fn chi2_tail(x: f64, degrees: usize) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let half = 0.5 * x;
    let (mut tail, mut term, mut k) = if degrees.is_multiple_of(2) {
        ((-half).exp(), (-half).exp(), 1.0)
    } else {
        (libm::erfc(half.sqrt()), (-half).exp() / (PI * half).sqrt(), 0.5)
    };
    let terms = if degrees.is_multiple_of(2) { degrees / 2 - 1 } else { degrees / 2 };
    for _ in 0..terms {
        term *= half / k;
        tail += term;
        k += 1.0;
    }
    tail.min(1.0)
}

/// Probability that an F variable with `a` and `b` degrees of freedom exceeds `x`.
#[must_use]
pub fn f_tail(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    beta(b / (b + a * x), 0.5 * b, 0.5 * a)
}

/// Regularised incomplete beta function I_x(a, b) by its continued fraction (Abramowitz and Stegun 26.5.8).
fn beta(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return if x <= 0.0 { 0.0 } else { 1.0 };
    }
    let front = (libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b) + a * x.ln() + b * (-x).ln_1p()).exp();
    // The fraction converges fast below the mean; beyond it the other tail does.
    if x < (a + 1.0) / (a + b + 2.0) {
        front * fraction(x, a, b) / a
    } else {
        1.0 - front * fraction(1.0 - x, b, a) / b
    }
}

/// The continued fraction, evaluated forward by Lentz's method.
fn fraction(x: f64, a: f64, b: f64) -> f64 {
    const TINY: f64 = 1e-300;
    const MOST_TERMS: u32 = 300;
    let guard = |value: f64| if value.abs() < TINY { TINY } else { value };
    let (mut c, mut d) = (1.0, 1.0 / guard(1.0 - (a + b) * x / (a + 1.0)));
    let mut h = d;
    for m in 1..=MOST_TERMS {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let before = h;
        for term in [even, odd] {
            d = 1.0 / guard(1.0 + term * d);
            c = guard(1.0 + term / c);
            h *= d * c;
        }
        if (h / before - 1.0).abs() < 1e-13 {
            break;
        }
    }
    h
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

/// Ljung and Box (1978): probability that a white sequence has autocorrelations as large as this one's.
#[must_use]
pub fn ljung_box(correlation: &[f64], count: usize) -> f64 {
    let n = count as f64;
    if count <= correlation.len() + 1 {
        return 1.0;
    }
    let sum: f64 = correlation.iter().enumerate().map(|(k, r)| r * r / (n - (k + 1) as f64)).sum();
    chi2_tail(n * (n + 2.0) * sum, correlation.len())
}

#[cfg(test)]
mod tests {
    use super::*;

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
            assert!((chi2_tail(five, degrees) / 0.05 - 1.0).abs() < 1e-4, "{degrees}");
            assert!((chi2_tail(thousandth, degrees) / 1e-3 - 1.0).abs() < 1e-3, "{degrees}");
        }
    }

    #[test]
    fn val_f_tail_as_in_tables() {
        // Abramowitz and Stegun, Table 26.9: upper 5 % and 0.1 % points of F(a, b), to their digits.
        for (a, b, five, thousandth) in [(1.0, 10.0, 4.96, 21.04), (2.0, 20.0, 3.49, 9.95), (3.0, 60.0, 2.76, 6.17)] {
            assert!((f_tail(five, a, b) / 0.05 - 1.0).abs() < 5e-3, "{a} {b}: {}", f_tail(five, a, b));
            assert!((f_tail(thousandth, a, b) / 1e-3 - 1.0).abs() < 5e-3, "{a} {b}");
        }
    }

    #[test]
    fn whiteness_is_told_from_colour() {
        // A fixed pseudo-random sequence, and the same summed over two.
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let white: Vec<f64> = (0..2000).map(|_| next()).collect();
        let coloured: Vec<f64> = white.windows(2).map(|w| w[0] + w[1]).collect();
        assert!(ljung_box(&autocorrelation(&white, 20), white.len()) > 0.01);
        assert!(ljung_box(&autocorrelation(&coloured, 20), coloured.len()) < 1e-6);
    }
}
