//! The state of one source against the filter, and its transitions.
//!
//! ```text
//!            exceeds                 enough in a row, for long enough
//!  Calm ─────────────────> Exceeding ─────────────────────────────────> Suspect
//!   ^  ^       agrees       │    ^              a fix confirms it        │ │
//!   │  └────────────────────┘    └───────────────────────────────────────┘ │
//!   └──── has agreed for long enough; or is silent, and then unconfirmed ──┘
//! ```
//!
//! [`Unconfirmed`] stands beside the state: what a disagreement has left holds until something confirms the source,
//! whether it is calm, exceeds again or is suspect again.

use crate::navigation::interface::measurement::Sensor;

/// A row of exceedances lasts at least this long, µs: a DVL on a fish is over by then.
const EXCEEDANCES_US: u64 = 2_000_000;
/// The same of a sensor whose readings waves move, µs: half a swell of 10 s.
const WAVED_EXCEEDANCES_US: u64 = 5_000_000;
/// No wave moves a reading further, m, m/s: from trough to crest of 1 m.
const LARGEST_WAVE: f64 = 1.0;
/// Least sigma of what an unconfirmed source positions, by the difference: three of it cover that along one line of
/// sight, and a fifth more for what lay across.
const UNCONFIRMED: f64 = 0.4;
/// A suspect velocity has to agree for as long as it contradicted, at most for this long, µs, and is not used before: in
/// a turn every velocity crosses every other for some seconds.
const VELOCITY_DOUBT_US: u64 = 30_000_000;

/// Sigmas within which a changed current explains the worst range. A clock's step of 0.1 s is ten.
const CURRENT: f64 = 3.0;

/// Growth of one sigma of what a suspect source positions, in the state's unit per second.
pub(crate) fn growth_rate(sensor: Sensor) -> f64 {
    match sensor {
        // heave by trim or by a wrong pitch
        Sensor::Depth => 0.1,
        // an unmodelled turn, 1 °/s: without a compass for long, nothing else is right either
        Sensor::Attitude | Sensor::Rates => 2.0e-2,
        // drag or thrust that changes by some percent a minute
        Sensor::BottomTrack | Sensor::WaterTrack | Sensor::RangeRate => 2.0e-3,
        // an undeclared current, or a tide that has turned
        Sensor::Range | Sensor::Usbl | Sensor::Peer => 0.15,
        // the same; but it is the one absolute reference, and the vehicle waits at the surface
        Sensor::VehicleGnss => 0.5,
        Sensor::ShipGnss => 1.0,
    }
}

/// Largest sigma that suspicion gives to a state that a source positions, in the state's unit: beyond, a linearised
/// filter means nothing.
pub(crate) fn largest_sigma(sensor: Sensor) -> f64 {
    match sensor {
        Sensor::Depth => 20.0,
        Sensor::Attitude => 0.5,
        Sensor::Rates => 0.2,
        Sensor::BottomTrack | Sensor::WaterTrack | Sensor::RangeRate => 0.5,
        Sensor::VehicleGnss | Sensor::ShipGnss | Sensor::Range | Sensor::Usbl | Sensor::Peer => 5.0e3,
    }
}

fn is_velocity(sensor: Sensor) -> bool {
    matches!(sensor, Sensor::BottomTrack | Sensor::WaterTrack)
}

/// Exceedances in a row.
#[derive(Clone, Copy)]
pub(crate) struct Exceedances {
    count: u32,
    /// When the contradiction began, µs.
    pub(crate) since_us: u64,
    /// Worst innovations, by scalar.
    pub(crate) worst: [f64; 3],
}

/// A source that contradicts the filter for longer than chance allows.
#[derive(Clone, Copy)]
pub(crate) struct Suspicion {
    /// Those that made it suspect, and those since.
    pub(crate) exceedances: Exceedances,
    /// Time of the last measurement, µs.
    pub(crate) last_us: u64,
    /// Measurements in a row that are consistent, and whether one of them is by the growth of the covariance alone.
    returning: u32,
    by_growth: bool,
    /// A velocity has to agree for so much longer, µs.
    doubt_us: u64,
    /// A change of the current explains it.
    pub(crate) by_current: bool,
    /// The sigma of the current has grown for it.
    pub(crate) current_grown: bool,
    /// Scalars that leave no doubt: of an attitude that contradicted at the surface, roll and pitch, and heading unless
    /// it contradicted itself. Of other sources none.
    excused: [bool; 3],
}

/// The source against the filter.
#[derive(Clone, Copy)]
#[repr(u8)]
pub(crate) enum SourceState {
    /// It agrees.
    Calm = 0, // an empty filter is all zeros
    /// It may be chance.
    Exceeding(Exceedances),
    /// Nothing of it is used.
    Suspect(Suspicion),
}

/// What a disagreement that nothing has decided leaves behind.
#[derive(Clone, Copy)]
struct Unconfirmed {
    /// Least one sigma by scalar; 0: the source is confirmed.
    floor: [f64; 3],
    /// The sigma of the current has grown for it.
    current_grown: bool,
}

impl Unconfirmed {
    const NO: Self = Self { floor: [0.0; 3], current_grown: false };
}

