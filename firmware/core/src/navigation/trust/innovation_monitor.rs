//! Innovation monitor: the gate, and what becomes of a source that contradicts the filter for longer than chance
//! allows.
//!
//! A measurement is judged as a whole, before any of its scalars is used. Beyond `gate_sigma` of the innovation's own
//! sigma it is refused. Beyond [`EXCEEDANCE`] of the gate (three sigmas of five) it is used and counted as an
//! *exceedance*; a smaller innovation ends the run of exceedances.
//!
//! `exceedances` of them in a row, over at least two seconds (in waves five), mean that the source or the filter is
//! wrong. The source is then **suspect** ([`super::source_state`]):
//!
//! - Nothing of it is used. One sigma of the states that it observes grows by [`growth_rate`] per second, the rate at
//!   which an undeclared cause may move the filter away from the truth. The duration of the contradiction decides what
//!   may be believed, not the agreement of the readings among themselves. Where ranges are suspect, the filter estimates
//!   the current, and a current that has changed since the last range that agreed explains the contradiction within
//!   three sigmas, the sigma of the current grows instead, once. That of the position follows from it.
//! - It is used again once it has been **consistent** with the grown covariance as often in a row as it took to suspect
//!   it, and a velocity for as long as it contradicted. If all of these would have been consistent without the growth,
//!   the source was wrong for a while and nothing remains. Otherwise the growth has to cover, of ranges and DVL, the
//!   worst innovation of the contradiction as well: a disagreement has one cause, and is not explained because the line
//!   of sight has turned across it. Source and filter then disagreed and either may have been right: the source is
//!   **unconfirmed**. The filter follows it, but the states that it observes keep a sigma of at least a share of the
//!   disagreement ([`SourceMonitor::floor`]).
//!   Of the position this is an addition to what the filter reports, because ranges have to triangulate; of other
//!   states it is a floor under P. After unconfirmed ranges the growth begins again with each range, unless the sigma of
//!   the current grew for them; an unconfirmed velocity or attitude lets the sigma of the position grow while nothing
//!   measures the position. Roll and pitch that contradict at the surface are no disagreement: the model has no surface
//!   and predicts neither there.
//! - A fix of the surfaced vehicle confirms every source, unless ranges contradict: GNSS is one position source of two,
//!   and does not overrule the other. Ranges that have agreed for [`TURN_US`] without that growth confirm every source
//!   but the depth cell, of which they see little.
//! - As long as ranges agree, a suspect fix is rejected without any growth, until it agrees. So is a DVL where the
//!   filter estimates the vehicle: a model that is taken as declared must not keep a good DVL out.
//! - A suspect source that falls silent becomes unconfirmed.
//!
//! What waves do to readings is in [`super::waves`].

use super::source_state::{Event, Exceedance, Outcome, SourceMonitor, SourceState, growth_rate};
use super::waves::Waves;
use crate::navigation::algebra::observation::Observation;
use crate::navigation::interface::measurement::Sensor;

/// Share of the gate's variance beyond which a measurement is an exceedance: (3/5)², three sigmas of the default five.
pub(crate) const EXCEEDANCE: f64 = 0.36;
/// Velocity over ground counts as measured for this long, µs.
const VELOCITY_US: u64 = 10_000_000;
/// What is left of a position's drift while a DVL with bottom lock is fused, m/s: 2 % of 1.5 m/s, by its scale and
/// the heading.
const DRIFT_WITH_DVL: f64 = 0.03;
/// Speed by which an error in heading moves the position, m/s: a torpedo's cruise.
const CRUISE_MPS: f64 = 1.5;

/// A ship turns the line of sight in this time, µs: before, ranges see one direction only, and agree as well where the
/// difference is across it.
pub(crate) const TURN_US: u64 = 960_000_000;
/// A range that agreed no longer ago than this confirms the filter, µs: three ranges at one every 30 s.
const AGREEMENT_US: u64 = 100_000_000;

/// Largest sigma that suspicion gives to the current, m/s.
pub(crate) const LARGEST_CURRENT_MPS: f64 = 0.5;

