//! A survey as a list of waypoints, and the progress along it.

use super::trackline::Segment;
use crate::state::{self, VehicleState};

/// Most waypoints of one mission.
pub const MAX_WAYPOINTS: usize = 128;

/// A corner of the mission in the local NED frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Waypoint {
    /// North, m.
    pub x_m: f64,
    /// East, m.
    pub y_m: f64,
    /// Depth of the leg that ends here, m; 0 is surfaced.
    pub depth_m: f64,
    /// Speed through the water of the leg that ends here, m/s.
    pub speed_mps: f64,
}

/// Why a mission was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MissionError {
    /// More than [`MAX_WAYPOINTS`].
    TooMany,
    /// No waypoint at all.
    Empty,
    /// A position is not finite or further than [`Mission::MAX_COORDINATE_M`].
    Position,
    /// A depth is not finite, negative or more than [`Mission::MAX_DEPTH_M`].
    Depth,
    /// A speed is outside [`Mission::MIN_SPEED_MPS`] to [`Mission::MAX_SPEED_MPS`].
    Speed,
}

crate::with_defaults! {
    /// A lawnmower pattern: parallel lines, alternately out and back, joined by short legs.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Lawnmower;
    /// The survey of chapter 5: ten 1 km lines 100 m apart at 1 m/s and 3 m depth.
    const REFERENCE {
        /// First corner, north and east, m.
        origin_ne_m: [f64; 2] = [0.0, 0.0],
        /// Course of the first line, rad.
        course_rad: f64 = 0.0,
        /// Length of the lines, m.
        line_m: f64 = 1000.0,
        /// Distance between lines, m; positive steps to the right of the first line.
        spacing_m: f64 = 100.0,
        /// How many lines.
        lines: usize = 10,
        /// Depth, m.
        depth_m: f64 = 3.0,
        /// Speed, m/s.
        speed_mps: f64 = 1.0,
    }
}

/// A validated list of waypoints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mission {
    waypoints: [Waypoint; MAX_WAYPOINTS],
    len: usize,
}

impl Mission {
    /// Furthest coordinate from the local origin, m: beyond it the local plane is no longer one.
    pub const MAX_COORDINATE_M: f64 = 1.0e5;
    /// Deepest waypoint, m.
    pub const MAX_DEPTH_M: f64 = 300.0;
    /// Slowest leg, m/s: below it the fins of a vehicle of this kind do not hold the depth against its buoyancy.
    pub const MIN_SPEED_MPS: f64 = 0.5;
    /// Fastest leg, m/s.
    pub const MAX_SPEED_MPS: f64 = 3.0;

    /// No waypoints.
    #[must_use]
    pub const fn new() -> Self {
        Self { waypoints: [Waypoint { x_m: 0.0, y_m: 0.0, depth_m: 0.0, speed_mps: 0.0 }; MAX_WAYPOINTS], len: 0 }
    }

    /// Appends a waypoint.
    ///
    /// # Errors
    /// What is wrong with it; the mission is unchanged then.
    pub fn push(&mut self, waypoint: Waypoint) -> Result<(), MissionError> {
        let within = |x: f64| x.is_finite() && x.abs() <= Self::MAX_COORDINATE_M;
        if !within(waypoint.x_m) || !within(waypoint.y_m) {
            return Err(MissionError::Position);
        }
        if !(0.0..=Self::MAX_DEPTH_M).contains(&waypoint.depth_m) {
            return Err(MissionError::Depth);
        }
        if !(Self::MIN_SPEED_MPS..=Self::MAX_SPEED_MPS).contains(&waypoint.speed_mps) {
            return Err(MissionError::Speed);
        }
        let slot = self.waypoints.get_mut(self.len).ok_or(MissionError::TooMany)?;
        *slot = waypoint;
        self.len += 1;
        Ok(())
    }

    /// Appends the corners of a lawnmower pattern, its first corner included.
    ///
    /// # Errors
    /// The first corner that was refused; corners before it stay.
    pub fn push_lawnmower(&mut self, pattern: &Lawnmower) -> Result<(), MissionError> {
        let (sin, cos) = libm::sincos(pattern.course_rad);
        for line in 0..pattern.lines.min(MAX_WAYPOINTS) {
            #[allow(clippy::cast_precision_loss)] // at most MAX_WAYPOINTS
            let across = pattern.spacing_m * line as f64;
            let ends = if line % 2 == 0 { [0.0, pattern.line_m] } else { [pattern.line_m, 0.0] };
            for along in ends {
                self.push(Waypoint {
                    x_m: pattern.origin_ne_m[0] + cos * along - sin * across,
                    y_m: pattern.origin_ne_m[1] + sin * along + cos * across,
                    depth_m: pattern.depth_m,
                    speed_mps: pattern.speed_mps,
                })?;
            }
        }
        Ok(())
    }

