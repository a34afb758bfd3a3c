//! The measurements, and the record of every fusion.

use crate::effects::SensorChannel;

/// A sensor as the consistency statistics know it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {
    /// Pressure depth.
    Depth,
    /// Roll, pitch, heading.
    Attitude,
    /// Body rates.
    Rates,
    /// DVL velocity over the bottom.
    BottomTrack,
    /// DVL velocity through the water.
    WaterTrack,
    /// GNSS of the surfaced vehicle.
    VehicleGnss,
    /// GNSS of the ship.
    ShipGnss,
    /// Acoustic range (one-way or two-way).
    Range,
    /// Acoustic range rate.
    RangeRate,
    /// Range and direction by USBL.
    Usbl,
    /// One-way range to another vehicle.
    Peer,
}

impl Sensor {
    /// All sensors, in the order of their discriminants.
    pub const ALL: [Self; 11] = [
        Self::Depth,
        Self::Attitude,
        Self::Rates,
        Self::BottomTrack,
        Self::WaterTrack,
        Self::VehicleGnss,
        Self::ShipGnss,
        Self::Range,
        Self::RangeRate,
        Self::Usbl,
        Self::Peer,
    ];

    /// Name used in logs, telemetry and JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::Attitude => "attitude",
            Self::Rates => "rates",
            Self::BottomTrack => "dvl",
            Self::WaterTrack => "dvl_water",
            Self::VehicleGnss => "gnss",
            Self::ShipGnss => "ship_gnss",
            Self::Range => "range",
            Self::RangeRate => "range_rate",
            Self::Usbl => "usbl",
            Self::Peer => "peer",
        }
    }
}

/// A delayed state held by the filter. Stale ids are refused, never misread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CloneId {
    pub(crate) slot: u8,
    pub(crate) generation: u32,
}

/// The vehicle's end of an acoustic path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VehicleEnd {
    /// The present state.
    Now,
    /// A vehicle clone, moved by `bridge_s` seconds along its velocity over ground (negative:
    /// before the clone was taken).
    Delayed {
        /// The clone.
        clone: CloneId,
        /// Time of the acoustic event minus time of the clone, s.
        bridge_s: f64,
    },
}

/// The ship's state as it came in an acoustic packet.
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

/// Another vehicle as its packet says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeerReport {
    /// Its modem address.
    pub address: u8,
    /// Its transducer at the time of launch: north, east, down, m.
    pub position_m: [f64; 3],
    /// Variance north, covariance, variance east, m².
    pub covariance_m2: [f64; 3],
    /// Since its last fix it has used another vehicle's range.
    pub leans: bool,
}

/// The ship's end of an acoustic path, or what is there in place of a ship.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShipEnd {
    /// The filter's present ship state (centralized, uplink).
    Now,
    /// The filter's ship clone (centralized, downlink).
    Delayed(CloneId),
    /// What the packet says; its error is taken as independent of the filter's.
    Reported(ShipReport),
    /// A fixed transponder (LBL) at this declared place: north, east, down, m.
    Transponder([f64; 3]),
    /// Another vehicle, whose errors of one packet are those of the next.
    Peer(PeerReport),
}

/// What the angles of a USBL fix count from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UsblAxes {
    /// Seen from the ship, levelled and turned to north: bearing clockwise from true north, elevation above the horizontal.
    Level,
    /// Seen from the vehicle: bearing clockwise from the bow, elevation above the deck. The vehicle's end is the present.
    Body,
}

/// A fix by USBL: range and direction from the array to the other end, and their errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UsblFix {
    /// What the angles count from.
    pub axes: UsblAxes,
    /// Slant range, m.
    pub range_m: f64,
    /// Bearing, rad.
    pub bearing_rad: f64,
    /// Elevation, positive up, rad.
    pub elevation_rad: f64,
    /// One sigma of the range, m.
    pub range_sigma_m: f64,
    /// One sigma of the direction, in either way across, rad.
    pub angle_sigma_rad: f64,
}

