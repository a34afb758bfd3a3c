//! `[mission]`: the waypoints the backseat is to fly and the lines it is judged on.

use crate::quantity::{self, settings};
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

/// Parallel lines, flown to and fro, between two surfaced runs with GNSS.
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
    /// The surfaced run from the start ends this far before the first line, on its extension, m;
    /// the dive takes place in between.
    #[serde(deserialize_with = "quantity::length")]
    pub dive_m: f64,
    /// Length of the run behind the last line, on its extension, m: climb, then surfaced.
    #[serde(deserialize_with = "quantity::length")]
    pub run_out_m: f64,
}

/// `[fence]`: the polygon that mission and vehicle must not leave; without corners there is none.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fence {
    /// Corners in order, north and east, m.
    #[serde(deserialize_with = "quantity::coordinate")]
    pub corners_m: Vec<[f64; 2]>,
}

settings! {
    /// `[alert]`: protection levels from which the vehicle counts as degraded; 0: none.
    #[derive(Copy)]
    pub struct Alert {
        /// Horizontally, m.
        horizontal_m: f64 as "quantity::non_negative" = 0.0,
        /// In depth, m.
        depth_m: f64 as "quantity::non_negative" = 0.0,
    }
}

/// `separate`: whether a manoeuvre may tell two causes apart that the board cannot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub enum Separate {
    /// None is flown.
    #[default]
    #[serde(rename = "never")]
    Never,
    /// One that stays on the line.
    #[serde(rename = "on legs")]
    OnLegs,
    /// One that leaves it by up to 10 m as well.
    #[serde(rename = "free")]
    Free,
}

impl Separate {
    /// All of them, in the order of the board's parameter.
    pub const ALL: [(Self, &'static str); 3] =
        [(Self::Never, "never"), (Self::OnLegs, "on legs"), (Self::Free, "free")];

    /// The board's parameter `app.separate`.
    #[must_use]
    pub fn parameter(self) -> f64 {
        f64::from(self as u8)
    }
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
pub struct SurveyLine {
    /// Where it starts, north and east, m.
    pub from_m: [f64; 2],
    /// Where it ends, north and east, m.
    pub to_m: [f64; 2],
    /// Depth, m.
    pub depth_m: f64,
}

impl Mission {
    /// The waypoints for the backseat, in order.
    pub fn waypoints(&self) -> Vec<Waypoint> {
        match self {
            Self::Waypoints(waypoints) => waypoints
                .iter()
                .map(|w| Waypoint { x_m: w.x_m, y_m: w.y_m, depth_m: w.depth_m, speed_mps: w.speed_mps })
                .collect(),
            Self::Lawnmower(lawnmower) => lawnmower.waypoints(),
        }
    }

    /// Gives every leg this speed, m/s.
    pub fn set_speed(&mut self, speed_mps: f64) {
        match self {
            Self::Waypoints(waypoints) => waypoints.iter_mut().for_each(|waypoint| waypoint.speed_mps = speed_mps),
            Self::Lawnmower(lawnmower) => lawnmower.speed_mps = speed_mps,
        }
    }

    /// The lines on which the true track is judged; `start_m` is where the first leg begins.
    pub fn lines(&self, start_m: [f64; 2]) -> Vec<SurveyLine> {
        match self {
            Self::Waypoints(waypoints) => {
                let ends = waypoints.iter().map(|w| [w.x_m, w.y_m]);
                let starts = std::iter::once(start_m).chain(ends.clone());
                starts
                    .zip(ends)
                    .zip(waypoints)
                    .filter(|(_, waypoint)| waypoint.scored)
                    .map(|((from_m, to_m), waypoint)| SurveyLine { from_m, to_m, depth_m: waypoint.depth_m })
                    .collect()
            }
            Self::Lawnmower(lawnmower) => lawnmower.survey_lines().collect(),
        }
    }
}

impl Lawnmower {
    fn survey_lines(&self) -> impl Iterator<Item = SurveyLine> {
        (0..self.lines.get()).map(|index| {
            let across = f64::from(index) * self.spacing_m;
            let (near, far) = (self.place(0.0, across), self.place(self.length_m, across));
            let (from_m, to_m) = if index.is_multiple_of(2) { (near, far) } else { (far, near) };
            SurveyLine { from_m, to_m, depth_m: self.depth_m }
        })
    }

    /// A place so far along and to starboard of the first line.
    fn place(&self, along: f64, across: f64) -> [f64; 2] {
        let (sin, cos) = libm::sincos(self.heading_rad);
        [self.first_line_m[0] + along * cos - across * sin, self.first_line_m[1] + along * sin + across * cos]
    }

    fn waypoints(&self) -> Vec<Waypoint> {
        let to = |[x_m, y_m]: [f64; 2], depth_m| Waypoint { x_m, y_m, depth_m, speed_mps: self.speed_mps };
        let last = self.lines.get() - 1;
        let end = if last.is_multiple_of(2) { self.length_m + self.run_out_m } else { -self.run_out_m };
        std::iter::once(to(self.place(-self.dive_m, 0.0), 0.0))
            .chain(self.survey_lines().flat_map(|line| [to(line.from_m, line.depth_m), to(line.to_m, line.depth_m)]))
            .chain([to(self.place(end, f64::from(last) * self.spacing_m), 0.0)])
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_lines_to_the_east() {
        let mission = Mission::Lawnmower(Lawnmower {
            lines: 3.try_into().unwrap(),
            length_m: 100.0,
            spacing_m: 10.0,
            first_line_m: [5.0, 0.0],
            heading_rad: std::f64::consts::FRAC_PI_2,
            speed_mps: 1.5,
            depth_m: 4.0,
            dive_m: 30.0,
            run_out_m: 50.0,
        });
        let expected = [
            [5.0, -30.0, 0.0],
            [5.0, 0.0, 4.0],
            [5.0, 100.0, 4.0],
            [-5.0, 100.0, 4.0],
            [-5.0, 0.0, 4.0],
            [-15.0, 0.0, 4.0],
            [-15.0, 100.0, 4.0],
            [-15.0, 150.0, 0.0],
        ];
        let waypoints = mission.waypoints();
        assert_eq!(waypoints.len(), expected.len());
        for (waypoint, [x, y, depth]) in waypoints.iter().zip(expected) {
            // cos(π/2) is 6e-17 and multiplies lengths of 100 m.
            assert!((waypoint.x_m - x).abs() < 1e-13 && (waypoint.y_m - y).abs() < 1e-13);
            assert_eq!((waypoint.depth_m, waypoint.speed_mps), (depth, 1.5));
        }
        assert_eq!(mission.lines([0.0, 0.0]).len(), 3);
    }

    #[test]
    fn explicit_legs_are_judged_where_asked() {
        let leg = |x_m, scored| MissionWaypoint { x_m, y_m: 0.0, depth_m: 3.0, speed_mps: 1.0, scored };
        let mission = Mission::Waypoints(vec![leg(10.0, true), leg(20.0, false), leg(30.0, true)]);
        let lines = mission.lines([-5.0, 0.0]);
        assert_eq!(lines[0], SurveyLine { from_m: [-5.0, 0.0], to_m: [10.0, 0.0], depth_m: 3.0 });
        assert_eq!(lines[1], SurveyLine { from_m: [20.0, 0.0], to_m: [30.0, 0.0], depth_m: 3.0 });
    }
}
