//! `[mission]`: the waypoints the backseat is to fly and the lines it is judged on.

use super::quantity;
use backseat_wire::hostlink::Waypoint;
use serde::Deserialize;

/// What to fly: `[mission.lawnmower]` or `[[mission.waypoints]]`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mission {
    /// Parallel lines.
    Lawnmower(Lawnmower),
    /// Legs one by one; each is the leg that ends in the waypoint.
    Waypoints(Vec<MissionWaypoint>),
}

/// Parallel lines, flown to and fro, with a surfaced run at either end.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lawnmower {
    /// Number of lines.
    pub lines: std::num::NonZeroU16,
    /// Length of a line, m.
    #[serde(deserialize_with = "quantity::positive")]
    pub length_m: f64,
    /// Distance between lines, m; positive puts each next line to starboard of the first.
    #[serde(deserialize_with = "quantity::coordinate")]
    pub spacing_m: f64,
    /// Start of the first line, north and east, m.
    #[serde(deserialize_with = "quantity::coordinate")]
    pub first_line_m: [f64; 2],
    /// True heading of the first line, rad.
    #[serde(deserialize_with = "quantity::angle")]
    pub heading_rad: f64,
    /// Speed, m/s.
    #[serde(deserialize_with = "quantity::speed")]
    pub speed_mps: f64,
    /// Depth on the lines, m.
    #[serde(deserialize_with = "quantity::depth")]
    pub depth_m: f64,
    /// The surfaced run ends this far before the first line, m; the dive happens in between.
    #[serde(deserialize_with = "quantity::length")]
    pub dive_m: f64,
    /// The surfaced run after the last line begins this far behind its end, m.
    #[serde(deserialize_with = "quantity::length")]
    pub climb_m: f64,
    /// Length of the surfaced run after the climb, m.
    #[serde(deserialize_with = "quantity::length")]
    pub run_out_m: f64,
}

/// One waypoint as it is written.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MissionWaypoint {
    /// North, m.
    #[serde(deserialize_with = "quantity::coordinate")]
    pub x_m: f64,
    /// East, m.
    #[serde(deserialize_with = "quantity::coordinate")]
    pub y_m: f64,
    /// Depth of the leg that ends here, m; 0 is surfaced.
    #[serde(deserialize_with = "quantity::depth")]
    pub depth_m: f64,
    /// Speed of the leg that ends here, m/s.
    #[serde(deserialize_with = "quantity::speed")]
    pub speed_mps: f64,
    /// Judge the true track against this leg.
    #[serde(default)]
    pub scored: bool,
}

/// A line on which the true track is judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Where it starts, north and east, m.
    pub from_m: [f64; 2],
    /// Where it ends, north and east, m.
    pub to_m: [f64; 2],
    /// Depth, m.
    pub depth_m: f64,
}

impl Mission {
    /// The waypoints for the backseat, in order.
    #[must_use]
    pub fn waypoints(&self) -> Vec<Waypoint> {
        todo!()
    }

    /// The lines on which the true track is judged.
    #[must_use]
    pub fn lines(&self, _start: super::Start) -> Vec<Line> {
        todo!()
    }
}
