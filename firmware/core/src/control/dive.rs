//! A dive that hangs at the surface is flown faster.
//!
//! A hull that is lighter than declared, or trimmed nose up, may lift its fins' moment at the speed of the leg: it then
//! swims level at the surface with its elevators hard over. Their moment grows with the square of the speed, the
//! weight that holds the hull up does not.

/// A leg at least this deep is a dive, m.
const DIVE_M: f64 = 1.0;
/// Shallower is at the surface, m.
const SURFACED_M: f64 = 0.5;
/// Deeper has dived, m: by more than the noise of the depth less than [`DIVE_M`].
const DIVED_M: f64 = 0.8;
/// A dive that takes longer hangs, µs. In 40 flights of vehicles that are not as declared all were 1 m deep within 30 s.
const PATIENCE_US: u64 = 30_000_000;
/// Speed of a dive that hangs over that of its leg: 2.2 times the moment of the fins.
const FASTER: f64 = 1.5;

/// Whether the vehicle hangs.
#[derive(Clone, Debug)]
pub(super) struct Dive {
    /// At the surface on a leg that dives, since then, µs.
    surfaced_us: Option<u64>,
}

impl Dive {
    pub(super) const fn new() -> Self {
        Self { surfaced_us: None }
    }

    /// Speed through the water, m/s, on a leg of this depth and speed.
    pub(super) fn speed_mps(&mut self, time_us: u64, depth_m: f64, leg_depth_m: f64, leg_mps: f64) -> f64 {
        if leg_depth_m < DIVE_M || depth_m > DIVED_M {
            self.surfaced_us = None;
        } else if depth_m < SURFACED_M {
            self.surfaced_us = self.surfaced_us.or(Some(time_us));
        }
        let hangs = self.surfaced_us.is_some_and(|since| time_us.saturating_sub(since) > PATIENCE_US);
        if hangs { FASTER * leg_mps } else { leg_mps }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: u64 = 1_000_000;

    #[test]
    fn only_a_dive_that_hangs_is_flown_faster() {
        let mut dive = Dive::new();
        assert_eq!(dive.speed_mps(0, 0.1, 3.0, 1.0), 1.0);
        assert_eq!(dive.speed_mps(30 * S, 0.1, 3.0, 1.0), 1.0);
        assert_eq!(dive.speed_mps(31 * S, 0.1, 3.0, 1.0), 1.5);
        // not ended by a wave
        assert_eq!(dive.speed_mps(32 * S, 0.6, 3.0, 1.0), 1.5);
        assert_eq!(dive.speed_mps(40 * S, 0.9, 3.0, 1.0), 1.0);
        assert_eq!(dive.speed_mps(99 * S, 0.6, 3.0, 1.0), 1.0);
        // at the surface by order
        assert_eq!(dive.speed_mps(200 * S, 0.1, 0.0, 1.0), 1.0);
        assert_eq!(dive.speed_mps(300 * S, 0.1, 0.0, 1.0), 1.0);
    }
}
