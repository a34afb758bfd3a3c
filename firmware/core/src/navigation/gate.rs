//! The gate, the doubt that a run of contradictions leaves, and how a source comes back.
//!
//! A measurement is judged as a whole: if its worst scalar lies beyond `gate_sigma` of its own innovation sigmas,
//! before any of its scalars is used, none is used. Beyond [`STRIKE`] of the gate (three sigmas of five) it is used,
//! but counts as a *strike*; what lies within ends the row of strikes.
//!
//! `strikes` strikes in a row, over at least [`STRIKES_US`], say that the source or the filter is wrong, and nobody
//! knows which: the source is **doubted**.
//!
//! - While it is, nothing of it is used, and the states that it positions are propagated with more noise: one sigma
//!   that grows by [`growth`] per second, the rate at which an undeclared cause may be leading the filter astray.
//!   How long the contradiction lasts decides what may be believed; that readings agree with each other does not.
//! - It comes back only when it is **consistent** with the covariance so propagated: a strike no more, as often in a row
//!   as it took to doubt it. If all of these would have been consistent without the doubt (they are used at once, they
//!   move little), the source was wrong for a while, and all is as before. If not, source and filter had told two
//!   stories and either may be true: the source is **contested**. It is used again, and the filter follows it; but the
//!   states that it positions are said to be no better known than [`CONTESTED`] of what the two differed by, so that
//!   three sigmas cover both stories. Of a position that is an addition to what the filter reports, for ranges have to
//!   triangulate; with the others it is a floor under P. What led the filter astray may still be there: of contested
//!   ranges the doubt goes on, beginning anew with each; the amount by which velocity or attitude is contested is a
//!   drift of the position, for as long as no position is measured.
//! - A fix confirms: it is the arbiter, contested by nothing once it is consistent, and after it every source is
//!   judged afresh.
//! - A doubted source that falls silent leaves the contradiction open: the states are from then on as uncertain as a
//!   contested source leaves them.

use super::Sensor;
use super::observation::Observation;

/// Share of the gate's variance beyond which a measurement is a strike: (3/5)², three sigmas of the default five.
pub(super) const STRIKE: f64 = 0.36;
/// A row of strikes lasts at least this long, µs: a DVL on a fish, or a depth cell in a wave, is over by then.
const STRIKES_US: u64 = 2_000_000;
/// Least sigma of what a contested source positions, by the difference: three of it cover that along one line of sight,
/// and a fifth more for what lay across.
const CONTESTED: f64 = 0.4;
/// Velocity over ground counts as measured for this long, µs.
const VELOCITY_US: u64 = 10_000_000;
/// What is left of a position's drift while a DVL with bottom lock is fused, m/s: 2 % of 1.5 m/s, by its scale and
/// the heading.
const DRIFT_WITH_DVL: f64 = 0.03;
/// Speed by which an error in heading moves the position, m/s: a torpedo's cruise.
const CRUISE_MPS: f64 = 1.5;

/// Growth of one sigma of what a doubted source positions, in the state's unit per second.
fn growth(sensor: Sensor) -> f64 {
    match sensor {
        // heave that trim or a wrong pitch makes
        Sensor::Depth => 0.1,
        // a turn that the model does not expect, 1 °/s: without a compass for long, nothing else is right either
        Sensor::Attitude | Sensor::Rates => 2.0e-2,
        // a drag or a thrust that changes by some percent a minute
        Sensor::BottomTrack | Sensor::WaterTrack | Sensor::RangeRate => 2.0e-3,
        // a current that is not declared, or a tide that has turned
        Sensor::Range => 0.15,
        // the same; but it is the one absolute reference, and the vehicle waits at the surface
        Sensor::VehicleGnss => 0.5,
        Sensor::ShipGnss => 1.0,
    }
}

/// Largest sigma that doubt gives to a state that a source positions, in the state's unit: beyond, a linearised filter
/// means nothing.
pub(super) fn largest_sigma(sensor: Sensor) -> f64 {
    match sensor {
        Sensor::Depth => 20.0,
        Sensor::Attitude => 0.5,
        Sensor::Rates => 0.2,
        Sensor::BottomTrack | Sensor::WaterTrack | Sensor::RangeRate => 0.5,
        Sensor::VehicleGnss | Sensor::ShipGnss | Sensor::Range => 5.0e3,
    }
}