/// After this time without a measurement a source is silent, µs.
fn silence_us(sensor: Sensor) -> u64 {
    match sensor {
        Sensor::Range | Sensor::RangeRate | Sensor::Usbl => 300_000_000,
        _ => 10_000_000,
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
    sources: [SourceMonitor; Sensor::ALL.len()],
    pub(crate) waves: Waves,
}

impl InnovationMonitor {
    pub(crate) const fn new() -> Self {
        Self {
            sigma: 0.0,
            alert: false,
            range_us: 0,
            agreed_us: 0,
            sources: [SourceMonitor::NEW; Sensor::ALL.len()],
            waves: Waves::CALM,
        }
    }

    /// Ranges agree with the filter at present, and are neither suspect nor unconfirmed.
    fn ranges_agree(&self, time_us: u64) -> bool {
        self.range_us > 0
            && time_us < self.range_us.saturating_add(AGREEMENT_US)
            && self.sources[Sensor::Range as usize].is_calm()
    }

    /// Worst innovation of one scalar since a suspect source began to contradict the filter; 0 of others.
    pub(crate) fn worst(&self, sensor: Sensor, axis: usize) -> f64 {
        let suspicion = self.sources[sensor as usize].suspicion();
        suspicion.and_then(|suspicion| suspicion.exceedances.worst.get(axis).copied()).unwrap_or(0.0)
    }

    pub(crate) fn is_suspect(&self, sensor: Sensor) -> bool {
        self.sources[sensor as usize].is_suspect()
    }

    /// Since when a suspect source has contradicted the filter, µs.
    pub(crate) fn suspect_since_us(&self, sensor: Sensor) -> Option<u64> {
        self.sources[sensor as usize].suspicion().map(|suspicion| suspicion.exceedances.since_us)
    }

    /// One sigma by scalar that an unconfirmed source leaves at least; 0 when it is not unconfirmed.
    pub(crate) fn floor(&self, sensor: Sensor) -> [f64; 3] {
        self.sources[sensor as usize].floor()
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
        // what a rare range contradicts may have begun after the one before it
        let before_us = if sensor == Sensor::Range { self.range_us } else { 0 };
        let recent = before_us > 0 && time_us < before_us.saturating_add(AGREEMENT_US);
        let mut innovations = [0.0; 3];
        for (innovation, item) in innovations.iter_mut().zip(items) {
            *innovation = item.innovation.abs();
        }
        let exceedance = Exceedance {
            time_us,
            began_us: if recent { before_us } else { time_us },
            innovations,
            variance,
            bound: EXCEEDANCE * self.sigma * self.sigma * variance,
            in_waves: self.waves.move_readings(sensor),
            surfaced,
            most,
        };
        self.sources[sensor as usize].take(sensor, Event::Exceeds(exceedance));
        if sensor == Sensor::Range {
            self.agreed_us = 0;
        }
        self.alert = true;
    }

    /// Innovation variance as it would be without the suspicion, of a range also without what unconfirmed sources add;
    /// `noise` is that of the reading.
    pub(crate) fn variance_without_suspicion(&self, sensor: Sensor, variance: f64, noise: f64) -> f64 {
        let source = &self.sources[sensor as usize];
        let added = if sensor == Sensor::Range {
            self.sources.iter().map(|source| source.grown.position).sum::<f64>() + source.grown.positioned
        } else {
            source.grown.positioned
        };
        source.variance.max(noise).max(variance - added)
    }

    /// A range agrees; `alone`: without the growth it would have done so too. Ranges that keep on doing so confirm the
    /// others.
    fn range_agrees(&mut self, time_us: u64, alone: bool) {
        let goes_on = self.agreed_us > 0 && time_us < self.range_us.saturating_add(AGREEMENT_US);
        self.agreed_us = match (alone, goes_on) {
            (false, _) => 0,
            (true, false) => time_us.max(1),
            (true, true) => self.agreed_us,
        };
        if alone && goes_on && time_us >= self.agreed_us.saturating_add(TURN_US) {
            for (sensor, source) in Sensor::ALL.into_iter().zip(&mut self.sources) {
                if sensor != Sensor::Depth {
                    source.take(sensor, Event::RangesConfirm);
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
        match source.take(sensor, Event::Agrees { time_us, alone, believable, most }) {
            Outcome::Suspect { used } => return used,
            Outcome::Unconfirmed => self.agreed_us = 0,
            Outcome::Settled => {}
        }
        match sensor {
            Sensor::VehicleGnss => {
                for (sensor, source) in Sensor::ALL.into_iter().zip(&mut self.sources).filter(|_| !contested) {
                    source.take(sensor, Event::FixConfirms);
                }
                // the position was measured
                let range = &mut self.sources[Sensor::Range as usize];
                range.grow_anew();
            }
            // the drift begins again where the position was measured
            Sensor::Range => {
                self.range_agrees(time_us, alone);
                for source in self.sources.iter_mut().filter(|source| !source.is_suspect()) {
                    source.grow_anew();
                }
            }
            _ => {}
        }
        self.alert = !self.sources.iter().all(SourceMonitor::is_calm);
        true
    }

    /// What a step of the prediction adds for one source of a filter that estimates `estimated`.
    pub(crate) fn grow(&mut self, sensor: Sensor, time_us: u64, step_s: f64, estimated: Estimated) -> Growth {
        let bottom = &self.sources[Sensor::BottomTrack as usize];
        let measured = !bottom.is_suspect()
            && !bottom.is_unconfirmed()
            && time_us < bottom.consistent_us.saturating_add(VELOCITY_US);
        // a DVL that contradicts would be taken back by the sigma of the current, and teach it
        let contradicts =
            bottom.suspicion().is_some_and(|suspicion| time_us < suspicion.last_us.saturating_add(VELOCITY_US));
        let ranges_agree = self.ranges_agree(time_us);
        let source = &mut self.sources[sensor as usize];
        let mut growth = Growth { positioned: 0.0, drift: 0.0, floor: [0.0; 3], current: [0.0; 3] };
        let is_silent = |last_us| time_us.saturating_sub(last_us) > silence_us(sensor);
        if source.suspicion().is_some_and(|suspicion| is_silent(suspicion.last_us)) {
            source.take(sensor, Event::FallsSilent);
            self.agreed_us = 0;
            growth.floor = source.floor();
        }
        let (unconfirmed, floor) = (source.is_unconfirmed(), source.floor());
        let explained = source.is_explained_by_current();
        let largest_floor = floor.into_iter().fold(0.0, f64::max);
        let SourceMonitor { state, grown, .. } = source;
        let rate = if sensor == Sensor::Range && measured { DRIFT_WITH_DVL } else { growth_rate(sensor) };
        match (sensor, state) {
            // the ranges agree without it
            (Sensor::VehicleGnss, SourceState::Suspect(_)) if ranges_agree => {}
            (Sensor::BottomTrack | Sensor::WaterTrack | Sensor::RangeRate, SourceState::Suspect(_))
                if ranges_agree && estimated.vehicle => {}
            // the sigma of the current carries that of the position on
            (Sensor::Range, SourceState::Suspect(suspicion))
                if suspicion.by_current && estimated.current && !measured && !contradicts =>
            {
                if !suspicion.current_grown {
                    let since_s = 1.0e-6 * time_us.saturating_sub(suspicion.exceedances.since_us) as f64;
                    let variance = rate * rate;
                    growth.current = [variance * since_s * since_s, variance * since_s, variance];
                    (grown.time_s, grown.positioned, suspicion.current_grown) = (since_s, growth.current[0], true);
                }
                grown.positioned += grown.grow(rate, step_s);
            }
            // what has moved the filter away may still do so
            (_, SourceState::Suspect(_)) => {
                growth.positioned = grown.grow(rate, step_s);
                grown.positioned += growth.positioned;
            }
            _ if !unconfirmed => {}
            (Sensor::Range, _) if !explained => {
                growth.positioned = grown.grow(rate, step_s);
                grown.positioned += growth.positioned;
            }
            (Sensor::BottomTrack | Sensor::WaterTrack | Sensor::RangeRate, _) => {
                growth.drift = grown.grow(largest_floor, step_s);
            }
            // the heading's
            (Sensor::Attitude, _) => growth.drift = grown.grow(floor[2] * CRUISE_MPS, step_s),
            _ => {}
        }
        grown.position += growth.drift;
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