/// The two ends between which sound travelled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AcousticPath {
    /// The vehicle at its own acoustic event (arrival for a downlink, launch for an uplink).
    pub vehicle: VehicleEnd,
    /// The ship at its own acoustic event.
    pub ship: ShipEnd,
}

/// One measurement, valid at the filter's present time (clones excepted).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measurement {
    /// Depth of the centre of gravity, m.
    Depth {
        /// z, m.
        z_m: f64,
    },
    /// Euler angles, rad.
    Attitude {
        /// φ, θ, ψ (true), rad.
        euler_rad: [f64; 3],
    },
    /// Body rates, rad/s.
    Rates {
        /// p, q, r, rad/s.
        rates_radps: [f64; 3],
    },
    /// DVL velocity over ground in body axes, m/s.
    BottomTrack {
        /// u, v, w over ground, m/s.
        velocity_mps: [f64; 3],
    },
    /// DVL velocity through the water in body axes, m/s.
    WaterTrack {
        /// u, v, w through the water, m/s.
        velocity_mps: [f64; 3],
    },
    /// GNSS fix of the surfaced vehicle, m.
    VehicleGnss {
        /// North, east, m.
        position_m: [f64; 2],
    },
    /// GNSS fix of the ship, m.
    ShipGnss {
        /// North, east, m.
        position_m: [f64; 2],
    },
    /// One-way-travel-time range (2.34), downlink or uplink.
    Range {
        /// Between which ends.
        path: AcousticPath,
        /// Measured range, m.
        range_m: f64,
    },
    /// Range rate (2.39) of a one-way packet, positive opening.
    RangeRate {
        /// Between which ends.
        path: AcousticPath,
        /// Measured range rate, m/s.
        range_rate_mps: f64,
    },
    /// Two-way ping: half the sum of the outward and the return path.
    TwoWayRange {
        /// Vehicle when it sent, ship when it replied.
        outward: AcousticPath,
        /// Vehicle when it received, ship when it replied.
        back: AcousticPath,
        /// Half of (round-trip time minus turnaround) times sound speed, m.
        range_m: f64,
    },
    /// Range and direction by USBL.
    Usbl {
        /// Between which ends.
        path: AcousticPath,
        /// What was measured.
        fix: UsblFix,
    },
}

impl Measurement {
    /// Which sensor it comes from; a two-way ping is a range, a range to another vehicle is none.
    #[must_use]
    pub const fn sensor(&self) -> Sensor {
        match self {
            Self::Depth { .. } => Sensor::Depth,
            Self::Attitude { .. } => Sensor::Attitude,
            Self::Rates { .. } => Sensor::Rates,
            Self::BottomTrack { .. } => Sensor::BottomTrack,
            Self::WaterTrack { .. } => Sensor::WaterTrack,
            Self::VehicleGnss { .. } => Sensor::VehicleGnss,
            Self::ShipGnss { .. } => Sensor::ShipGnss,
            Self::Range { path: AcousticPath { ship: ShipEnd::Peer(_), .. }, .. } => Sensor::Peer,
            Self::Range { .. } | Self::TwoWayRange { .. } => Sensor::Range,
            Self::RangeRate { .. } => Sensor::RangeRate,
            Self::Usbl { .. } => Sensor::Usbl,
        }
    }

    /// The readings, one number per scalar; those that are left out are zero.
    pub(crate) fn readings(&self) -> &[f64] {
        match self {
            Self::Depth { z_m: one }
            | Self::Range { range_m: one, .. }
            | Self::RangeRate { range_rate_mps: one, .. }
            | Self::TwoWayRange { range_m: one, .. }
            | Self::Usbl { fix: UsblFix { range_m: one, .. }, .. } => core::slice::from_ref(one),
            Self::VehicleGnss { position_m } | Self::ShipGnss { position_m } => position_m,
            Self::Attitude { euler_rad: three }
            | Self::Rates { rates_radps: three }
            | Self::BottomTrack { velocity_mps: three }
            | Self::WaterTrack { velocity_mps: three } => three,
        }
    }

