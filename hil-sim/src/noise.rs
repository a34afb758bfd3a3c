//! Spectra of noise: none, white, or a share of it a first-order Gauss-Markov process.

use crate::rng::{Source, Stream};
use serde::Deserialize;

/// Spectra of the noise of sensors and disturbance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NoiseKind {
    /// White, as the vehicle file declares it.
    #[default]
    White,
    /// None at all: what the physics alone would show. The ship still wanders, which is motion.
    Off,
    /// Partly correlated in time, of the declared size ([`Colour`]).
    Coloured,
}

/// Which part of a noise is coloured, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Colour {
    /// Share of the variance (of the power density at low frequency, for a disturbance) that is a Gauss-Markov
    /// process; the rest stays white.
    pub share: f64,
    /// Time constant of the process, s.
    pub tau_s: f64,
}

/// The coloured part of each sensor's noise: settling filters of an attitude reference, beam noise smoothed over
/// pings, waves in a pressure port, multipath of a GNSS receiver. Modest: a tenth of the variance.
impl Colour {
    /// Attitude and rates.
    pub const AHRS: Self = Self { share: 0.1, tau_s: 3.0 };
    /// Doppler log.
    pub const DVL: Self = Self { share: 0.1, tau_s: 1.0 };
    /// Depth.
    pub const DEPTH: Self = Self { share: 0.1, tau_s: 5.0 };
    /// GNSS.
    pub const GNSS: Self = Self { share: 0.1, tau_s: 20.0 };
    /// Disturbing acceleration.
    pub const DISTURBANCE: Self = Self { share: 0.5, tau_s: 1.0 };
}

impl NoiseKind {
    /// Factor on every standard deviation.
    #[must_use]
    pub fn factor(self) -> f64 {
        if self == Self::Off { 0.0 } else { 1.0 }
    }

    /// This colour, if noise is coloured at all.
    #[must_use]
    pub fn colour(self, colour: Colour) -> Option<Colour> {
        (self == Self::Coloured).then_some(colour)
    }
}

/// Adds the coloured part to white numbers.
#[derive(Clone, Debug)]
pub struct Colouring<const N: usize> {
    colour: Colour,
    random: Stream,
    state: [f64; N],
    last_us: Option<u64>,
}

impl<const N: usize> Colouring<N> {
    /// A stationary process of its own random numbers.
    #[must_use]
    pub fn new(colour: Colour, seed: u64, source: Source) -> Self {
        let mut random = Stream::new(seed, source);
        let state = random.normals(1.0);
        Self { colour, random, state, last_us: None }
    }

    /// Of white numbers of variance σ², numbers of the same variance, a share of it coloured.
    pub fn mix(&mut self, white: [f64; N], sigma: f64, time_us: u64) -> [f64; N] {
        self.mix_axes(white, [sigma; N], time_us)
    }

    /// The same of numbers with a standard deviation each.
    pub fn mix_axes(&mut self, white: [f64; N], sigma: [f64; N], time_us: u64) -> [f64; N] {
        let dt_s = self.last_us.map_or(0.0, |last| (time_us - last) as f64 * 1e-6);
        self.last_us = Some(time_us);
        let kept = libm::exp(-dt_s / self.colour.tau_s);
        let fresh = (1.0 - kept * kept).sqrt();
        for state in &mut self.state {
            *state = kept * *state + fresh * self.random.normal();
        }
        let (plain, coloured) = ((1.0 - self.colour.share).sqrt(), self.colour.share.sqrt());
        core::array::from_fn(|i| plain * white[i] + coloured * sigma[i] * self.state[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_variance_is_kept_and_correlation_is_that_of_the_process() {
        let colour = Colour { share: 0.4, tau_s: 0.5 };
        let mut colouring = Colouring::<1>::new(colour, 3, Source::DvlColour);
        let mut white = Stream::new(3, Source::Dvl);
        let sigma = 0.1;
        let x: Vec<f64> = (0..40_000).map(|k| colouring.mix(white.normals(sigma), sigma, 200_000 * k)[0]).collect();
        let product = |lag: usize| x.iter().zip(&x[lag..]).map(|(a, b)| a * b).sum::<f64>() / x.len() as f64;
        // Standard error of a second moment of 40 000 weakly correlated numbers: about 1 %; four of them.
        assert!((product(0) / (sigma * sigma) - 1.0).abs() < 0.04);
        let expected = 0.4 * libm::exp(-0.2 / 0.5);
        assert!((product(1) / (sigma * sigma) - expected).abs() < 0.04);
    }
}