/// After this time without a measurement a source is silent, µs.
fn silence_us(sensor: Sensor) -> u64 {
    match sensor {
        Sensor::Range | Sensor::RangeRate => 300_000_000,
        _ => 10_000_000,
    }
}

#[derive(Clone, Copy)]
struct Source {
    /// Strikes in a row, and the time of the first.
    strikes: u32,
    since_us: u64,
    /// The last strike, and the last measurement that was none (while anything is out of order).
    strike_us: u64,
    consistent_us: u64,
    doubted: bool,
    /// Measurements in a row that are consistent, and whether one of them is by the doubt alone.
    returning: u32,
    by_doubt: bool,
    /// Seconds that doubt, or the drift of what is contested, has grown for.
    grown_s: f64,
    /// Variance that doubt has added.
    added: f64,
    /// Innovation variance when the doubt began.
    variance: f64,
    /// Worst innovations of the row of strikes, by scalar.
    worst: [f64; 3],
    /// What a contested source leaves at least, one sigma by scalar; 0 when it is not contested.
    floor: [f64; 3],
    recoveries: u32,
}

impl Source {
    const NEW: Self = Self {
        strikes: 0,
        since_us: 0,
        strike_us: 0,
        consistent_us: 0,
        doubted: false,
        returning: 0,
        by_doubt: false,
        grown_s: 0.0,
        added: 0.0,
        variance: 0.0,
        worst: [0.0; 3],
        floor: [0.0; 3],
        recoveries: 0,
    };

    fn is_calm(&self) -> bool {
        self.strikes == 0 && !self.doubted && !self.is_contested()
    }

    fn is_contested(&self) -> bool {
        self.floor != [0.0; 3]
    }

    fn contest(&mut self, sensor: Sensor) {
        self.doubted = false;
        self.strikes = 0;
        (self.grown_s, self.added) = (0.0, 0.0);
        for (floor, worst) in self.floor.iter_mut().zip(&self.worst) {
            *floor = floor.max(CONTESTED * worst).min(largest_sigma(sensor));
        }
    }

    /// Growth of a variance over `step_s`: one sigma grows by `rate` per second.
    fn grow(&mut self, rate: f64, step_s: f64) -> f64 {
        let before_s = self.grown_s;
        self.grown_s += step_s;
        rate * rate * (self.grown_s * self.grown_s - before_s * before_s)
    }
}

/// Variance that a step adds for one source.
pub(super) struct Growth {
    /// To what the source positions.
    pub(super) positioned: f64,
    /// To the position.
    pub(super) drift: f64,
    /// What the source positions is at least this uncertain from now on; 0 for nothing new.
    pub(super) floor: [f64; 3],
}

/// What the gate remembers of each sensor.
pub(super) struct Gate {
    /// Of the measurement under way, in sigmas.
    pub(super) sigma: f64,
    /// Something is out of order with one source at least. The usual way asks no more than this.
    pub(super) alert: bool,
    sources: [Source; Sensor::ALL.len()],
}

impl Gate {
    pub(super) const fn new() -> Self {
        Self { sigma: 0.0, alert: false, sources: [Source::NEW; Sensor::ALL.len()] }
    }

    pub(super) fn is_doubted(&self, sensor: Sensor) -> bool {
        self.sources[sensor as usize].doubted
    }

    /// Since when a doubted source has contradicted the filter, µs.
    pub(super) fn doubted_since_us(&self, sensor: Sensor) -> Option<u64> {
        let source = &self.sources[sensor as usize];
        source.doubted.then_some(source.since_us)
    }

    /// One sigma by scalar that a contested source leaves at least; 0 when it is not contested.
    pub(super) fn floor(&self, sensor: Sensor) -> [f64; 3] {
        self.sources[sensor as usize].floor
    }

    pub(super) fn recoveries(&self, sensor: Sensor) -> u32 {
        self.sources[sensor as usize].recoveries
    }

