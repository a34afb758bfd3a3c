//! One symmetric low-pass filter for all signals of the regressor, with its delay.
//!
//! Noise in the regressor biases the drags: |v| v of a noisy v does not average out. A symmetric filter delays every
//! frequency alike, so simultaneous signals stay simultaneous. Fins and propeller pass through the same filter as v and
//! s: linear relations between them survive any filter that they share, while unfiltered fins would move a vehicle that
//! hardly answers to them.
//!
//! The filter fits a polynomial of fifth order to its window (Savitzky and Golay): of all filters that let such motion
//! pass as it is, nonlinear terms of it included, the one that lets the least white noise pass.

use crate::dynamics::ActuatorInput;
use nalgebra::{Vector3, Vector6};

/// Taps to either side of the middle: the delay in samples.
pub const DELAY: usize = 20;
/// Length of the filters.
const TAPS: usize = 2 * DELAY + 1;

/// Input of the identifier at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Time, µs.
    pub time_us: u64,
    /// Body velocity through the water, m/s and rad/s.
    pub velocity: Vector6<f64>,
    /// s = Rᵀ e3.
    pub down: Vector3<f64>,
    /// Fins and propeller: their mean since the sample before.
    pub input: ActuatorInput,
}

const NOTHING: Measured = Measured {
    time_us: 0,
    velocity: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    down: Vector3::new(0.0, 0.0, 0.0),
    input: ActuatorInput { propeller_radps: 0.0, fins_rad: [0.0; 4] },
};

/// Weight of the middle and of the pairs around it; their sum is 1.
const WEIGHTS: [f64; DELAY + 1] = {
    let m = DELAY as f64;
    let m2 = m * m;

    let scale = 3.75 / ((2.0 * m + 5.0) * (2.0 * m + 3.0) * (2.0 * m + 1.0) * (2.0 * m - 1.0) * (2.0 * m - 3.0));
    let constant = 15.0 * m2 * m2 + 30.0 * m2 * m - 35.0 * m2 - 50.0 * m + 12.0;
    let mut weights = [0.0; DELAY + 1];
    let mut k = 0;
    while k <= DELAY {
        let k2 = (k * k) as f64;
        weights[k] = scale * (constant - 35.0 * (2.0 * m2 + 2.0 * m - 3.0) * k2 + 63.0 * k2 * k2);
        k += 1;
    }
    weights
};

/// Filters v, s, fins and propeller; the result lies [`DELAY`] samples back.
pub struct PreFilter {
    window: [Measured; TAPS],
    /// Where the next sample goes, which is where the oldest stands.
    next: usize,
    filled: usize,
}

impl PreFilter {
    /// An empty window.
    #[must_use]
    pub const fn new() -> Self {
        Self { window: [NOTHING; TAPS], next: 0, filled: 0 }
    }

    /// Standard deviation of filtered white noise over that of the noise.
    #[must_use]
    pub fn noise_gain() -> f64 {
        let squares = WEIGHTS.map(|weight| weight * weight);
        let middle = squares.first().copied().unwrap_or(0.0);
        libm::sqrt(2.0 * squares.iter().sum::<f64>() - middle)
    }

    /// Empties the window.
    pub fn restart(&mut self) {
        self.filled = 0;
    }

    /// Takes a sample; gives the filtered one of [`DELAY`] samples ago once the window is full.
    pub fn push(&mut self, sample: &Measured) -> Option<Measured> {
        if let Some(oldest) = self.window.get_mut(self.next) {
            *oldest = *sample;
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
            let weight = WEIGHTS.get(distance).copied().unwrap_or(0.0);
            filtered.velocity += measured.velocity * weight;
            filtered.down += measured.down * weight;
            filtered.input.propeller_radps += measured.input.propeller_radps * weight;
            for (fin, measured) in filtered.input.fins_rad.iter_mut().zip(measured.input.fins_rad) {
                *fin += measured * weight;
            }
        }
        Some(filtered)
    }
}
