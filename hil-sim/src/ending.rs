//! How a flight really ended, by the truth: flown, cut short, capsized, given up, never begun.

use crate::flight::{self, FlightLog, FlightSample};
use crate::scenario::Scenario;
use backseat_core::state::{PHI, THETA};
use backseat_wire::hostlink::ModeReason;

/// The vehicle heels over for this long before it counts as capsized, s.
const CAPSIZED_S: usize = 3;

/// How a flight ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ending {
    /// The last waypoint was reached.
    Flown,
    /// The scenario's time was over, or somebody interrupted it, while the mission was under way.
    Unfinished,
    /// The vehicle rolled onto its back and stayed there, from this time on, s.
    Capsized {
        /// s since the start.
        time_s: f64,
    },
    /// The backseat ended the mission elsewhere than at its last waypoint.
    GivenUp {
        /// Distance of the vehicle from the last waypoint at that time, m.
        short_of_m: f64,
    },
    /// The mission never began.
    NotFlown,
}

impl Ending {
    /// How a flight of this scenario ended.
    #[must_use]
    pub fn of(scenario: &Scenario, flight: &FlightLog) -> Self {
        let samples = &flight.samples;
        if let Some(time_s) = capsized(samples) {
            return Self::Capsized { time_s };
        }
        if !samples.iter().any(|sample| sample.telemetry.leg.is_some()) {
            return Self::NotFlown;
        }
        let is_stopped = samples.last().is_some_and(|sample| sample.telemetry.reason == ModeReason::Stopped);
        if !flight.finished || is_stopped {
            return Self::Unfinished;
        }
        let last_under_way = samples.iter().rfind(|sample| sample.telemetry.leg.is_some());
        let short_of_m = last_under_way.and_then(|sample| flight::short_of_m(scenario, &sample.truth.state));
        match short_of_m {
            Some(short_of_m) if short_of_m > flight::END_RADIUS_M => Self::GivenUp { short_of_m },
            _ => Self::Flown,
        }
    }

    /// Whether what the flight says of navigation and steering is of a vehicle that flew its mission.
    #[must_use]
    pub const fn is_trustworthy(self) -> bool {
        matches!(self, Self::Flown | Self::Unfinished)
    }

    /// One word for scripts.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Flown => "flown",
            Self::Unfinished => "unfinished",
            Self::Capsized { .. } => "capsized",
            Self::GivenUp { .. } => "given up",
            Self::NotFlown => "not flown",
        }
    }

    /// The headline.
    #[must_use]
    pub fn headline(self) -> String {
        match self {
            Self::Flown => "mission flown to its end".to_owned(),
            Self::Unfinished => "mission not finished".to_owned(),
            Self::Capsized { time_s } => {
                format!(
                    "CAPSIZED: the vehicle lies on its back from {time_s:.0} s on; no figure here is of a vehicle that flies"
                )
            }
            Self::GivenUp { short_of_m } => {
                format!("GIVEN UP: the backseat ended the mission {short_of_m:.0} m from its last waypoint")
            }
            Self::NotFlown => "NOT FLOWN: the mission never began".to_owned(),
        }
    }
}

/// When the vehicle was upside down for [`CAPSIZED_S`] samples, one a second.
fn capsized(samples: &[FlightSample]) -> Option<f64> {
    let is_over = |sample: &FlightSample| {
        let [roll, pitch] = [PHI, THETA].map(|angle| sample.truth.state[angle]);
        roll.cos() * pitch.cos() < 0.0
    };
    let first = samples.windows(CAPSIZED_S).find(|window| window.iter().all(is_over))?;
    first.first().map(|sample| sample.truth.time_us as f64 * 1e-6)
}
