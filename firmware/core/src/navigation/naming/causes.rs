//! The table of causes: what each is made of, how large it may be, and how often it begins.

use super::columns::{
    CURRENT, DEPTH, DEPTH_RAMP, DRAG, FIN_ANGLE, FIN_COMMAND, FIN_LOST, GYRO, HEADING, PITCH, RANGE, RANGE_RAMP,
    RANGE_SCALE, SHIP, THRUST, THRUST_RAMP, TRIM_AHEAD, TRIM_STARBOARD, WEIGHT,
};
use super::sums::Direction;
use crate::dynamics::FINS;

/// What has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// A fin has lost a share of its lift and drag; size: that share.
    FinLost(u8),
    /// A fin stands still; size: its angle, rad.
    FinStuck(u8),
    /// A fin has slipped on its shaft; size: actual minus commanded angle, rad.
    FinSlipped(u8),
    /// The propeller pushes less; size: share lost.
    ThrustLost,
    /// It pushes less and less; size: share an hour.
    ThrustDecaying,
    /// More drag ahead, by a line or growth; size: share of the declared.
    DragGrown,
    /// Another weight: water came in, or a weight was dropped; size: kg; beside it kg m ahead of the centre of gravity.
    WeightChanged,
    /// The centre of gravity has moved; size: kg m ahead.
    TrimAhead,
    /// The same to starboard.
    TrimStarboard,
    /// Another current; size: north and east, m/s.
    CurrentChanged,
    /// The compass is off; size: rad.
    HeadingOffset,
    /// The compass has another iron beside it; size: times sine and times cosine of the heading, rad.
    HeadingHarmonic,
    /// The pitch sensor is off; size: rad.
    PitchOffset,
    /// The gyro about the vertical axis is off; size: rad/s.
    GyroOffset,
    /// The pressure sensor is off; size: m.
    DepthOffset,
    /// The pressure sensor drifts; size: m an hour.
    DepthDrift,
    /// A clock is off; size: m of range.
    ClockOffset,
    /// A clock drifts; size: m of range an hour.
    ClockDrift,
    /// Another sound speed; size: measured over true range, less 1.
    SoundSpeed,
    /// The ship says that it is where it is not; size: reported minus true, north and east, m.
    ShipMisplaced,
}

/// How many there are.
pub(super) const CAUSES: usize = 3 * FINS + 17;

/// The least share that a fin loses.
const LEAST_LOST: f64 = 0.05;

/// All of them.
pub const ALL: [Cause; CAUSES] = {
    let mut all = [Cause::ThrustLost; CAUSES];
    let mut i = 0;
    while i < FINS {
        all[i] = Cause::FinLost(i as u8);
        all[FINS + i] = Cause::FinStuck(i as u8);
        all[2 * FINS + i] = Cause::FinSlipped(i as u8);
        i += 1;
    }
    let others = [
        Cause::ThrustLost,
        Cause::ThrustDecaying,
        Cause::DragGrown,
        Cause::WeightChanged,
        Cause::TrimAhead,
        Cause::TrimStarboard,
        Cause::CurrentChanged,
        Cause::HeadingOffset,
        Cause::HeadingHarmonic,
        Cause::PitchOffset,
        Cause::GyroOffset,
        Cause::DepthOffset,
        Cause::DepthDrift,
        Cause::ClockOffset,
        Cause::ClockDrift,
        Cause::SoundSpeed,
        Cause::ShipMisplaced,
    ];
    let mut i = 0;
    while i < others.len() {
        all[3 * FINS + i] = others[i];
        i += 1;
    }
    all
};

/// A number of a cause: its direction in θ, and what it is before anything is measured.
#[derive(Clone, Copy)]
pub(super) struct Part {
    pub(super) direction: Direction,
    pub(super) mean: f64,
    pub(super) sigma: f64,
}

pub(super) const fn part(column: usize, sigma: f64) -> Part {
    Part { direction: [(column, 1.0), (0, 0.0)], mean: 0.0, sigma }
}

/// A change that grows from `onset_h` on.
const fn growing(ramp: usize, step: usize, onset_h: f64, sigma: f64) -> Part {
    Part { direction: [(ramp, 1.0), (step, -onset_h)], mean: 0.0, sigma }
}