    /// A strike by some innovations, of `variance` at most; with `most` of them in a row doubt begins.
    pub(super) fn strike(&mut self, sensor: Sensor, time_us: u64, items: &[Observation], variance: f64, most: u32) {
        let source = &mut self.sources[sensor as usize];
        if source.strikes == 0 {
            (source.since_us, source.worst) = (time_us, [0.0; 3]);
        }
        source.strikes = source.strikes.saturating_add(1);
        source.strike_us = time_us;
        for (worst, item) in source.worst.iter_mut().zip(items) {
            *worst = worst.max(item.innovation.abs());
        }
        (source.returning, source.by_doubt) = (0, false);
        let lasts = time_us.saturating_sub(source.since_us) >= STRIKES_US;
        if !source.doubted && lasts && source.strikes >= most {
            source.doubted = true;
            (source.grown_s, source.added, source.variance) = (0.0, 0.0, variance);
        }
        self.alert = true;
    }

    /// Innovation variance as it would be without the doubt.
    pub(super) fn undoubted(&self, sensor: Sensor, variance: f64) -> f64 {
        let source = &self.sources[sensor as usize];
        source.variance.max(variance - source.added)
    }

    /// A measurement that is no strike; `alone`: without the doubt it would not have been one either. Says whether it is
    /// used; a doubted source is taken back by `most` of them in a row.
    pub(super) fn consistent(&mut self, sensor: Sensor, time_us: u64, alone: bool, most: u32) -> bool {
        let source = &mut self.sources[sensor as usize];
        if source.doubted {
            // it is not silent
            source.strike_us = time_us;
            source.returning = source.returning.saturating_add(1);
            source.by_doubt |= !alone;
            if !source.by_doubt {
                (source.grown_s, source.added) = (0.0, 0.0);
            }
            if source.returning < most {
                return !source.by_doubt;
            }
            source.doubted = false;
            source.recoveries = source.recoveries.saturating_add(1);
            // the ship's own receiver is its arbiter
            if source.by_doubt && sensor != Sensor::ShipGnss {
                source.contest(sensor);
            }
        }
        source.consistent_us = time_us;
        source.strikes = 0;
        match sensor {
            Sensor::VehicleGnss => {
                for source in &mut self.sources {
                    (source.doubted, source.floor) = (false, [0.0; 3]);
                }
            }
            // the drift begins again where the position was measured
            Sensor::Range => {
                for source in self.sources.iter_mut().filter(|source| !source.doubted) {
                    (source.grown_s, source.added) = (0.0, 0.0);
                }
            }
            _ => {}
        }
        self.alert = !self.sources.iter().all(Source::is_calm);
        true
    }

    /// What a step of the prediction adds for one source.
    pub(super) fn grow(&mut self, sensor: Sensor, time_us: u64, step_s: f64) -> Growth {
        let bottom = &self.sources[Sensor::BottomTrack as usize];
        let measured = !bottom.doubted && !bottom.is_contested() && time_us < bottom.consistent_us + VELOCITY_US;
        let source = &mut self.sources[sensor as usize];
        let mut growth = Growth { positioned: 0.0, drift: 0.0, floor: [0.0; 3] };
        if source.doubted && time_us.saturating_sub(source.strike_us) > silence_us(sensor) {
            source.contest(sensor);
            growth.floor = source.floor;
        }
        let contested = source.is_contested();
        let floor = source.floor.into_iter().fold(0.0, f64::max);
        match sensor {
            // what led the filter astray may still do so
            _ if source.doubted || (contested && sensor == Sensor::Range) => {
                let rate = if sensor == Sensor::Range && measured { DRIFT_WITH_DVL } else { self::growth(sensor) };
                growth.positioned = source.grow(rate, step_s);
                source.added += growth.positioned;
            }
            _ if !contested => {}
            Sensor::BottomTrack | Sensor::WaterTrack | Sensor::RangeRate => {
                growth.drift = source.grow(floor, step_s);
            }
            // the heading's
            Sensor::Attitude => growth.drift = source.grow(source.floor[2] * CRUISE_MPS, step_s),
            _ => {}
        }
        growth
    }
}
