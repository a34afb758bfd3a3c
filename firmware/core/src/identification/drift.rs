//! Drift of the estimates against their own noise.
//!
//! A short mean of θ̂_j is compared with a long one. A difference of more than [`THRESHOLD`] standard deviations is a
//! drift: either the vehicle or its motion has changed. The long mean is then held until the short one has returned to
//! it.

use super::theta::{PARAMETERS, Theta};

/// Memory of the short mean, s.
const RECENT_S: f64 = 100.0;
/// Memory of the long mean and of the variance, s.
const REFERENCE_S: f64 = 1000.0;
/// No verdict before this time: the estimates still converge.
const SETTLED_S: f64 = 2000.0;
/// Standard deviations of a drift.
const THRESHOLD: f64 = 6.0;
/// In the variance, deviations are limited to this many standard deviations; otherwise a drift would mask itself.
const OUTLIER: f64 = 3.0;

/// One parameter's means.
#[derive(Clone, Copy)]
struct Trace {
    reference: f64,
    recent: f64,
    variance: f64,
    observed_s: f64,
}

/// Watches every parameter.
pub struct DriftMonitor {
    traces: [Trace; PARAMETERS],
}

impl Trace {
    const NEW: Self = Self { reference: 0.0, recent: 0.0, variance: 0.0, observed_s: 0.0 };

    fn score(&self) -> f64 {
        if self.observed_s < SETTLED_S || self.variance <= 0.0 {
            return 0.0;
        }
        (self.recent - self.reference) / libm::sqrt(self.variance)
    }

    fn observe(&mut self, value: f64, dt: f64) {
        self.observed_s += dt;
        self.recent += (value - self.recent) * (dt / self.observed_s.min(RECENT_S));
        let score = self.score().abs();
        if score > THRESHOLD {
            return;
        }
        let weight = dt / self.observed_s.min(REFERENCE_S);
        let deviation = self.recent - self.reference;
        let square = if score > OUTLIER { OUTLIER * OUTLIER * self.variance } else { deviation * deviation };
        self.reference += (value - self.reference) * weight;
        self.variance += (square - self.variance) * weight;
    }
}

impl DriftMonitor {
    /// Before the first sample.
    #[must_use]
    pub const fn new() -> Self {
        Self { traces: [Trace::NEW; PARAMETERS] }
    }

    /// Forgets everything.
    pub fn reset(&mut self) {
        self.traces = [Trace::NEW; PARAMETERS];
    }

    /// Takes θ̂ of one sample that stands for dt; parameters without gain are frozen and say nothing.
    pub fn observe(&mut self, theta: &Theta, gains: &Theta, dt: f64) {
        for j in 0..PARAMETERS {
            if gains[j] > 0.0 {
                self.traces[j].observe(theta[j], dt);
            }
        }
    }

    /// Short minus long mean in standard deviations; 0 before there are enough samples.
    #[must_use]
    pub fn scores(&self) -> Theta {
        Theta::from(self.traces.each_ref().map(Trace::score))
    }

    /// The parameters that drifted, bit j for θ_j.
    #[must_use]
    pub fn drifted(&self) -> u32 {
        self.traces.iter().enumerate().fold(
            0,
            |mask, (j, trace)| {
                if trace.score().abs() > THRESHOLD { mask | 1 << j } else { mask }
            },
        )
    }
}