/// What suspicion, or the drift of what is unconfirmed, has added to the covariance since it began, or since a range
/// agreed.
#[derive(Clone, Copy)]
pub(crate) struct Grown {
    /// Seconds that it has lasted.
    pub(crate) time_s: f64,
    /// Variance added to what the source positions.
    pub(crate) positioned: f64,
    /// Variance added to the position.
    pub(crate) position: f64,
}

impl Grown {
    const NONE: Self = Self { time_s: 0.0, positioned: 0.0, position: 0.0 };

    /// Growth of a variance over `step_s`: one sigma grows by `rate` per second.
    pub(crate) fn grow(&mut self, rate: f64, step_s: f64) -> f64 {
        let before_s = self.time_s;
        self.time_s += step_s;
        rate * rate * (self.time_s * self.time_s - before_s * before_s)
    }
}

/// An exceedance.
#[derive(Clone, Copy)]
pub(crate) struct Exceedance {
    pub(crate) time_us: u64,
    /// When a contradiction that begins with this one began, µs.
    pub(crate) began_us: u64,
    /// |ν| by scalar.
    pub(crate) innovations: [f64; 3],
    /// Largest innovation variance, and the square of an innovation of that variance beyond which it is an exceedance.
    pub(crate) variance: f64,
    pub(crate) bound: f64,
    /// Waves move the readings of this sensor.
    pub(crate) in_waves: bool,
    /// The vehicle is at the surface.
    pub(crate) surfaced: bool,
    /// Exceedances in a row that make the source suspect.
    pub(crate) most: u32,
}

/// What happens to a source.
#[derive(Clone, Copy)]
pub(crate) enum Event {
    Exceeds(Exceedance),
    /// It agrees, `alone`: without the growth it would have done so too, `believable`: so would the worst of the
    /// contradiction. A suspect source is taken back by `most` of them in a row.
    Agrees {
        time_us: u64,
        alone: bool,
        believable: bool,
        most: u32,
    },
    /// Nothing has come for too long.
    FallsSilent,
    /// A fix decides for all sources.
    FixConfirms,
    /// Ranges have agreed for long enough to decide.
    RangesConfirm,
}

/// How the source stands after an event.
#[derive(Clone, Copy)]
pub(crate) enum Outcome {
    /// It is not suspect.
    Settled,
    /// It is suspect; whether its measurement is used.
    Suspect { used: bool },
    /// It is not suspect any more, and unconfirmed.
    Unconfirmed,
}

/// One source.
#[derive(Clone, Copy)]
pub(crate) struct SourceMonitor {
    pub(crate) state: SourceState,
    unconfirmed: Unconfirmed,
    pub(crate) grown: Grown,
    /// Innovation variance when the last suspicion began.
    pub(crate) variance: f64,
    /// Time of the last measurement that was no exceedance, and not of a suspect source, µs.
    pub(crate) consistent_us: u64,
    pub(crate) recoveries: u32,
}

impl SourceMonitor {
    pub(crate) const NEW: Self = Self {
        state: SourceState::Calm,
        unconfirmed: Unconfirmed::NO,
        grown: Grown::NONE,
        variance: 0.0,
        consistent_us: 0,
        recoveries: 0,
    };

    pub(crate) fn is_calm(&self) -> bool {
        matches!(self.state, SourceState::Calm) && !self.is_unconfirmed()
    }

    pub(crate) fn suspicion(&self) -> Option<&Suspicion> {
        if let SourceState::Suspect(suspicion) = &self.state { Some(suspicion) } else { None }
    }

    pub(crate) fn is_suspect(&self) -> bool {
        self.suspicion().is_some()
    }

    pub(crate) fn is_unconfirmed(&self) -> bool {
        self.unconfirmed.floor != [0.0; 3]
    }

    /// Least one sigma by scalar while the source is unconfirmed; 0 otherwise.
    pub(crate) fn floor(&self) -> [f64; 3] {
        self.unconfirmed.floor
    }

    /// The source is unconfirmed, and the sigma of the current has grown for it.
    pub(crate) fn is_explained_by_current(&self) -> bool {
        self.unconfirmed.current_grown
    }

    pub(crate) fn grow_anew(&mut self) {
        self.grown = Grown::NONE;
    }

