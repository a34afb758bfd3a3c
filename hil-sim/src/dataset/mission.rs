//! What a vehicle flies for a data set.

use crate::rng::{Source, Stream};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Depth of the surfaced runs, m: just under the surface, the antenna above it.
const SURFACE_M: f64 = 0.3;
/// Shallower than this there are GNSS fixes, m.
pub(super) const SURFACED_M: f64 = 0.6;

/// How the vehicle moves; the seed picks headings, depths and speeds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shape {
    /// Parallel lines to and fro at one depth and speed, between two surfaced runs.
    #[default]
    Lawnmower,
    /// Dives, steps of speed and legs across, between two surfaced runs.
    Excite,
    /// The same with every third leg at the surface, for fixes on several headings.
    Surfacing,
}

/// One leg: a heading, a depth and a speed for a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    /// True heading, rad.
    pub heading_rad: f64,
    /// Depth, m.
    pub depth_m: f64,
    /// Speed, m/s.
    pub speed_mps: f64,
    /// End of the leg since the start of the log, s.
    pub until_s: f64,
}

impl Shape {
    /// The legs of a log. A log shorter than its surfaced runs has only the first.
    #[must_use]
    pub fn legs(self, duration_s: f64, seed: u64) -> Vec<Leg> {
        let mut random = Stream::new(seed, Source::Mission);
        let mut between = |low: f64, high: f64| low + (high - low) * random.uniform();
        let heading_rad = between(0.0, TAU);
        let speed_mps = between(0.9, 1.2);
        let run_s = between(60.0, 90.0);
        let first = Leg { heading_rad, depth_m: SURFACE_M, speed_mps, until_s: run_s.min(duration_s) };
        let last_s = (duration_s - run_s).max(run_s);
        let mut legs = vec![first];
        match self {
            Self::Lawnmower => {
                // About one line in seven minutes, an even share of the time: no stump at the end.
                let side = if between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
                let (depth_m, across_s) = (between(3.0, 8.0), between(50.0, 100.0));
                let lines = ((last_s - run_s) / 420.0).round().max(1.0);
                let line_s = ((last_s - run_s - (lines - 1.0) * across_s) / lines).max(60.0);
                let mut until_s = run_s;
                for line in 0..lines as u32 {
                    let back = f64::from(line % 2) * PI;
                    if line > 0 {
                        until_s += across_s;
                        legs.push(Leg { heading_rad: heading_rad + side * FRAC_PI_2, depth_m, speed_mps, until_s });
                    }
                    until_s += line_s;
                    legs.push(Leg { heading_rad: heading_rad + back, depth_m, speed_mps, until_s });
                }
            }
            Self::Excite | Self::Surfacing => {
                let mut leg = 0;
                const DEPTHS_M: [f64; 4] = [3.0, 6.0, 10.0, 15.0];
                const SPEEDS_MPS: [f64; 4] = [0.7, 0.9, 1.15, 1.45];
                let mut until_s = run_s;
                let (mut depth, mut speed, mut turn) = (0, 1, 0.0);
                while until_s < last_s {
                    until_s += between(60.0, 120.0);
                    // Never the same depth or speed twice; mostly quarter turns, so that every heading is flown.
                    depth = (depth + 1 + between(0.0, 3.0) as usize) % DEPTHS_M.len();
                    speed = (speed + 1 + between(0.0, 3.0) as usize) % SPEEDS_MPS.len();
                    leg += 1;
                    let is_surfaced = self == Self::Surfacing && leg % 3 == 0;
                    // From deeper, the climb would take most of a surfaced leg.
                    let deepest_m = if self == Self::Surfacing { 6.0 } else { f64::INFINITY };
                    legs.push(Leg {
                        heading_rad: heading_rad + turn,
                        depth_m: if is_surfaced { SURFACE_M } else { f64::min(DEPTHS_M[depth], deepest_m) },
                        speed_mps: SPEEDS_MPS[speed],
                        until_s,
                    });
                    let choice = between(0.0, 1.0);
                    turn += if choice < 0.6 {
                        FRAC_PI_2
                    } else if choice < 0.8 {
                        -FRAC_PI_2
                    } else {
                        PI * between(0.5, 1.0)
                    };
                }
            }
        }
        if let Some(leg) = legs.iter_mut().skip(1).next_back() {
            leg.until_s = last_s;
            // From deeper, the climb would take most of the surfaced run.
            leg.depth_m = leg.depth_m.min(6.0);
        }
        let heading_rad = legs.last().map_or(heading_rad, |leg| leg.heading_rad);
        legs.push(Leg { heading_rad, depth_m: SURFACE_M, speed_mps, until_s: f64::INFINITY });
        legs
    }
}
