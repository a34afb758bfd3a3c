//! When and where a mission and its leg began.

use backseat_core::control::mission::Waypoint;

/// The mission under way, for its limits of time and for the way back.
#[derive(Clone, Copy, Debug)]
pub struct MissionProgress {
    begun: Option<(u64, [f64; 2])>,
    leg: Option<u16>,
    leg_us: u64,
    leg_from_m: [f64; 2],
    /// There was a precise clock at some time.
    pub had_clock: bool,
    step_us: Option<u64>,
}

impl MissionProgress {
    pub const fn new() -> Self {
        Self { begun: None, leg: None, leg_us: 0, leg_from_m: [0.0; 2], had_clock: false, step_us: None }
    }

    /// A leg is flown at `place_m`, with a precise clock or without.
    pub fn follow(&mut self, now_us: u64, leg: u16, place_m: [f64; 2], has_clock: bool) {
        self.begun.get_or_insert((now_us, place_m));
        self.had_clock |= has_clock;
        if self.leg != Some(leg) {
            (self.leg, self.leg_us, self.leg_from_m) = (Some(leg), now_us, place_m);
        }
    }

    /// Another leg begins, whatever its number.
    pub fn new_leg(&mut self) {
        self.leg = None;
    }

    /// Since the last call, s.
    pub fn step_s(&mut self, now_us: u64) -> f64 {
        self.step_us.replace(now_us).map_or(0.0, |us| seconds(us, now_us))
    }

    /// When it began, µs.
    pub fn begun_us(&self) -> u64 {
        self.begun.map_or(0, |(time_us, _)| time_us)
    }

    /// Since the leg began, and how long it takes by length and speed, s.
    pub fn leg_times_s(&self, now_us: u64, target: &Waypoint) -> (f64, f64) {
        (seconds(self.leg_us, now_us), super::leg_time_s(self.leg_from_m, target))
    }

    /// The way back from a leg: to where the mission began, at the surface.
    pub fn home(&self, leg: &Waypoint) -> Option<Waypoint> {
        let (_, [x_m, y_m]) = self.begun?;
        Some(Waypoint { x_m, y_m, depth_m: 0.0, speed_mps: leg.speed_mps })
    }
}

/// From one time to another, s.
pub fn seconds(from_us: u64, to_us: u64) -> f64 {
    to_us.saturating_sub(from_us) as f64 * 1e-6
}
