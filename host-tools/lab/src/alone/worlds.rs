//! What is flown: missions, and the water and vehicle in which the ship leaves.

use hil_sim::rng::{Source, Stream};
use hil_sim::scenario::{Current, Effect, Lawnmower, Mission, MissionWaypoint, Scenario};
use std::f64::consts::TAU;
use std::num::NonZeroU16;

/// When the ship leaves, s.
pub const SHIP_LEAVES_S: f64 = 1200.0;
/// What is flown from then on, s.
pub const ALONE_S: f64 = 5.0 * 3600.0;
/// Speed of the undeclared current, m/s, and of the rotary tide.
pub const CURRENT_MPS: f64 = 0.15;
/// Period of the tide, s.
pub const TIDE_S: f64 = 12.4 * 3600.0;
/// Error of the compass, rad.
pub const HEADING_RAD: f64 = 2.0 * TAU / 360.0;
/// How far the declared parameters are off.
pub const SHARE: f64 = 0.10;

/// s since the ship left, of a time of the flight, µs.
pub fn since_s(time_us: u64) -> f64 {
    time_us as f64 * 1e-6 - SHIP_LEAVES_S
}

/// The water.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Water {
    /// A steady current in a direction that is drawn.
    Steady,
    /// A rotary tide whose phase is drawn, and no mean current.
    Tide,
}

/// The way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Lines of a kilometre, 100 m apart: the ship leaves at the start of the second.
    Lawnmower,
    /// One line.
    Transit,
    /// One line, after two rounds of a square within hearing of the ship.
    SquareThenTransit,
}

/// One way in one water.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct World {
    /// As in tables and on the command line.
    pub name: &'static str,
    /// See [`Way`].
    pub way: Way,
    /// See [`Water`].
    pub water: Water,
}

/// All.
pub const WORLDS: [World; 6] = [
    World { name: "lawnmower-steady", way: Way::Lawnmower, water: Water::Steady },
    World { name: "transit-steady", way: Way::Transit, water: Water::Steady },
    World { name: "square-steady", way: Way::SquareThenTransit, water: Water::Steady },
    World { name: "lawnmower-tide", way: Way::Lawnmower, water: Water::Tide },
    World { name: "transit-tide", way: Way::Transit, water: Water::Tide },
    World { name: "square-tide", way: Way::SquareThenTransit, water: Water::Tide },
];

/// Side of the square, m.
const SIDE_M: f64 = 120.0;

impl World {
    /// For the page.
    pub fn about(self) -> String {
        let water = match self.water {
            Water::Steady => "a steady current",
            Water::Tide => "a rotary tide",
        };
        let way = match self.way {
            Way::Lawnmower => "Lines of a kilometre, 100 m apart: the ship leaves at the start of the second",
            Way::Transit => "One straight line",
            Way::SquareThenTransit => "Two rounds of a square of 120 m while the ship is there, then one straight line",
        };
        format!("{way}, in {water}")
    }

    /// The flight of one seed. It is longer than five hours and ends under way.
    pub fn scenario(self, seed: u64) -> anyhow::Result<Scenario> {
        let mut scenario = Scenario::built_in("survey")?;
        scenario.settings.seed = seed;
        scenario.settings.backseat.range_rate = false;
        scenario.settings.backseat.wrong_share = SHARE;
        let draw = &mut Stream::new(seed, Source::Study);
        let angle = TAU * draw.uniform();
        let bias = Effect::new("heading_bias", &[("const_rad", draw.sign() * HEADING_RAD)]);
        scenario.settings.effects.push(bias.map_err(anyhow::Error::msg)?);
        let still = Current::default();
        scenario.settings.environment.current = match self.water {
            Water::Steady => {
                let (sin, cos) = libm::sincos(angle);
                Current { north_mps: CURRENT_MPS * cos, east_mps: CURRENT_MPS * sin, ..still }
            }
            Water::Tide => Current { tide_mps: CURRENT_MPS, tide_period_s: TIDE_S, tide_phase_rad: angle, ..still },
        };
        // Otherwise half an hour of degraded navigation ends a mission.
        scenario.vehicle.safety.degraded_time_max_s = 2.0 * ALONE_S;
        scenario.vehicle.safety.fence_radius_m = 1.0e5;
        scenario.settings.acoustics.until_s = Some(SHIP_LEAVES_S);
        scenario.settings.duration_s = SHIP_LEAVES_S + ALONE_S;
        if let Mission::Lawnmower(lawnmower) = &mut scenario.settings.mission {
            let [lines, length_m] = match self.way {
                Way::Lawnmower => [24, 1000],
                _ => [1, 24_000],
            };
            *lawnmower = Lawnmower {
                lines: NonZeroU16::new(lines).unwrap_or(NonZeroU16::MIN),
                length_m: f64::from(length_m),
                ..*lawnmower
            };
        }
        if self.way == Way::SquareThenTransit {
            let square = [[0.0, 0.0], [SIDE_M, 0.0], [SIDE_M, SIDE_M], [0.0, SIDE_M], [0.0, 0.0]];
            let rounds = square.into_iter().chain(square.into_iter().skip(1));
            let mut waypoints = scenario.settings.waypoints();
            let [surfaced, first, ..] = waypoints[..] else { anyhow::bail!("a line has waypoints") };
            let rounds = rounds.map(|[x, y]| {
                let mut corner = first;
                corner.x_m += x;
                corner.y_m += y;
                corner
            });
            waypoints.splice(..2, std::iter::once(surfaced).chain(rounds));
            let legs = waypoints.iter().map(|w| MissionWaypoint {
                x_m: w.x_m,
                y_m: w.y_m,
                depth_m: w.depth_m,
                speed_mps: w.speed_mps,
                scored: false,
            });
            scenario.settings.mission = Mission::Waypoints(legs.collect());
        }
        Ok(scenario)
    }
}
