//! Innovation monitor: the gate, and what becomes of a source that contradicts the filter for longer than chance
//! allows.
//!
//! A measurement is judged as a whole, before any of its scalars is used. Beyond `gate_sigma` of the innovation's own
//! sigma it is refused. Beyond [`EXCEEDANCE`] of the gate (three sigmas of five) it is used and counted as an
//! *exceedance*; a smaller innovation ends the run of exceedances.
//!
//! `exceedances` of them in a row, over at least [`EXCEEDANCES_US`] (in waves [`WAVED_EXCEEDANCES_US`]), mean that the source or the filter is wrong. The
//! source is then **suspect**:
//!
//! - Nothing of it is used. One sigma of the states that it observes grows by [`growth`] per second, the rate at which
//!   an undeclared cause may lead the filter astray. The duration of the contradiction decides what may be believed,
//!   not the agreement of the readings among themselves. Where ranges are suspect, the filter estimates the current, and
//!   a current that has changed since the last range that agreed explains the contradiction within [`CURRENT`] sigmas,
//!   the sigma of the current grows instead, once. That of the position follows from it.
//! - It is used again once it has been **consistent** with the grown covariance as often in a row as it took to suspect
//!   it, and a velocity for as long as it contradicted ([`VELOCITY_DOUBT_US`]). If all of these would have been
//!   consistent without the growth, the source was wrong for a while and nothing remains. Otherwise the growth has to
//!   cover, of ranges and DVL, the worst innovation of the contradiction as well: a disagreement has one cause, and is
//!   not explained because the line of sight has turned across it. Source and filter then disagreed and either may have
//!   been right: the source is **unconfirmed**. The filter follows it, but the states that it observes keep a sigma of
//!   at least [`UNCONFIRMED`] of the disagreement.
//!   Of the position this is an addition to what the filter reports, because ranges have to triangulate; of other
//!   states it is a floor under P. After unconfirmed ranges the growth begins again with each range, unless the sigma of
//!   the current grew for them; an unconfirmed velocity or attitude lets the sigma of the position grow while nothing
//!   measures the position. Roll and pitch that contradict at the surface are no disagreement: the model has no surface
//!   and is no witness there.
//! - A fix of the surfaced vehicle confirms every source, unless ranges contradict: GNSS is one witness, not the judge.
//!   Ranges that have agreed for [`TURN_US`] without that growth confirm every source but the depth cell, of which they
//!   see little.
//! - As long as ranges agree, a suspect fix is the odd one out: nothing grows, and it stays out until it agrees. So is a
//!   DVL where the filter estimates the vehicle: a model that is taken as declared must not keep a good DVL out.
//! - A suspect source that falls silent becomes unconfirmed.
//!
//! What waves do to readings is in [`super::waves`].

use super::waves::Waves;
use crate::navigation::algebra::observation::Observation;
use crate::navigation::interface::measurement::Sensor;

/// Share of the gate's variance beyond which a measurement is an exceedance: (3/5)², three sigmas of the default five.
pub(crate) const EXCEEDANCE: f64 = 0.36;
/// A row of exceedances lasts at least this long, µs: a DVL on a fish is over by then.
const EXCEEDANCES_US: u64 = 2_000_000;
/// The same of a sensor whose readings waves move, µs: half a swell of 10 s.
const WAVED_EXCEEDANCES_US: u64 = 5_000_000;
/// No wave moves a reading further, m, m/s: from trough to crest of 1 m.
const LARGEST_WAVE: f64 = 1.0;
/// Least sigma of what an unconfirmed source positions, by the difference: three of it cover that along one line of
/// sight, and a fifth more for what lay across.
const UNCONFIRMED: f64 = 0.4;
/// Velocity over ground counts as measured for this long, µs.
const VELOCITY_US: u64 = 10_000_000;
/// A suspect velocity has to agree for as long as it contradicted, at most for this long, µs, and is not used before: in
/// a turn every velocity crosses every other for some seconds.
const VELOCITY_DOUBT_US: u64 = 30_000_000;
/// What is left of a position's drift while a DVL with bottom lock is fused, m/s: 2 % of 1.5 m/s, by its scale and
/// the heading.
const DRIFT_WITH_DVL: f64 = 0.03;
/// Speed by which an error in heading moves the position, m/s: a torpedo's cruise.
const CRUISE_MPS: f64 = 1.5;

