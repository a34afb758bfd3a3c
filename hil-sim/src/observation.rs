//! What the world shows: the seam between the physics and the emulated devices.
//!
//! An observation is a measurement in SI units before any device has encoded it. Device emulators
//! turn it into bytes, with their own delays, resolutions and sign conventions.

use backseat_logs::{Column, LogRow};

/// One measurement and the instant it was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// When it was taken, µs since the start of the scenario. For acoustic arrivals this is the
    /// true time of arrival, rounded to the µs.
    pub time_us: u64,
    /// What was measured.
    pub kind: ObservationKind,
}

/// What was measured, with its noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ObservationKind {
    /// Depth of the centre of gravity.
    Depth {
        /// Down, m.
        depth_m: f64,
    },
    /// Attitude and rates, taken together.
    Ahrs {
        /// Roll, pitch, heading, rad; heading is true (a compass that sends magnetic heading
        /// subtracts the declination when it encodes).
        euler_rad: [f64; 3],
        /// p, q, r, rad/s.
        rates_radps: [f64; 3],
    },
    /// DVL ensemble in body axes.
    Dvl {
        /// Velocity over ground u, v, w, m/s; `None` without bottom lock.
        velocity_mps: Option<[f64; 3]>,
        /// Height over the bottom, m; `None` without bottom lock.
        altitude_m: Option<f64>,
    },
    /// GNSS receiver of the vehicle; `None` while the antenna is under water.
    VehicleGnss {
        /// The fix, if there is one.
        fix: Option<GnssFix>,
    },
    /// GNSS receiver of the ship (the backseat never sees it; the centralized filter does).
    ShipGnss {
        /// North, east, m.
        position_m: [f64; 2],
    },
    /// A ship's packet begins to arrive at the vehicle.
    Downlink(OneWay),
    /// A vehicle's packet begins to arrive at the ship.
    Uplink(OneWay),
    /// The ship's answer to the vehicle's ping begins to arrive at the vehicle.
    TwoWay(TwoWay),
    /// The ship's ping reaches the vehicle, whose answer is under way.
    ShipTwoWay(ShipTwoWay),
}

impl ObservationKind {
    /// Puts a measurement of a sensor or a downlink into its columns of a row of the vehicle log; `false` if it is none, or
    /// there is nothing to put.
    pub(crate) fn log<'a>(&self, row: impl FnOnce() -> &'a mut LogRow) -> bool {
        match self {
            Self::Depth { depth_m } => row().set(Column::Depth, *depth_m),
            Self::Ahrs { euler_rad, rates_radps } => {
                row().set_all(Column::Roll, euler_rad).set_all(Column::P, rates_radps)
            }
            Self::Dvl { velocity_mps: Some(velocity_mps), .. } => row().set_all(Column::DvlU, velocity_mps),
            Self::VehicleGnss { fix: Some(fix) } => row().set_all(Column::GpsX, &fix.position_m),
            Self::ShipGnss { position_m } => row().set_all(Column::ShipGpsX, position_m),
            Self::Downlink(packet) => {
                packet.log(row().set(Column::Range, packet.range_m).set(Column::RangeRate, packet.range_rate_mps))
            }
            _ => return false,
        };
        true
    }
}

/// A position fix of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GnssFix {
    /// When it was taken, µs since the start of the scenario.
    pub time_us: u64,
    /// North, east, m.
    pub position_m: [f64; 2],
    /// Speed over ground, m/s.
    pub speed_mps: f64,
    /// Course over ground, rad, 0 to 2π.
    pub course_rad: f64,
}

/// The ship's state in a packet: its own estimate, not the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShipReport {
    /// North, east at the time of launch, m.
    pub position_m: [f64; 2],
    /// North, east velocity over ground, m/s.
    pub velocity_mps: [f64; 2],
    /// One sigma of the position per axis, m.
    pub position_sigma_m: f64,
    /// One sigma of the velocity per axis, m/s.
    pub velocity_sigma_mps: f64,
}

impl ShipReport {
    /// What a packet says that carries no ship's state: an uplink, a ping, an abort.
    pub const NONE: Self =
        Self { position_m: [0.0; 2], velocity_mps: [0.0; 2], position_sigma_m: 0.0, velocity_sigma_mps: 0.0 };
}

/// From one modem to the other, one way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OneWay {
    /// Time of launch, µs since the start of the scenario; of a downlink a whole second.
    pub tol_us: u64,
    /// Time of arrival as the receiver's clock and detector measure it (with noise and clock error),
    /// µs; `range_m` is (`toa_us` − `tol_us`) times the declared sound speed, to rounding.
    pub toa_us: u64,
    /// True time at which the packet's last byte has arrived, µs; sentences follow it.
    pub end_us: u64,
    /// Measured range, m.
    pub range_m: f64,
    /// Measured range rate, m/s, positive opening.
    pub range_rate_mps: f64,
    /// Of a downlink the payload, of an uplink the ship's estimate of itself at the arrival.
    pub ship: ShipReport,
}

impl OneWay {
    /// Puts its times and its ship into a row of the vehicle log.
    pub(crate) fn log<'a>(&self, row: &'a mut LogRow) -> &'a mut LogRow {
        row.set(Column::Tol, self.tol_us as f64 * 1e-6)
            .set(Column::Toa, self.toa_us as f64 * 1e-6)
            .set_all(Column::ShipX, &self.ship.position_m)
    }
}

/// Vehicle to ship and back; needs no common clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoWay {
    /// The vehicle's ping left, µs.
    pub tol_us: u64,
    /// The ship's answer left, true time, µs.
    pub reply_us: u64,
    /// Half of (round trip minus turnaround), s: what the modem reports.
    pub one_way_time_s: f64,
    /// The same times the declared sound speed, m.
    pub range_m: f64,
}

/// Ship to vehicle and back; needs no common clock, and is known on the ship.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShipTwoWay {
    /// The ship's ping left, µs.
    pub tol_us: u64,
    /// The vehicle's answer reaches the ship, true time, µs.
    pub reply_us: u64,
    /// Half of (round trip minus turnaround), s: what the modem reports.
    pub one_way_time_s: f64,
}