    /// Every transition.
    pub(crate) fn take(&mut self, sensor: Sensor, event: Event) -> Outcome {
        use SourceState::{Calm, Exceeding, Suspect};
        let mut outcome = Outcome::Settled;
        self.state = match (self.state, event) {
            (Suspect(suspicion), Event::Exceeds(exceedance)) => {
                outcome = Outcome::Suspect { used: false };
                Suspect(suspicion.contradicts_again(sensor, &exceedance))
            }
            (Calm | Exceeding(_), Event::Exceeds(exceedance)) => {
                let before = if let Exceeding(before) = self.state { Some(before) } else { None };
                let exceedances = Exceedances::after(before, &exceedance);
                if exceedances.are_chance(&exceedance) {
                    Exceeding(exceedances)
                } else {
                    outcome = Outcome::Suspect { used: false };
                    self.grow_anew();
                    self.variance = exceedance.variance;
                    Suspect(Suspicion::new(sensor, exceedances, &exceedance))
                }
            }
            (Suspect(suspicion), Event::Agrees { time_us, alone, believable, most }) => {
                let suspicion = suspicion.agrees(time_us, alone, believable);
                if !suspicion.by_growth {
                    self.grow_anew();
                }
                if suspicion.returning < most || suspicion.doubt_us > 0 {
                    outcome = Outcome::Suspect { used: !suspicion.by_growth && suspicion.doubt_us == 0 };
                    Suspect(suspicion)
                } else {
                    self.recoveries = self.recoveries.saturating_add(1);
                    self.unconfirmed.current_grown = suspicion.current_grown;
                    // the ship's own receiver is its arbiter
                    if suspicion.by_growth && sensor != Sensor::ShipGnss {
                        self.leave_unconfirmed(sensor, &suspicion);
                        outcome = Outcome::Unconfirmed;
                    }
                    self.consistent_us = time_us;
                    Calm
                }
            }
            (Calm | Exceeding(_), Event::Agrees { time_us, .. }) => {
                self.consistent_us = time_us;
                Calm
            }
            (Suspect(suspicion), Event::FallsSilent) => {
                self.leave_unconfirmed(sensor, &suspicion);
                outcome = Outcome::Unconfirmed;
                Calm
            }
            (state, Event::FallsSilent) => state,
            (state, Event::FixConfirms) => {
                self.unconfirmed.floor = [0.0; 3];
                // one more exceedance makes it suspect again
                if let Suspect(suspicion) = state { Exceeding(suspicion.exceedances) } else { state }
            }
            (state, Event::RangesConfirm) => {
                self.unconfirmed.floor = [0.0; 3];
                state
            }
        };
        outcome
    }

    fn leave_unconfirmed(&mut self, sensor: Sensor, suspicion: &Suspicion) {
        self.grow_anew();
        self.unconfirmed.current_grown = suspicion.current_grown;
        let scalars = suspicion.exceedances.worst.iter().zip(suspicion.excused);
        for (floor, (worst, excused)) in self.unconfirmed.floor.iter_mut().zip(scalars) {
            if !excused {
                *floor = floor.max(UNCONFIRMED * worst).min(largest_sigma(sensor));
            }
        }
    }
}

impl Exceedances {
    /// One more.
    fn after(before: Option<Self>, exceedance: &Exceedance) -> Self {
        let mut after = before.unwrap_or(Self { count: 0, since_us: exceedance.began_us, worst: [0.0; 3] });
        after.count = after.count.saturating_add(1);
        for (worst, innovation) in after.worst.iter_mut().zip(exceedance.innovations) {
            *worst = worst.max(innovation);
        }
        after
    }

    /// There are too few, or they have not lasted.
    fn are_chance(&self, exceedance: &Exceedance) -> bool {
        let is_wave = exceedance.in_waves && self.worst.iter().all(|worst| *worst < LARGEST_WAVE);
        let least_us = if is_wave { WAVED_EXCEEDANCES_US } else { EXCEEDANCES_US };
        let lasts = exceedance.time_us.saturating_sub(self.since_us) >= least_us;
        !lasts || self.count < exceedance.most
    }
}

impl Suspicion {
    fn new(sensor: Sensor, exceedances: Exceedances, exceedance: &Exceedance) -> Self {
        let [worst, _, heading] = exceedances.worst;
        let turned = heading * heading > exceedance.bound;
        let lasted_us = exceedance.time_us.saturating_sub(exceedances.since_us);
        let carried = 1.0e-6 * lasted_us as f64 * growth_rate(Sensor::Range);
        let at_surface = exceedance.surfaced && sensor == Sensor::Attitude;
        Self {
            exceedances,
            last_us: exceedance.time_us,
            returning: 0,
            by_growth: false,
            doubt_us: 0,
            by_current: worst * worst <= CURRENT * CURRENT * (exceedance.variance + carried * carried),
            current_grown: false,
            excused: if at_surface { [true, true, !turned] } else { [false; 3] },
        }
    }

    fn contradicts_again(self, sensor: Sensor, exceedance: &Exceedance) -> Self {
        let since_us = exceedance.time_us.saturating_sub(self.last_us);
        let doubt_us = self.doubt_us.saturating_add(since_us).min(VELOCITY_DOUBT_US);
        Self {
            exceedances: Exceedances::after(Some(self.exceedances), exceedance),
            last_us: exceedance.time_us,
            returning: 0,
            by_growth: false,
            doubt_us: if is_velocity(sensor) { doubt_us } else { self.doubt_us },
            ..self
        }
    }

    fn agrees(mut self, time_us: u64, alone: bool, believable: bool) -> Self {
        self.doubt_us = self.doubt_us.saturating_sub(time_us.saturating_sub(self.last_us));
        self.last_us = time_us;
        if alone || believable {
            self.returning = self.returning.saturating_add(1);
            self.by_growth |= !alone;
        } else {
            (self.returning, self.by_growth) = (0, true);
        }
        self
    }
}