/// A ship turns the line of sight in this time, µs: before, ranges see one direction only, and agree as well where the
/// difference is across it.
pub(crate) const TURN_US: u64 = 960_000_000;
/// A range that agreed no longer ago than this is a witness for the filter, µs: three ranges at one every 30 s.
const WITNESS_US: u64 = 100_000_000;

/// Growth of one sigma of what a suspect source positions, in the state's unit per second.
fn growth(sensor: Sensor) -> f64 {
    match sensor {
        // heave by trim or by a wrong pitch
        Sensor::Depth => 0.1,
        // an unmodelled turn, 1 °/s: without a compass for long, nothing else is right either
        Sensor::Attitude | Sensor::Rates => 2.0e-2,
        // drag or thrust that changes by some percent a minute
        Sensor::BottomTrack | Sensor::WaterTrack | Sensor::RangeRate => 2.0e-3,
        // an undeclared current, or a tide that has turned
        Sensor::Range => 0.15,
        // the same; but it is the one absolute reference, and the vehicle waits at the surface
        Sensor::VehicleGnss => 0.5,
        Sensor::ShipGnss => 1.0,
    }
}

fn is_velocity(sensor: Sensor) -> bool {
    matches!(sensor, Sensor::BottomTrack | Sensor::WaterTrack)
}

/// Largest sigma that suspicion gives to a state that a source positions, in the state's unit: beyond, a linearised
/// filter means nothing.
pub(crate) fn largest_sigma(sensor: Sensor) -> f64 {
    match sensor {
        Sensor::Depth => 20.0,
        Sensor::Attitude => 0.5,
        Sensor::Rates => 0.2,
        Sensor::BottomTrack | Sensor::WaterTrack | Sensor::RangeRate => 0.5,
        Sensor::VehicleGnss | Sensor::ShipGnss | Sensor::Range => 5.0e3,
    }
}

/// Sigmas within which a changed current explains the worst range. A clock's step of 0.1 s is ten.
const CURRENT: f64 = 3.0;
/// Largest sigma that suspicion gives to the current, m/s.
pub(crate) const LARGEST_CURRENT_MPS: f64 = 0.5;

/// After this time without a measurement a source is silent, µs.
fn silence_us(sensor: Sensor) -> u64 {
    match sensor {
        Sensor::Range | Sensor::RangeRate => 300_000_000,
        _ => 10_000_000,
    }
}

#[derive(Clone, Copy)]
struct Source {
    /// Exceedances in a row, and the time of the first.
    exceedances: u32,
    since_us: u64,
    /// Time of the last exceedance, and of the last other measurement (kept while a sensor is suspect or unconfirmed).
    exceedance_us: u64,
    consistent_us: u64,
    suspect: bool,
    /// Measurements in a row that are consistent, and whether one of them is by the suspicion alone.
    returning: u32,
    by_suspicion: bool,
    /// A suspect velocity has to agree for so much longer, µs.
    doubt_us: u64,
    /// Seconds that suspicion, or the drift of what is unconfirmed, has grown for.
    grown_s: f64,
    /// Variance that suspicion has added to what the source positions.
    added: f64,
    /// Variance that the drift of what is unconfirmed has added to the position.
    added_to_position: f64,
    /// Innovation variance when the suspicion began.
    variance: f64,
    /// A change of the current explains what made the source suspect.
    by_current: bool,
    /// The sigma of the current has grown for this suspicion.
    current_open: bool,
    /// Scalars that leave no doubt: of an attitude that contradicted at the surface, roll and pitch, and heading unless
    /// it contradicted itself. Of other sources none.
    excused: [bool; 3],
    /// Worst innovations of the row of exceedances, by scalar.
    worst: [f64; 3],
    /// Least one sigma by scalar while the source is unconfirmed; 0 otherwise.
    floor: [f64; 3],
    recoveries: u32,
}

impl Source {
    const NEW: Self = Self {
        exceedances: 0,
        since_us: 0,
        exceedance_us: 0,
        consistent_us: 0,
        suspect: false,
        returning: 0,
        by_suspicion: false,
        doubt_us: 0,
        grown_s: 0.0,
        added: 0.0,
        added_to_position: 0.0,
        variance: 0.0,
        by_current: false,
        current_open: false,
        excused: [false; 3],
        worst: [0.0; 3],
        floor: [0.0; 3],
        recoveries: 0,
    };

    fn is_calm(&self) -> bool {
        self.exceedances == 0 && !self.suspect && !self.is_unconfirmed()
    }

    fn is_unconfirmed(&self) -> bool {
        self.floor != [0.0; 3]
    }

