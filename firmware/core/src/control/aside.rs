//! Short, harmless departures from a leg, which tell two causes apart that a straight line does not.

use super::trackline::Segment;
use crate::dynamics::FINS;

/// How far the line is shifted, m.
const CROSS_M: f64 = 10.0;
/// The line is regained over this distance (κ of the guidance), m.
const APPROACH_M: f64 = 20.0;
/// By how much a change of speed changes it, as a share.
const SPEED_SHARE: f64 = 0.25;
/// Angle of a doublet, rad.
const DOUBLET_RAD: f64 = 0.1;
/// How much shallower a pause in depth is, m: never deeper.
const SHALLOWER_M: f64 = 0.5;

/// A departure from what a leg asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Aside {
    /// The line is shifted to starboard by so much, m.
    pub cross_m: f64,
    /// It is shallower, m.
    pub shallower_m: f64,
    /// It is flown faster by this share of its speed.
    pub faster: f64,
    /// Added to the fins, rad.
    pub fins_rad: [f64; FINS],
}

impl Aside {
    /// What is asked for instead of a leg.
    #[must_use]
    pub fn of(&self, leg: &Segment) -> Segment {
        let (sin, cos) = libm::sincos(leg.course_rad());
        let shifted = |[north_m, east_m]: [f64; 2]| [north_m - sin * self.cross_m, east_m + cos * self.cross_m];
        Segment {
            from_ne_m: shifted(leg.from_ne_m),
            to_ne_m: shifted(leg.to_ne_m),
            depth_m: leg.depth_m - self.shallower_m,
            speed_mps: leg.speed_mps * (1.0 + self.faster),
        }
    }
}

/// The table of manoeuvres.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Manoeuvre {
    /// Slower, then faster.
    Speed,
    /// The vertical fins to either side.
    Rudder,
    /// The horizontal fins to either side.
    Elevator,
    /// Half a metre shallower for a while.
    Depth,
    /// A parallel line and back: two headings. It alone leaves the line.
    Turn,
}

/// All of them.
pub const MANOEUVRES: [Manoeuvre; 5] =
    [Manoeuvre::Speed, Manoeuvre::Rudder, Manoeuvre::Elevator, Manoeuvre::Depth, Manoeuvre::Turn];

impl Manoeuvre {
    /// Its number in telemetry, from 1 on.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8 + 1
    }

    /// The manoeuvre of that number.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        MANOEUVRES.get(usize::from(number).checked_sub(1)?).copied()
    }

    /// In words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Speed => "a change of speed",
            Self::Rudder => "a doublet of the rudder",
            Self::Elevator => "a doublet of the elevator",
            Self::Depth => "a pause in depth",
            Self::Turn => "a turn on two headings",
        }
    }

    /// How long it takes, s.
    #[must_use]
    pub const fn duration_s(self) -> f64 {
        match self {
            Self::Rudder | Self::Elevator => 8.0,
            Self::Speed | Self::Depth => 40.0,
            Self::Turn => 80.0,
        }
    }

    /// The departure at a time since it began, s.
    #[must_use]
    pub fn aside(self, t_s: f64) -> Aside {
        let late = t_s >= 0.5 * self.duration_s();
        // a doublet takes two seconds to each side, twice
        let angle_rad = if t_s % 4.0 < 2.0 { DOUBLET_RAD } else { -DOUBLET_RAD };
        match self {
            Self::Speed => Aside { faster: if late { SPEED_SHARE } else { -SPEED_SHARE }, ..Aside::default() },
            // (3.1.4): yaw by top = −bottom, pitch by port = −starboard
            Self::Rudder => Aside { fins_rad: [angle_rad, -angle_rad, 0.0, 0.0], ..Aside::default() },
            Self::Elevator => Aside { fins_rad: [0.0, 0.0, angle_rad, -angle_rad], ..Aside::default() },
            Self::Depth => Aside { shallower_m: SHALLOWER_M, ..Aside::default() },
            Self::Turn => Aside { cross_m: if late { 0.0 } else { CROSS_M }, ..Aside::default() },
        }
    }

    /// How far it turns the vehicle, at a time since it began and at a speed, rad: as the guidance does.
    #[must_use]
    pub fn heading_rad(self, t_s: f64, speed_mps: f64) -> f64 {
        if !matches!(self, Self::Turn) {
            return 0.0;
        }
        let half_s = 0.5 * self.duration_s();
        let approach_rad = CROSS_M / APPROACH_M * libm::exp(-speed_mps * (t_s % half_s) / APPROACH_M);
        if t_s < half_s { approach_rad } else { -approach_rad }
    }

    /// It leaves the line.
    #[must_use]
    pub const fn leaves_line(self) -> bool {
        matches!(self, Self::Turn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_manoeuvre_is_bounded_and_comes_back() {
        let leg = Segment { to_ne_m: [0.0, 500.0], depth_m: 3.0, speed_mps: 1.0, ..Segment::default() };
        assert_eq!(Aside::default().of(&leg), leg);
        for manoeuvre in MANOEUVRES {
            assert_eq!(Manoeuvre::from_number(manoeuvre.number()), Some(manoeuvre));
            let mut sum = [0.0; FINS];
            for step in 0..(10.0 * manoeuvre.duration_s()) as u32 {
                let aside = manoeuvre.aside(0.1 * f64::from(step));
                let asked = aside.of(&leg);
                assert!((2.5..=3.0).contains(&asked.depth_m) && (0.75..=1.25).contains(&asked.speed_mps));
                assert!((0.0..=10.0).contains(&-asked.from_ne_m[0]) && asked.from_ne_m[1].abs() < 1e-9, "{asked:?}");
                assert!(manoeuvre.leaves_line() || aside.cross_m == 0.0);
                sum.iter_mut().zip(aside.fins_rad).for_each(|(sum, fin)| *sum += fin);
            }
            assert!(sum.iter().all(|sum| sum.abs() < 1e-9), "as long to one side as to the other");
        }
        assert_eq!((Manoeuvre::from_number(0), Manoeuvre::from_number(6)), (None, None));
    }
}
