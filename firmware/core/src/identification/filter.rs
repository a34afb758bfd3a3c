//! Symmetric low-pass filters before the regressor, and the delay that they cost.
//!
//! Noise in the regressor biases the drags: |v| v of a noisy v does not average out. A symmetric filter delays every
//! frequency alike, so v, s, fins and propeller stay simultaneous when all are delayed by the filter's half length.

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

/// Half of a symmetric filter: weight of the middle and of the pairs around it; unit gain at rest.
#[derive(Clone, Copy)]
struct Taps([f64; DELAY + 1]);

impl Taps {
    const PASS: Self = {
        let mut weights = [0.0; DELAY + 1];
        weights[0] = 1.0;
        Self(weights)
    };

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

/// Filters v and s and delays the rest by [`DELAY`] samples.
pub struct PreFilter {
    velocity: Taps,
    down: Taps,
    window: [Measured; TAPS],
    /// Where the next sample goes, which is where the oldest stands.
    next: usize,
    filled: usize,
}

impl PreFilter {
    /// Passes everything; see [`Self::configure`].
    #[must_use]
    pub const fn new() -> Self {
        let nothing = Measured {
            time_us: 0,
            velocity: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            down: Vector3::new(0.0, 0.0, 0.0),
            input: ActuatorInput { propeller_radps: 0.0, fins_rad: [0.0; 4] },
        };
        Self { velocity: Taps::PASS, down: Taps::PASS, window: [nothing; TAPS], next: 0, filled: 0 }
    }

    /// Sets the cut-offs, in units of the sample rate (below one half), and empties the window.
    pub fn configure(&mut self, velocity_cutoff: f64, down_cutoff: f64) {
        self.velocity = Taps::low_pass(velocity_cutoff);
        self.down = Taps::low_pass(down_cutoff);
        self.restart();
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
        let (recent, old) = self.window.split_at(self.next);
        // Oldest to newest.
        let mut in_order = old.iter().chain(recent);
        let mut velocity = Vector6::zeros();
        let mut down = Vector3::zeros();
        let mut middle = *sample;
        for k in 0..TAPS {
            let Some(measured) = in_order.next() else { break };
            let tap = k.abs_diff(DELAY);
            velocity += measured.velocity * self.velocity.0[tap];
            down += measured.down * self.down.0[tap];
            if tap == 0 {
                middle = *measured;
            }
        }
        Some(Measured { velocity, down, ..middle })
    }
}

impl Default for PreFilter {
    fn default() -> Self {
        Self::new()
    }
}