    fn leave_unconfirmed(&mut self, sensor: Sensor) {
        self.suspect = false;
        self.exceedances = 0;
        self.grow_anew();
        for (floor, (worst, excused)) in self.floor.iter_mut().zip(self.worst.iter().zip(self.excused)) {
            if !excused {
                *floor = floor.max(UNCONFIRMED * worst).min(largest_sigma(sensor));
            }
        }
    }

    fn grow_anew(&mut self) {
        (self.grown_s, self.added, self.added_to_position) = (0.0, 0.0, 0.0);
    }

    /// Growth of a variance over `step_s`: one sigma grows by `rate` per second.
    fn grow(&mut self, rate: f64, step_s: f64) -> f64 {
        let before_s = self.grown_s;
        self.grown_s += step_s;
        rate * rate * (self.grown_s * self.grown_s - before_s * before_s)
    }
}

/// What a filter estimates beside the vehicle's motion.
#[derive(Clone, Copy)]
pub(crate) struct Estimated {
    /// The vehicle's parameters.
    pub(crate) vehicle: bool,
    pub(crate) current: bool,
}

/// Variance that a step adds for one source.
pub(crate) struct Growth {
    /// To what the source positions.
    pub(crate) positioned: f64,
    /// To the position.
    pub(crate) drift: f64,
    /// New floor under the sigma of the states that the source observes; 0: unchanged.
    pub(crate) floor: [f64; 3],
    /// To position and current of each axis: variances of both, and their covariance between them.
    pub(crate) current: [f64; 3],
}

/// What the gate remembers of each sensor. It is read through [`crate::navigation::Filter`].
#[derive(Clone)]
pub struct InnovationMonitor {
    /// Of the measurement under way, in sigmas.
    pub(crate) sigma: f64,
    /// At least one source is suspect or unconfirmed. In normal operation only this flag is read.
    pub(crate) alert: bool,
    /// When a range was last used, µs; 0: never.
    pub(crate) range_us: u64,
    /// Since when all ranges have agreed without the growth, µs; 0: the last one did not.
    agreed_us: u64,
    sources: [Source; Sensor::ALL.len()],
    pub(crate) waves: Waves,
}

impl InnovationMonitor {
    pub(crate) const fn new() -> Self {
        Self {
            sigma: 0.0,
            alert: false,
            range_us: 0,
            agreed_us: 0,
            sources: [Source::NEW; Sensor::ALL.len()],
            waves: Waves::CALM,
        }
    }

    /// Ranges agree with the filter at present, and nothing doubts them.
    fn is_witnessed(&self, time_us: u64) -> bool {
        self.range_us > 0
            && time_us < self.range_us.saturating_add(WITNESS_US)
            && self.sources[Sensor::Range as usize].is_calm()
    }

    /// Worst innovation of one scalar since a source began to contradict the filter.
    pub(crate) fn worst(&self, sensor: Sensor, axis: usize) -> f64 {
        self.sources[sensor as usize].worst.get(axis).copied().unwrap_or(0.0)
    }

    pub(crate) fn is_suspect(&self, sensor: Sensor) -> bool {
        self.sources[sensor as usize].suspect
    }

    /// Since when a suspect source has contradicted the filter, µs.
    pub(crate) fn suspect_since_us(&self, sensor: Sensor) -> Option<u64> {
        let source = &self.sources[sensor as usize];
        source.suspect.then_some(source.since_us)
    }

    /// One sigma by scalar that an unconfirmed source leaves at least; 0 when it is not unconfirmed.
    pub(crate) fn floor(&self, sensor: Sensor) -> [f64; 3] {
        self.sources[sensor as usize].floor
    }

    pub(crate) fn recoveries(&self, sensor: Sensor) -> u32 {
        self.sources[sensor as usize].recoveries
    }

