//! Spectra of noise: none, white, or shares of it first-order Gauss-Markov processes.

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
    /// As sensors have it, drawn from the seed: size, one or two correlated parts, and in a data set steps of the
    /// readings, gaps and repeated readings as well ([`Mixture`]).
    Mixed,
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
    /// Ranges and directions by sound, whose paths change slowly: half of the variance.
    pub const ACOUSTIC: Self = Self { share: 0.5, tau_s: 60.0 };
    /// Disturbing acceleration.
    pub const DISTURBANCE: Self = Self { share: 0.5, tau_s: 1.0 };
}

impl NoiseKind {
    /// Factor on every standard deviation.
    #[must_use]
    pub fn factor(self) -> f64 {
        if self == Self::Off { 0.0 } else { 1.0 }
    }

    /// The disturbance's colour, if noise is coloured at all.
    #[must_use]
    pub fn disturbance(self) -> Option<Colour> {
        matches!(self, Self::Coloured | Self::Mixed).then_some(Colour::DISTURBANCE)
    }

    /// How the noise of a sensor is made up; `modest` is its colour where noise is [`NoiseKind::Coloured`].
    #[must_use]
    pub fn mixture(self, class: SensorClass, modest: Colour, seed: u64) -> Mixture {
        match self {
            Self::Off => Mixture { size: 0.0, ..Mixture::WHITE },
            Self::White => Mixture::WHITE,
            Self::Coloured => Mixture { colours: vec![modest], ..Mixture::WHITE },
            Self::Mixed => Mixture::drawn(class, seed),
        }
    }
}

/// Sensors whose noise is made up alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorClass {
    /// Roll, pitch, heading.
    Attitude,
    /// Body rates.
    Rates,
    /// Depth.
    Depth,
    /// Doppler log.
    Dvl,
    /// GNSS of the vehicle.
    Gnss,
    /// Ranges and directions by sound.
    Acoustic,
}

/// What the noise of one sensor is made up of.
#[derive(Clone, Debug, PartialEq)]
pub struct Mixture {
    /// Factor on the declared standard deviation.
    pub size: f64,
    /// Its correlated parts; the rest is white.
    pub colours: Vec<Colour>,
}

impl Mixture {
    /// As declared.
    const WHITE: Self = Self { size: 1.0, colours: Vec::new() };

    /// Of one seed: the class says how much is correlated and over what time.
    fn drawn(class: SensorClass, seed: u64) -> Self {
        // Largest share, time constants in s, and how often there is a second, slower part.
        let (share, taus_s, slow) = match class {
            SensorClass::Attitude => (0.8, [0.5, 5.0], 0.4),
            SensorClass::Rates => (0.3, [0.5, 3.0], 0.0),
            SensorClass::Depth => (0.7, [1.0, 20.0], 0.3),
            SensorClass::Dvl => (0.6, [0.5, 8.0], 0.2),
            SensorClass::Gnss | SensorClass::Acoustic => (0.8, [10.0, 60.0], 0.0),
        };
        let mut random = Stream::new(seed, Source::NoiseMixture);
        // A class has its own place in the stream, so that one says nothing of another.
        for _ in 0..8 * class as usize {
            random.uniform();
        }
        let mut between = |low: f64, high: f64| low * (high / low).powf(random.uniform());
        let size = between(0.8, 1.6);
        let first = Colour { share: between(0.1, share), tau_s: between(taus_s[0], taus_s[1]) };
        let second = Colour { share: between(0.05, 0.2), tau_s: between(10.0, 60.0) };
        let colours = if random.uniform() < slow { vec![first, second] } else { vec![first] };
        Self { size, colours }
    }

    /// The processes behind its correlated parts; `None` where all of it is white.
    pub fn colouring<const N: usize>(&self, seed: u64, source: Source) -> Option<Colouring<N>> {
        (!self.colours.is_empty()).then(|| Colouring::several(&self.colours, seed, source))
    }
}

/// Adds the coloured part to white numbers.
#[derive(Clone, Debug)]
pub struct Colouring<const N: usize> {
    parts: Vec<(Colour, [f64; N])>,
    random: Stream,
    last_us: Option<u64>,
}

impl<const N: usize> Colouring<N> {
    /// A stationary process of its own random numbers.
    pub fn new(colour: Colour, seed: u64, source: Source) -> Self {
        Self::several(&[colour], seed, source)
    }

    /// Several processes at once.
    #[must_use]
    pub fn several(colours: &[Colour], seed: u64, source: Source) -> Self {
        let mut random = Stream::new(seed, source);
        let parts = colours.iter().map(|colour| (*colour, random.normals(1.0))).collect();
        Self { parts, random, last_us: None }
    }

    /// Of white numbers of variance σ², numbers of the same variance, a share of it coloured.
    pub fn mix(&mut self, white: [f64; N], sigma: f64, time_us: u64) -> [f64; N] {
        self.mix_axes(white, [sigma; N], time_us)
    }

    /// The same of numbers with a standard deviation each.
    pub fn mix_axes(&mut self, white: [f64; N], sigma: [f64; N], time_us: u64) -> [f64; N] {
        let dt_s = self.last_us.map_or(0.0, |last| time_us.saturating_sub(last) as f64 * 1e-6);
        self.last_us = Some(time_us);
        let share: f64 = self.parts.iter().map(|(colour, _)| colour.share).sum();
        let mut mixed = white.map(|white| (1.0 - share).max(0.0).sqrt() * white);
        for (colour, state) in &mut self.parts {
            let kept = libm::exp(-dt_s / colour.tau_s);
            let fresh = (1.0 - kept * kept).sqrt();
            for (i, state) in state.iter_mut().enumerate() {
                *state = kept * *state + fresh * self.random.normal();
                mixed[i] += colour.share.sqrt() * sigma[i] * *state;
            }
        }
        mixed
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