    /// A mission that is one lawnmower pattern.
    ///
    /// # Errors
    /// The first corner that was refused.
    pub fn lawnmower(pattern: &Lawnmower) -> Result<Self, MissionError> {
        let mut mission = Self::new();
        mission.push_lawnmower(pattern)?;
        if mission.len == 0 { Err(MissionError::Empty) } else { Ok(mission) }
    }

    /// Removes all waypoints.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// The waypoints in order.
    #[must_use]
    pub fn waypoints(&self) -> &[Waypoint] {
        self.waypoints.get(..self.len).unwrap_or(&[])
    }
}

/// How far a mission has got.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MissionStatus {
    /// Not started, or stopped.
    #[default]
    Idle,
    /// Under way to the waypoint of this index.
    Leg(u16),
    /// The last waypoint was reached.
    Finished,
}

/// Walks along a [`Mission`]: which leg is followed now.
///
/// A leg ends when the distance left *along* it falls to the lead of the turn that follows, whatever the
/// cross-track error: a vehicle off its line goes on to the next leg instead of circling for a waypoint, and
/// passes a corner by at most one step's travel. The lead is R tan(Δχ/2), so that an arc of radius R touches
/// both lines, and at most half of the shorter leg; the last leg has none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    status: MissionStatus,
    segment: Segment,
}

impl Progress {
    /// Nothing under way.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            status: MissionStatus::Idle,
            segment: Segment { from_ne_m: [0.0; 2], to_ne_m: [0.0; 2], depth_m: 0.0, speed_mps: 0.0 },
        }
    }

    /// Idle, under way or finished.
    #[must_use]
    pub fn status(&self) -> MissionStatus {
        self.status
    }

    /// The leg that is followed now.
    #[must_use]
    pub fn segment(&self) -> Option<&Segment> {
        matches!(self.status, MissionStatus::Leg(_)).then_some(&self.segment)
    }

    /// Starts at `from_ne_m`, towards the first waypoint.
    ///
    /// # Errors
    /// [`MissionError::Empty`]; [`MissionError::Position`] when the start is not finite.
    pub fn start(&mut self, mission: &Mission, from_ne_m: [f64; 2]) -> Result<(), MissionError> {
        if !from_ne_m.iter().all(|x| x.is_finite()) {
            return Err(MissionError::Position);
        }
        let first = mission.waypoints().first().ok_or(MissionError::Empty)?;
        self.segment = leg(from_ne_m, first);
        self.status = MissionStatus::Leg(0);
        Ok(())
    }

    /// Stops; the mission can be started again.
    pub fn stop(&mut self) {
        self.status = MissionStatus::Idle;
    }

    /// Moves on to the leg that belongs to the vehicle at `x`, turning with `turn_radius_m`.
    pub fn update(&mut self, mission: &Mission, x: &VehicleState, turn_radius_m: f64) -> MissionStatus {
        if !x[state::X].is_finite() || !x[state::Y].is_finite() {
            return self.status;
        }
        while let MissionStatus::Leg(index) = self.status {
            let next = mission.waypoints().get(usize::from(index) + 1).map(|w| leg(self.segment.to_ne_m, w));
            let lead = next.map_or(0.0, |n| turn_lead_m(&self.segment, &n, turn_radius_m));
            if self.segment.error(x).remaining_m > lead {
                break;
            }
            match next {
                Some(next) => {
                    self.segment = next;
                    self.status = MissionStatus::Leg(index.saturating_add(1));
                }
                None => self.status = MissionStatus::Finished,
            }
        }
        self.status
    }
}

fn leg(from_ne_m: [f64; 2], to: &Waypoint) -> Segment {
    Segment { from_ne_m, to_ne_m: [to.x_m, to.y_m], depth_m: to.depth_m, speed_mps: to.speed_mps }
}

fn turn_lead_m(now: &Segment, next: &Segment, radius_m: f64) -> f64 {
    let turn = state::wrap_angle(next.course_rad() - now.course_rad()).abs();
    let shorter = now.length_m().min(next.length_m());
    // tan grows without bound for a reversal; the half leg bounds it.
    (radius_m * libm::tan(0.5 * turn)).abs().min(0.5 * shorter)
}
