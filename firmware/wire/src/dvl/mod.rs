//! Doppler velocity logs of Teledyne RDI: PD0, PD4, PD5, PD6, and the one sample they all become.
//!
//! Instrument axes: y towards beam 3, x towards beam 2, z away from the bottom. PD4, PD5 and PD6 give the velocity of
//! the vehicle, PD0 that of the bottom relative to the instrument: its signs are opposite. [`DvlSample`] has neither
//! trap.

pub mod pd0;
pub mod pd4;
pub mod pd6;

/// What one ping means to the vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DvlSample {
    /// Velocity of the vehicle over ground, body frame forward, starboard, down, m/s.
    /// `None` without bottom lock and when [`Self::frame`] is not fixed to the vehicle.
    pub bottom_mps: Option<[f64; 3]>,
    /// The same relative to the water layer below the instrument.
    pub water_mps: Option<[f64; 3]>,
    /// Height above the bottom (mean of the beams that see it), m.
    pub altitude_m: Option<f64>,
    /// Difference of the two vertical velocities of the beam pairs, m/s: a measure of quality. `None` in a three-beam
    /// solution.
    pub error_mps: Option<f64>,
    /// Roll, pitch, heading of the instrument's own sensors, rad.
    pub attitude_rad: Option<[f64; 3]>,
    /// Depth of the transducer by the instrument's pressure sensor, m.
    pub depth_m: Option<f64>,
    /// Speed of sound that scaled the velocities, m/s.
    pub sound_speed_mps: Option<f64>,
    /// Time of the ping by the instrument's clock, s of the day.
    pub time_of_day_s: Option<f64>,
    /// Frame the instrument was set up to report in.
    pub frame: Coordinates,
}

/// Frame of the velocities on the wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coordinates {
    /// Instrument axes; the mounting angle applies.
    #[default]
    Instrument,
    /// Along the beams.
    Beam,
    /// Ship axes, rotated by the instrument (`EA`); the mounting angle does not apply.
    Ship,
    /// Ship axes levelled with the instrument's tilts: not fixed to the vehicle.
    ShipLevelled,
    /// East, north, up.
    Earth,
}

impl Coordinates {
    /// From the two coordinate bits and the tilt bit of a PD0 or PD4 header.
    pub(crate) const fn from_bits(coordinates: u8, tilts: bool) -> Self {
        match (coordinates & 0b11, tilts) {
            (0b00, _) => Self::Beam,
            (0b01, _) => Self::Instrument,
            (0b10, false) => Self::Ship,
            (0b10, true) => Self::ShipLevelled,
            _ => Self::Earth,
        }
    }

    /// The two coordinate bits and the tilt bit.
    pub(crate) const fn to_bits(self) -> (u8, bool) {
        match self {
            Self::Beam => (0b00, false),
            Self::Instrument => (0b01, false),
            Self::Ship => (0b10, false),
            Self::ShipLevelled => (0b10, true),
            Self::Earth => (0b11, false),
        }
    }

    /// Body velocity [forward, starboard, down] of x, y, z on the wire (vehicle relative to bottom or water).
    ///
    /// `mounting_rad` is the direction of beam 3 in the vehicle, positive from forward to starboard (rotation about
    /// body z).
    pub fn to_body(self, xyz: [f64; 3], mounting_rad: f64) -> Option<[f64; 3]> {
        let [x, y, z] = xyz;
        let (sine, cosine) = self.mounting(mounting_rad)?;
        Some([cosine * y - sine * x, sine * y + cosine * x, -z])
    }

    /// The inverse of [`Self::to_body`].
    pub fn from_body(self, body: [f64; 3], mounting_rad: f64) -> Option<[f64; 3]> {
        let [forward, starboard, down] = body;
        let (sine, cosine) = self.mounting(mounting_rad)?;
        Some([cosine * starboard - sine * forward, cosine * forward + sine * starboard, -down])
    }

    fn mounting(self, mounting_rad: f64) -> Option<(f64, f64)> {
        match self {
            Self::Instrument => Some((libm::sin(mounting_rad), libm::cos(mounting_rad))),
            Self::Ship => Some((0.0, 1.0)),
            Self::Beam | Self::ShipLevelled | Self::Earth => None,
        }
    }
}

/// mm/s of a velocity, `None` for "invalid".
pub(crate) const INVALID: i16 = i16::MIN;

/// X, Y, Z in m/s when all three are valid.
pub(crate) fn velocity_mps(mmps: [i16; 4]) -> Option<[f64; 3]> {
    let [x, y, z, _] = mmps;
    if x == INVALID || y == INVALID || z == INVALID {
        return None;
    }
    Some([x, y, z].map(|component| f64::from(component) / 1_000.0))
}

/// The error velocity in m/s.
pub(crate) fn error_mps(mmps: [i16; 4]) -> Option<f64> {
    let [x, y, z, error] = mmps;
    (![x, y, z, error].contains(&INVALID)).then(|| f64::from(error) / 1_000.0)
}

/// m/s to mm/s, saturating short of the mark for "invalid".
pub(crate) fn to_mmps(mps: f64) -> i16 {
    let mmps = libm::round(mps * 1_000.0);
    if mmps.is_nan() { INVALID } else { (mmps as i16).max(INVALID + 1) }
}

/// Mean of the ranges that are not zero, m.
pub(crate) fn altitude_m(range_cm: [u32; 4]) -> Option<f64> {
    let seen = range_cm.iter().filter(|range| **range > 0).count() as f64;
    let sum: u64 = range_cm.iter().map(|range| u64::from(*range)).sum();
    (sum > 0).then(|| sum as f64 / seen / 100.0)
}

/// Seconds of the day of hour, minute, second, hundredth.
pub(crate) fn time_of_day_s(clock: [u8; 4]) -> f64 {
    let [hour, minute, second, hundredth] = clock.map(u32::from);
    f64::from(((hour * 60 + minute) * 60 + second) * 100 + hundredth) / 100.0
}

/// Hour, minute, second, hundredth; the inverse within a day.
pub(crate) fn clock(time_of_day_s: f64) -> [u8; 4] {
    let hundredths = libm::round(time_of_day_s * 100.0) as u32 % 8_640_000;
    [
        (hundredths / 360_000) as u8,
        (hundredths / 6_000 % 60) as u8,
        (hundredths / 100 % 60) as u8,
        (hundredths % 100) as u8,
    ]
}

/// Hundredths of a degree in [0, 36000).
pub(crate) fn heading_cdeg(cdeg: f64) -> u16 {
    (cdeg as i64).rem_euclid(36_000) as u16
}
