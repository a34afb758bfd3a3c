//! The gate, and how a source that was locked out comes back.
//!
//! A measurement is judged as a whole: if its worst scalar lies beyond `gate_sigma` of its own
//! innovation sigmas, before any of its scalars is used, none is used. One axis that is absurd is reason to
//! distrust the others of the same instant.
//!
//! After a long outage, or when the model was wrong for a while, it is the filter that is wrong,
//! and good measurements would be rejected for ever. A source comes back when at least
//! [`AGREEING`] measurements in a row, over at least [`AGREEING_US`], were rejected and each agreed with its
//! predecessor: their innovations differ by less than the gate allows two sensor noises, plus half of the
//! predecessor (the estimate drifts and the geometry turns meanwhile). Outliers do not agree with one
//! another; a source that is wrong by a steady amount does, and comes back too: nothing inside
//! the filter can tell it from a filter that is wrong.
//! Coming back, the sigmas of the states that the source positions (and of their clones) are scaled by the
//! smallest common factor that makes the innovation a one-sigma event. Correlation coefficients stay, so the
//! covariance stays positive definite, states correlated with the error are corrected with it, and
//! directions the source did not see are doubted as much. A sigma above [`largest_sigma`] is not
//! believed and the source stays out.

use super::observation::Observation;
use super::{Sensor, wrap_innovation};

/// Rejections in a row that agree before a source comes back.
const AGREEING: u32 = 5;
/// Time they span at least, µs: a DVL on a fish, or a depth cell in a wave, is over by then.
const AGREEING_US: u64 = 10_000_000;

/// Largest sigma that a returning source may give to a state that it positions, in the state's unit.
/// A torpedo's speed is known better than 0.3 m/s without any sensor, and an estimate thrown into reverse flow would
/// not come back.
pub(super) fn largest_sigma(sensor: Sensor) -> f64 {
    match sensor {
        Sensor::Depth => 20.0,
        Sensor::Attitude => 0.5,
        Sensor::Rates => 0.2,
        Sensor::BottomTrack | Sensor::WaterTrack | Sensor::RangeRate => 0.3,
        Sensor::VehicleGnss | Sensor::ShipGnss | Sensor::Range => 5.0e3,
    }
}

#[derive(Clone, Copy)]
struct Source {
    consecutive: u32,
    recoveries: u32,
    agreeing: u32,
    since_us: u64,
    last: [f64; 3],
}

impl Source {
    const NEW: Self = Self { consecutive: 0, recoveries: 0, agreeing: 0, since_us: 0, last: [0.0; 3] };
}

/// What the gate remembers of each sensor.
pub(super) struct Gate {
    /// Of the measurement under way, in sigmas.
    pub(super) sigma: f64,
    sources: [Source; Sensor::ALL.len()],
}

impl Gate {
    pub(super) const fn new() -> Self {
        Self { sigma: 0.0, sources: [Source::NEW; Sensor::ALL.len()] }
    }

    pub(super) fn consecutive(&self, sensor: Sensor) -> u32 {
        self.sources[sensor as usize].consecutive
    }

    pub(super) fn recoveries(&self, sensor: Sensor) -> u32 {
        self.sources[sensor as usize].recoveries
    }

    /// A measurement was used.
    pub(super) fn accepted(&mut self, sensor: Sensor) {
        let source = &mut self.sources[sensor as usize];
        source.consecutive = 0;
        source.agreeing = 0;
    }

    /// A source came back.
    pub(super) fn recovered(&mut self, sensor: Sensor) {
        let source = &mut self.sources[sensor as usize];
        source.recoveries = source.recoveries.saturating_add(1);
    }

    /// A measurement lies beyond the gate; says whether its source has earned its way back.
    pub(super) fn rejected(&mut self, sensor: Sensor, time_us: u64, observations: &[Observation]) -> bool {
        let gate_sigma = self.sigma;
        let source = &mut self.sources[sensor as usize];
        let agrees = source.agreeing > 0
            && observations.iter().zip(&source.last).all(|(observation, last)| {
                let noise = gate_sigma * libm::sqrt(2.0 * observation.variance);
                wrap_innovation(sensor, observation.innovation - last).abs() <= noise + 0.5 * last.abs()
            });
        source.consecutive = source.consecutive.saturating_add(1);
        if agrees {
            source.agreeing = source.agreeing.saturating_add(1);
        } else {
            source.agreeing = 1;
            source.since_us = time_us;
        }
        for (last, observation) in source.last.iter_mut().zip(observations) {
            *last = observation.innovation;
        }
        source.agreeing >= AGREEING && time_us.saturating_sub(source.since_us) >= AGREEING_US
    }
}