    /// What its errors are common to.
    pub(crate) const fn channel(&self) -> SensorChannel {
        match self {
            Self::Depth { .. } => SensorChannel::Depth,
            Self::Attitude { .. } => SensorChannel::Attitude,
            Self::Rates { .. } => SensorChannel::Rates,
            Self::BottomTrack { .. } | Self::WaterTrack { .. } => SensorChannel::Dvl,
            Self::VehicleGnss { .. } | Self::ShipGnss { .. } => SensorChannel::Gnss,
            Self::Range { .. } => SensorChannel::Range,
            Self::RangeRate { .. } => SensorChannel::RangeRate,
            Self::TwoWayRange { .. } => SensorChannel::TwoWayRange,
            Self::Usbl { .. } => SensorChannel::Usbl,
        }
    }

    /// How many scalars it has.
    #[must_use]
    pub const fn scalars(&self) -> usize {
        match self {
            Self::Depth { .. } | Self::Range { .. } | Self::RangeRate { .. } | Self::TwoWayRange { .. } => 1,
            Self::VehicleGnss { .. } | Self::ShipGnss { .. } => 2,
            Self::Attitude { .. } | Self::Rates { .. } | Self::BottomTrack { .. } => 3,
            Self::WaterTrack { .. } | Self::Usbl { .. } => 3,
        }
    }
}

/// Outcome of a scalar innovation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FusionOutcome {
    /// It updated the state.
    Fused,
    /// It lay outside the gate and was not used.
    Gated,
    /// It was not a finite number, its geometry was degenerate, or the filter (or its ship) is not initialised. Such a
    /// record has NaN as innovation and variance.
    Invalid,
    /// Its clone had been dropped.
    StaleClone,
    /// A range rate while the position is too uncertain for it: not used, and no contradiction. NaN, as if invalid.
    PositionUncertain,
    /// A range to another vehicle that would tell little, or whose place may rest on this filter's own.
    Redundant,
}

/// The one record that every scalar fusion leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FusionRecord {
    /// Which sensor.
    pub sensor: Sensor,
    /// Which component of it (0 = x, roll, u…).
    pub axis: u8,
    /// Filter time, µs.
    pub time_us: u64,
    /// z − h(x), in the sensor's unit.
    pub innovation: f64,
    /// S = H P Hᵀ + R, unit squared.
    pub variance: f64,
    /// innovation² / (gate² S); a measurement is rejected as a whole when one of its scalars has
    /// more than 1 before any is used.
    pub test_ratio: f64,
    /// Used or why not.
    pub outcome: FusionOutcome,
}

impl FusionRecord {
    /// Normalised innovation squared ν²/S.
    #[must_use]
    pub fn nis(&self) -> f64 {
        self.innovation * self.innovation / self.variance
    }
}

/// The records of one measurement: one to three scalars.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fusions {
    records: [Option<FusionRecord>; 3],
}

impl Fusions {
    pub(crate) const fn none() -> Self {
        Self { records: [None; 3] }
    }

    pub(crate) fn push(&mut self, record: FusionRecord) {
        if let Some(slot) = self.records.iter_mut().find(|slot| slot.is_none()) {
            *slot = Some(record);
        }
    }

    /// ln of the likelihood of the innovations, without its constant; NaN if one was invalid, 0 without one. Each counts
    /// with three sigmas at most: one of a reflected path, or behind a change that the filter is about to follow, says
    /// no more.
    #[must_use]
    pub fn log_likelihood(&self) -> f64 {
        const MOST: f64 = 9.0;
        let of = |record: &FusionRecord| {
            -0.5 * (if record.nis() > MOST { MOST } else { record.nis() } + libm::log(record.variance))
        };
        self.iter().map(of).sum()
    }

    /// The records in component order.
    pub fn iter(&self) -> impl Iterator<Item = &FusionRecord> {
        self.records.iter().flatten()
    }
}
