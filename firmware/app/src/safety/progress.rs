//! When and where a mission and its leg began.

use backseat_core::control::mission::Waypoint;

/// A vehicle that comes up from where the host let go of it does so faster, m/s, or is held to have stayed.
const ASCENT_MPS: f64 = 0.2;

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
    /// Deepest of what the host steers, taken back as the vehicle comes up from it, m.
    steered_m: f64,
}

impl MissionProgress {
    pub const fn new() -> Self {
        Self {
            begun: None,
            leg: None,
            leg_us: 0,
            leg_from_m: [0.0; 2],
            had_clock: false,
            step_us: None,
            steered_m: 0.0,
        }
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

    /// The depth that a vehicle at `depth_m` is to be at, m: of its leg, or of what the host steers instead. A host lets
    /// go of a vehicle anywhere, in a dive as well: it has time to turn.
    pub fn asked_depth_m(&mut self, dt_s: f64, depth_m: f64, leg_m: f64, steered_m: Option<f64>) -> f64 {
        let left_m = self.steered_m.min(depth_m) - ASCENT_MPS * dt_s;
        self.steered_m = steered_m.unwrap_or(0.0).max(left_m);
        steered_m.unwrap_or(leg_m).max(self.steered_m)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A leg at 3 m, 20 m steered; let go at 12 m on the way down, where the vehicle turns.
    #[test]
    fn what_was_steered_is_forgotten_as_the_vehicle_comes_up() {
        let mut progress = MissionProgress::new();
        let mut asked_m = |depth_m, steered_m| progress.asked_depth_m(0.5, depth_m, 3.0, steered_m);
        assert_eq!(asked_m(3.0, None), 3.0);
        assert_eq!(asked_m(3.0, Some(20.0)), 20.0);
        assert!((asked_m(12.0, None) - 11.9).abs() < 1e-9);
        assert!((asked_m(14.0, None) - 11.8).abs() < 1e-9, "sinking on is no excuse");
        assert!((asked_m(8.0, None) - 7.9).abs() < 1e-9);
        assert_eq!(asked_m(2.9, None), 3.0);
        // a vehicle that stays where it is: 0.2 m/s
        asked_m(12.0, Some(12.0));
        let left_m = (0..20).map(|_| asked_m(12.0, None)).last();
        assert!((left_m.unwrap() - 10.0).abs() < 1e-9);
        // and what is steered shallower counts the same
        assert!((asked_m(9.0, Some(0.0)) - 8.9).abs() < 1e-9);
    }
}
