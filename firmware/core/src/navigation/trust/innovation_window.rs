//! Windowed tests of one source: are its innovations larger than the filter says, or biased?
//!
//! Over a window the mean of ν² is compared with the mean of S. Their ratio, times the number N of innovations, is χ²
//! with N degrees of freedom as long as filter and source are what they say. The window forgets exponentially with a
//! time constant τ, so that it needs no memory of its own; N is that of the weights, 1 / Σ w².
//!
//! The limit is the χ² quantile by Wilson and Hilferty (PNAS 17, 1931): N (1 − 2/(9 N) + z √(2/(9 N)))³, with
//! [`LEVEL`] z exceeded in one window of a thousand. The mean of ν has the variance S / N, and the same z makes it
//! significant. A dive of three hours has 40 windows of nine ranges: a false alarm in one dive of ten, and all it does is
//! to enlarge a sigma.

/// z of one in a thousand.
const LEVEL: f64 = 3.09;

/// An exponentially forgetting window over one scalar.
#[derive(Clone, Copy)]
pub(crate) struct Window {
    /// Means of ν, ν² and S.
    mean: f64,
    square: f64,
    variance: f64,
    /// Σ w² of the weights; N = 1 / Σ w².
    weights: f64,
    count: u16,
    last_us: u64,
}

impl Window {
    pub(crate) const NEW: Self = Self { mean: 0.0, square: 0.0, variance: 0.0, weights: 0.0, count: 0, last_us: 0 };

    /// Takes an innovation and its S. The first ones have equal weights.
    pub(crate) fn take(&mut self, tau_s: f64, time_us: u64, innovation: f64, variance: f64) {
        let since_s = 1.0e-6 * time_us.saturating_sub(self.last_us) as f64;
        self.last_us = time_us;
        self.count = self.count.saturating_add(1);
        let share = (since_s / (tau_s + since_s)).max(1.0 / f64::from(self.count));
        let rest = 1.0 - share;
        self.mean += share * (innovation - self.mean);
        self.square += share * (innovation * innovation - self.square);
        self.variance += share * (variance - self.variance);
        self.weights = if self.count == 1 { 1.0 } else { rest * rest * self.weights + share * share };
    }

    /// Mean of ν² that S does not explain, or the square of the mean of ν, whichever test is exceeded; else 0.
    pub(crate) fn excess(&self) -> f64 {
        let square = self.mean * self.mean;
        let biased = self.count > 1 && square > LEVEL * LEVEL * self.weights * self.variance;
        self.chi_square().max(if biased { square } else { 0.0 })
    }

    /// Mean of ν² that S does not explain, if the test is exceeded; else 0.
    fn chi_square(&self) -> f64 {
        let spread = 2.0 / 9.0 * self.weights;
        let root = 1.0 - spread + LEVEL * libm::sqrt(spread);
        let most = root * root * root;
        if self.count > 1 && self.square > most * self.variance { self.square - self.variance } else { 0.0 }
    }

    /// The same of what alternates about zero, as waves do: 0 where the mean is significant by the same level, and where
    /// the window is too short to find a mean as large as the root of the mean square for certain (N < 2 z²).
    pub(crate) fn alternating(&self) -> f64 {
        let short = 2.0 * LEVEL * LEVEL * self.weights > 1.0;
        let biased = self.mean * self.mean > LEVEL * LEVEL * self.weights * self.square;
        if short || biased { 0.0 } else { self.chi_square() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Uniform numbers of unit variance: their squares are less heavy-tailed than the normal's, so the factors below
    /// have nothing to do with the tail.
    fn noise(random: &mut Random) -> f64 {
        random.within(libm::sqrt(3.0))
    }

    #[test]
    fn val_a_matched_source_is_no_excess_and_a_mismatched_one_is() {
        let (mut window, mut random) = (Window::NEW, Random(7));
        // 67 windows, each exceeds one of two tests by one in a thousand and one in five hundred
        let mut exceeded = 0;
        for k in 0..20_000_u64 {
            window.take(30.0, 100_000 * k, noise(&mut random), 1.0);
            exceeded += u32::from(window.excess() > 0.0);
        }
        assert!(exceeded < 400, "{exceeded} of 20000 steps");
        for k in 20_000..22_000_u64 {
            window.take(30.0, 100_000 * k, 2.0 * noise(&mut random), 1.0);
        }
        // variance 4 of which S explains 1; N is 600, a standard deviation of 4 √(0.8 / 600) by the uniform's kurtosis
        assert!((window.excess() - 3.0).abs() < 0.6, "{}", window.excess());
    }

    /// A bias is an excess that does not alternate; a wave does.
    #[test]
    fn val_a_bias_does_not_alternate_and_a_wave_does() {
        let (mut bias, mut wave, mut random) = (Window::NEW, Window::NEW, Random(3));
        for k in 0..3000_u64 {
            let (time_us, time_s) = (200_000 * k, 0.2 * k as f64);
            bias.take(30.0, time_us, 3.0 + noise(&mut random), 1.0);
            wave.take(30.0, time_us, 3.0 * libm::sin(time_s) + noise(&mut random), 1.0);
        }
        assert!((bias.excess() - 9.0).abs() < 1.5 && bias.alternating() == 0.0, "{}", bias.excess());
        assert!((wave.alternating() - 4.5).abs() < 1.5, "{}", wave.alternating());
    }
}
