//! One symmetric low-pass filter for all that enters the regressor, and the delay that it costs.
//!
//! Noise in the regressor biases the drags: |v| v of a noisy v does not average out. A symmetric filter delays every
//! frequency alike, so what happened at once stays simultaneous. Fins and propeller pass through the same filter as v and s:
//! linear relations between them survive any filter that they share, while unfiltered fins would move a vehicle that hardly
//! answers to them. With filtered fins the error in predicted roll is half as large, and needs no luck with the cut-off.

use crate::dynamics::ActuatorInput;
use core::f64::consts::PI;
use nalgebra::{Vector3, Vector6};

/// Taps to either side of the middle: the delay in samples.
pub const DELAY: usize = 20;
/// Length of the filters.
const TAPS: usize = 2 * DELAY + 1;

/// One instant of what the identifier is given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Time, µs.
    pub time_us: u64,
    /// Body velocity through the water, m/s and rad/s.
    pub velocity: Vector6<f64>,
    /// s = Rᵀ e3.
    pub down: Vector3<f64>,
    /// Fins and propeller.
    pub input: ActuatorInput,
}

const NOTHING: Measured = Measured {
    time_us: 0,
    velocity: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    down: Vector3::new(0.0, 0.0, 0.0),
    input: ActuatorInput { propeller_radps: 0.0, fins_rad: [0.0; 4] },
};

/// Half of a symmetric filter: weight of the middle and of the pairs around it; unit gain at rest.
#[derive(Clone, Copy)]
struct Taps([f64; DELAY + 1]);

impl Taps {
    /// Lets nothing pass; all bytes zero.
    const NONE: Self = Self([0.0; DELAY + 1]);

    /// Sinc with a Hamming window, half amplitude at `cutoff` (in units of the sample rate).
    fn low_pass(cutoff: f64) -> Self {
        let mut weights = [2.0 * cutoff; DELAY + 1];
        let mut sum = weights[0];
        for k in 1..=DELAY {
            let x = k as f64;
            let window = 0.54 + 0.46 * libm::cos(PI * x / DELAY as f64);
            weights[k] = window * libm::sin(2.0 * PI * cutoff * x) / (PI * x);
            sum += 2.0 * weights[k];
        }
        Self(weights.map(|weight| weight / sum))
    }
}

/// Filters v, s, fins and propeller; the result lies [`DELAY`] samples back.
pub struct PreFilter {
    taps: Taps,
    /// The inputs are held from sample to sample.
    held: bool,
    last_input: Option<ActuatorInput>,
    window: [Measured; TAPS],
    /// Where the next sample goes, which is where the oldest stands.
    next: usize,
    filled: usize,
}

impl PreFilter {
    /// Lets nothing pass; see [`Self::configure`].
    #[must_use]
    pub const fn new() -> Self {
        Self { taps: Taps::NONE, held: false, last_input: None, window: [NOTHING; TAPS], next: 0, filled: 0 }
    }

    /// Sets the cut-off, in units of the sample rate (below one half), and empties the window.
    ///
    /// `held`: a sample's input is what fins and propeller do from then on until the next, as commands are. Its value *at* the
    /// sample is then taken as the mean of before and after; taken as the command itself it would act half a period
    /// early, which costs ten times in the predicted motion. Otherwise inputs are samples of a continuous signal.
    pub fn configure(&mut self, cutoff: f64, held: bool) {
        self.taps = Taps::low_pass(cutoff);
        self.held = held;
        self.restart();
    }

    /// How much of white noise passes, as a ratio of standard deviations.
    #[must_use]
    pub fn noise_gain(&self) -> f64 {
        let squares = self.taps.0.map(|tap| tap * tap);
        let middle = squares.first().copied().unwrap_or(0.0);
        libm::sqrt(2.0 * squares.iter().sum::<f64>() - middle)
    }

    /// Empties the window.
    pub fn restart(&mut self) {
        self.filled = 0;
        self.last_input = None;
    }

    /// Takes a sample; gives the filtered one of [`DELAY`] samples ago once the window is full.
    pub fn push(&mut self, sample: &Measured) -> Option<Measured> {
        let mut entry = *sample;
        if let Some(before) = self.last_input.replace(sample.input)
            && self.held
        {
            entry.input.propeller_radps = 0.5 * (before.propeller_radps + sample.input.propeller_radps);
            for (fin, before) in entry.input.fins_rad.iter_mut().zip(before.fins_rad) {
                *fin = 0.5 * (*fin + before);
            }
        }
        if let Some(oldest) = self.window.get_mut(self.next) {
            *oldest = entry;
        }
        self.next = if self.next + 1 < TAPS { self.next + 1 } else { 0 };
        self.filled = (self.filled + 1).min(TAPS);
        if self.filled < TAPS {
            return None;
        }
        let (recent, old) = self.window.split_at_checked(self.next)?;
        let mut filtered = Measured { time_us: sample.time_us, ..NOTHING };
        // Oldest to newest.
        for (k, measured) in old.iter().chain(recent).enumerate() {
            let distance = k.abs_diff(DELAY);
            if distance == 0 {
                filtered.time_us = measured.time_us;
            }
            let tap = self.taps.0.get(distance).copied().unwrap_or(0.0);
            filtered.velocity += measured.velocity * tap;
            filtered.down += measured.down * tap;
            filtered.input.propeller_radps += measured.input.propeller_radps * tap;
            for (fin, measured) in filtered.input.fins_rad.iter_mut().zip(measured.input.fins_rad) {
                *fin += measured * tap;
            }
        }
        Some(filtered)
    }
}

impl Default for PreFilter {
    fn default() -> Self {
        Self::new()
    }
}