    /// An exceedance: its innovations, and their largest `variance`. With `most` of them in a row suspicion begins.
    pub(crate) fn exceedance(
        &mut self,
        sensor: Sensor,
        time_us: u64,
        items: &[Observation],
        (variance, surfaced): (f64, bool),
        most: u32,
    ) {
        let source = &mut self.sources[sensor as usize];
        if source.exceedances == 0 {
            // what a rare range contradicts may have begun after the one before it
            let before_us = if sensor == Sensor::Range { self.range_us } else { 0 };
            let recent = before_us > 0 && time_us < before_us.saturating_add(WITNESS_US);
            (source.since_us, source.worst) = (if recent { before_us } else { time_us }, [0.0; 3]);
        }
        source.exceedances = source.exceedances.saturating_add(1);
        if source.suspect && is_velocity(sensor) {
            let since_us = time_us.saturating_sub(source.exceedance_us);
            source.doubt_us = source.doubt_us.saturating_add(since_us).min(VELOCITY_DOUBT_US);
        }
        source.exceedance_us = time_us;
        for (worst, item) in source.worst.iter_mut().zip(items) {
            *worst = worst.max(item.innovation.abs());
        }
        (source.returning, source.by_suspicion) = (0, false);
        if sensor == Sensor::Range {
            self.agreed_us = 0;
        }
        let is_wave = self.waves.move_readings(sensor) && source.worst.iter().all(|worst| *worst < LARGEST_WAVE);
        let least_us = if is_wave { WAVED_EXCEEDANCES_US } else { EXCEEDANCES_US };
        let lasts = time_us.saturating_sub(source.since_us) >= least_us;
        if !source.suspect && lasts && source.exceedances >= most {
            source.suspect = true;
            source.doubt_us = 0;
            source.grow_anew();
            (source.variance, source.current_open) = (variance, false);
            let [.., heading] = source.worst;
            let turned = heading * heading > EXCEEDANCE * self.sigma * self.sigma * variance;
            source.excused = if surfaced && sensor == Sensor::Attitude { [true, true, !turned] } else { [false; 3] };
            let carried = 1.0e-6 * time_us.saturating_sub(source.since_us) as f64 * growth(Sensor::Range);
            let [worst, ..] = source.worst;
            source.by_current = worst * worst <= CURRENT * CURRENT * (variance + carried * carried);
        }
        self.alert = true;
    }

    /// Innovation variance as it would be without the suspicion, of a range also without what unconfirmed sources add;
    /// `noise` is that of the reading.
    pub(crate) fn variance_without_suspicion(&self, sensor: Sensor, variance: f64, noise: f64) -> f64 {
        let source = &self.sources[sensor as usize];
        let added = if sensor == Sensor::Range {
            self.sources.iter().map(|source| source.added_to_position).sum::<f64>() + source.added
        } else {
            source.added
        };
        source.variance.max(noise).max(variance - added)
    }

    /// A range agrees; `alone`: without the growth it would have done so too. Ranges that keep on doing so confirm the
    /// others.
    fn range_agrees(&mut self, time_us: u64, alone: bool) {
        let goes_on = self.agreed_us > 0 && time_us < self.range_us.saturating_add(WITNESS_US);
        self.agreed_us = match (alone, goes_on) {
            (false, _) => 0,
            (true, false) => time_us.max(1),
            (true, true) => self.agreed_us,
        };
        if alone && goes_on && time_us >= self.agreed_us.saturating_add(TURN_US) {
            for (sensor, source) in Sensor::ALL.into_iter().zip(&mut self.sources) {
                if sensor != Sensor::Depth {
                    source.floor = [0.0; 3];
                }
            }
        }
    }

    /// A measurement that is no exceedance; `alone`: without the suspicion it would not have been one either;
    /// `believable`: nor would the worst of the contradiction be one now. Says whether it is used; a suspect source is
    /// taken back by `most` of them in a row.
    pub(crate) fn consistent(
        &mut self,
        sensor: Sensor,
        time_us: u64,
        (alone, believable): (bool, bool),
        most: u32,
    ) -> bool {
        let contested = self.is_suspect(Sensor::Range);
        let source = &mut self.sources[sensor as usize];
        if source.suspect {
            source.doubt_us = source.doubt_us.saturating_sub(time_us.saturating_sub(source.exceedance_us));
            // it is not silent
            source.exceedance_us = time_us;
            if !alone && !believable {
                (source.returning, source.by_suspicion) = (0, true);
                return false;
            }
            source.returning = source.returning.saturating_add(1);
            source.by_suspicion |= !alone;
            if !source.by_suspicion {
                source.grow_anew();
            }
            if source.returning < most || source.doubt_us > 0 {
                return !source.by_suspicion && source.doubt_us == 0;
            }
            source.suspect = false;
            source.recoveries = source.recoveries.saturating_add(1);
            // the ship's own receiver is its arbiter
            if source.by_suspicion && sensor != Sensor::ShipGnss {
                source.leave_unconfirmed(sensor);
                self.agreed_us = 0;
            }
        }
        source.consistent_us = time_us;
        source.exceedances = 0;
        match sensor {
            Sensor::VehicleGnss => {
                for source in self.sources.iter_mut().filter(|_| !contested) {
                    (source.suspect, source.floor) = (false, [0.0; 3]);
                }
                // the position was measured
                let range = &mut self.sources[Sensor::Range as usize];
                range.grow_anew();
            }
            // the drift begins again where the position was measured
            Sensor::Range => {
                self.range_agrees(time_us, alone);
                for source in self.sources.iter_mut().filter(|source| !source.suspect) {
                    source.grow_anew();
                }
            }
            _ => {}
        }
        self.alert = !self.sources.iter().all(Source::is_calm);
        true
    }

