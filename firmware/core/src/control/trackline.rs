//! Trackline error (3.25)-(3.29): where the vehicle stands relative to a straight line between two corners.

use crate::state::{self, VehicleState};

/// A straight line in the horizontal plane, held at one depth and speed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Segment {
    /// Start, north and east, m.
    pub from_ne_m: [f64; 2],
    /// End, north and east, m.
    pub to_ne_m: [f64; 2],
    /// Depth z_d, m.
    pub depth_m: f64,
    /// Speed u_d through the water, m/s.
    pub speed_mps: f64,
}

/// Error about a [`Segment`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrackError {
    /// Distance covered along the line from its start, m.
    pub along_m: f64,
    /// Distance left to the end of the line along it, m; negative once passed.
    pub remaining_m: f64,
    /// d_y: offset to the right of the line seen along it, m.
    pub cross_m: f64,
    /// d_z: depth minus desired depth, m; positive is too deep.
    pub depth_m: f64,
    /// Course of the line, rad.
    pub course_rad: f64,
}

impl Segment {
    /// Length in the horizontal plane, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        libm::hypot(self.to_ne_m[0] - self.from_ne_m[0], self.to_ne_m[1] - self.from_ne_m[1])
    }

    /// Course χ of the line, rad; north for a line without length.
    #[must_use]
    pub fn course_rad(&self) -> f64 {
        libm::atan2(self.to_ne_m[1] - self.from_ne_m[1], self.to_ne_m[0] - self.from_ne_m[0])
    }

    /// Error of the vehicle at `x` (3.25)-(3.29).
    #[must_use]
    pub fn error(&self, x: &VehicleState) -> TrackError {
        let course_rad = self.course_rad();
        let (sin, cos) = libm::sincos(course_rad);
        let north = x[state::X] - self.from_ne_m[0];
        let east = x[state::Y] - self.from_ne_m[1];
        let along_m = cos * north + sin * east;
        TrackError {
            along_m,
            remaining_m: self.length_m() - along_m,
            cross_m: cos * east - sin * north,
            depth_m: x[state::Z] - self.depth_m,
            course_rad,
        }
    }
}