/// Catalogue name of a cause, the names and units of its numbers.
type Words = (&'static str, [&'static str; 2], [&'static str; 2]);

impl Cause {
    /// Its number in telemetry and packets, from 1 on.
    #[must_use]
    pub fn number(self) -> u8 {
        ALL.iter().position(|cause| *cause == self).map_or(0, |place| place as u8 + 1)
    }

    /// The cause of that number.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        ALL.get(usize::from(number).checked_sub(1)?).copied()
    }

    /// The fin that it is about.
    #[must_use]
    pub const fn fin(self) -> Option<usize> {
        match self {
            Self::FinLost(fin) | Self::FinStuck(fin) | Self::FinSlipped(fin) => Some(fin as usize),
            _ => None,
        }
    }

    /// It is the other one, or about the same fin.
    #[must_use]
    pub fn is_of_the_same(self, other: Self) -> bool {
        self == other || (self.fin().is_some() && self.fin() == other.fin())
    }

    /// Its name, that of the catalogue of effects where it has one.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.words().0
    }

    /// Names and units of its numbers; empty where there is no second one.
    #[must_use]
    pub const fn numbers(self) -> [(&'static str, &'static str); 2] {
        let (_, [first, second], [unit, other]) = self.words();
        [(first, unit), (second, other)]
    }

    const fn words(self) -> Words {
        match self {
            Self::FinLost(_) => ("fin_lost", ["share_lost", ""], ["1", ""]),
            Self::FinStuck(_) => ("fin_stuck", ["rad", ""], ["rad", ""]),
            Self::FinSlipped(_) => ("fin_bias", ["rad", ""], ["rad", ""]),
            Self::ThrustLost => ("thrust_lost", ["share_lost", ""], ["1", ""]),
            Self::ThrustDecaying => ("thrust_decay", ["per_hour", ""], ["1/h", ""]),
            Self::DragGrown => ("drag_change", ["share", ""], ["1", ""]),
            Self::WeightChanged => ("weight_change", ["kg", "ahead_kg_m"], ["kg", "kg m"]),
            Self::TrimAhead => ("pitch_trim", ["ahead_kg_m", ""], ["kg m", ""]),
            Self::TrimStarboard => ("roll_trim", ["starboard_kg_m", ""], ["kg m", ""]),
            Self::CurrentChanged => ("water_current", ["north_mps", "east_mps"], ["m/s", "m/s"]),
            Self::HeadingOffset => ("heading_bias", ["const_rad", ""], ["rad", ""]),
            Self::HeadingHarmonic => ("heading_bias", ["sin_rad", "cos_rad"], ["rad", "rad"]),
            Self::PitchOffset => ("pitch_sensor", ["bias_rad", ""], ["rad", ""]),
            Self::GyroOffset => ("gyro_bias", ["r_radps", ""], ["rad/s", ""]),
            Self::DepthOffset => ("depth_bias", ["m", ""], ["m", ""]),
            Self::DepthDrift => ("depth_drift", ["m_per_hour", ""], ["m/h", ""]),
            Self::ClockOffset => ("clock_offset", ["range_m", ""], ["m", ""]),
            Self::ClockDrift => ("clock_drift", ["range_m_per_hour", ""], ["m/h", ""]),
            Self::SoundSpeed => ("sound_speed", ["ratio", ""], ["1", ""]),
            Self::ShipMisplaced => ("ship_position", ["north_m", "east_m"], ["m", "m"]),
        }
    }

    /// Whether there is such a size: a share that is lost is positive, and no propeller pushes more and more.
    pub(super) fn is_possible(self, size: &[f64; 2]) -> bool {
        match self {
            Self::FinLost(_) => size[0] > LEAST_LOST,
            Self::ThrustDecaying => size[0] > 0.0,
            _ => true,
        }
    }

    /// What it is made of, if it began at `onset_h`, hours since the sums began.
    pub(super) const fn parts(self, onset_h: f64) -> [Option<Part>; 2] {
        match self {
            Self::FinLost(fin) => {
                let lost = Part { mean: 0.5, ..part(FIN_LOST + fin as usize, 0.3) };
                // no sensor says how the hull drifts and heaves: the inflow at it is off by some tenths of a degree
                [Some(lost), Some(part(FIN_ANGLE + fin as usize, 0.01))]
            }
            Self::FinStuck(fin) => {
                let command = Part { mean: 1.0, ..part(FIN_COMMAND + fin as usize, 0.03) };
                [Some(part(FIN_ANGLE + fin as usize, 0.1)), Some(command)]
            }
            Self::FinSlipped(fin) => [Some(part(FIN_ANGLE + fin as usize, 0.1)), None],
            Self::ThrustLost => [Some(part(THRUST, 0.3)), None],
            Self::ThrustDecaying => [Some(growing(THRUST_RAMP, THRUST, onset_h, 0.2)), None],
            Self::DragGrown => [Some(part(DRAG, 0.7)), None],
            Self::WeightChanged => [Some(part(WEIGHT, 0.5)), Some(part(TRIM_AHEAD, 0.15))],
            Self::TrimAhead => [Some(part(TRIM_AHEAD, 0.15)), None],
            Self::TrimStarboard => [Some(part(TRIM_STARBOARD, 0.05)), None],
            Self::CurrentChanged => [Some(part(CURRENT, 0.15)), Some(part(CURRENT + 1, 0.15))],
            Self::HeadingOffset => [Some(part(HEADING, 0.05)), None],
            Self::HeadingHarmonic => [Some(part(HEADING + 1, 0.05)), Some(part(HEADING + 2, 0.05))],
            Self::PitchOffset => [Some(part(PITCH, 0.03)), None],
            Self::GyroOffset => [Some(part(GYRO, 0.005)), None],
            Self::DepthOffset => [Some(part(DEPTH, 0.5)), None],
            Self::DepthDrift => [Some(growing(DEPTH_RAMP, DEPTH, onset_h, 5.0)), None],
            Self::ClockOffset => [Some(part(RANGE, 5.0)), None],
            Self::ClockDrift => [Some(growing(RANGE_RAMP, RANGE, onset_h, 10.0)), None],
            Self::SoundSpeed => [Some(part(RANGE_SCALE, 0.01)), None],
            Self::ShipMisplaced => [Some(part(SHIP, 10.0)), Some(part(SHIP + 1, 10.0))],
        }
    }
}