    /// What a step of the prediction adds for one source of a filter that estimates `estimated`.
    pub(crate) fn grow(&mut self, sensor: Sensor, time_us: u64, step_s: f64, estimated: Estimated) -> Growth {
        let bottom = &self.sources[Sensor::BottomTrack as usize];
        let measured =
            !bottom.suspect && !bottom.is_unconfirmed() && time_us < bottom.consistent_us.saturating_add(VELOCITY_US);
        // a DVL that contradicts would be taken back by the sigma of the current, and teach it
        let contradicts = bottom.suspect && time_us < bottom.exceedance_us.saturating_add(VELOCITY_US);
        let witnessed = self.is_witnessed(time_us);
        let source = &mut self.sources[sensor as usize];
        let mut growth = Growth { positioned: 0.0, drift: 0.0, floor: [0.0; 3], current: [0.0; 3] };
        if source.suspect && time_us.saturating_sub(source.exceedance_us) > silence_us(sensor) {
            source.leave_unconfirmed(sensor);
            self.agreed_us = 0;
            growth.floor = source.floor;
        }
        let unconfirmed = source.is_unconfirmed();
        let floor = source.floor.into_iter().fold(0.0, f64::max);
        let by_current = source.by_current && estimated.current;
        let rate = if sensor == Sensor::Range && measured { DRIFT_WITH_DVL } else { self::growth(sensor) };
        match sensor {
            // the ranges agree without it
            Sensor::VehicleGnss if source.suspect && witnessed => {}
            Sensor::BottomTrack | Sensor::WaterTrack | Sensor::RangeRate
                if source.suspect && witnessed && estimated.vehicle => {}
            // the sigma of the current carries that of the position on
            Sensor::Range if source.suspect && by_current && !measured && !contradicts => {
                if !source.current_open {
                    let since_s = 1.0e-6 * time_us.saturating_sub(source.since_us) as f64;
                    let variance = rate * rate;
                    growth.current = [variance * since_s * since_s, variance * since_s, variance];
                    (source.grown_s, source.added, source.current_open) = (since_s, growth.current[0], true);
                }
                source.added += source.grow(rate, step_s);
            }
            // what led the filter astray may still do so
            _ if source.suspect || (unconfirmed && sensor == Sensor::Range && !source.current_open) => {
                growth.positioned = source.grow(rate, step_s);
                source.added += growth.positioned;
            }
            _ if !unconfirmed => {}
            Sensor::BottomTrack | Sensor::WaterTrack | Sensor::RangeRate => {
                growth.drift = source.grow(floor, step_s);
            }
            // the heading's
            Sensor::Attitude => growth.drift = source.grow(source.floor[2] * CRUISE_MPS, step_s),
            _ => {}
        }
        source.added_to_position += growth.drift;
        growth
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigation::algebra::observation::Observations;

    /// In waves a swell may hold the depth cell off for 5 s; a jump by more than any wave is suspect after 2 s.
    #[test]
    fn no_wave_excuses_a_jump_of_the_depth_cell() {
        for (innovation, seconds) in [(0.9, 5), (1.8, 2)] {
            let mut monitor = InnovationMonitor { sigma: 5.0, ..InnovationMonitor::new() };
            (0..600).for_each(|k| monitor.waves.learn_sea(100_000 * k, libm::sin(0.1 * k as f64), 0.01));
            assert!(monitor.waves.move_readings(Sensor::Depth));
            let mut items = Observations::new();
            items.add_direct(crate::state::Z, innovation, 0.01);
            for tenth in 0..=10 * seconds {
                assert!(!monitor.is_suspect(Sensor::Depth), "{innovation} m, {tenth} tenths of a second");
                monitor.exceedance(Sensor::Depth, 100_000 * (600 + tenth), items.as_slice(), (0.01, false), 3);
            }
            assert!(monitor.is_suspect(Sensor::Depth), "{innovation} m");
        }
    }
}
