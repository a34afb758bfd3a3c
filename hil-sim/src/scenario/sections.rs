//! The tables of a scenario file, as they are written.
//!
//! Every key carries its unit. What is left out takes the default that stands here; noise left out
//! takes the `[sensors]` of the vehicle file.

use crate::quantity;
use backseat_wire::ship_state::Key;
use serde::Deserialize;

/// The default of `epilogue_s`.
pub(super) const fn epilogue_s() -> f64 {
    10.0
}

/// `[start]`: the vehicle at time zero.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// North, m.
    #[serde(deserialize_with = "quantity::coordinate")]
    pub x_m: f64,
    /// East, m.
    #[serde(deserialize_with = "quantity::coordinate")]
    pub y_m: f64,
    /// Down, m; 0 lets it float at the surface.
    #[serde(deserialize_with = "quantity::depth")]
    pub depth_m: f64,
    /// True heading, rad.
    #[serde(deserialize_with = "quantity::angle")]
    pub heading_rad: f64,
    /// Speed ahead through the water, m/s.
    #[serde(deserialize_with = "quantity::speed")]
    pub speed_mps: f64,
}

/// `[environment]`: water, place and date.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Environment {
    /// Latitude of the local frame's origin, degrees north.
    #[serde(deserialize_with = "quantity::latitude")]
    pub origin_latitude_deg: f64,
    /// Longitude of the local frame's origin, degrees east.
    #[serde(deserialize_with = "quantity::longitude")]
    pub origin_longitude_deg: f64,
    /// UTC of time zero, whole seconds since 1970.
    pub start_unix_s: u32,
    /// Magnetic declination, positive east, rad.
    #[serde(deserialize_with = "quantity::angle")]
    pub magnetic_declination_rad: f64,
    /// Sound speed that everybody declares, m/s.
    #[serde(deserialize_with = "quantity::sound_speed")]
    pub sound_speed_mps: f64,
    /// Depth of the flat bottom, m.
    #[serde(deserialize_with = "quantity::positive")]
    pub bottom_depth_m: f64,
    /// The water's own motion.
    pub current: Current,
}

impl Default for Environment {
    fn default() -> Self {
        Self {
            origin_latitude_deg: 41.5,
            origin_longitude_deg: -70.7,
            start_unix_s: 1_748_952_000, // 2025-06-03 12:00:00 UTC
            magnetic_declination_rad: 0.0,
            sound_speed_mps: 1500.0,
            bottom_depth_m: 20.0,
            current: Current::default(),
        }
    }
}

/// `[environment.current]`: steady part, linear shear with depth, change from place to place and a rotary tide, added
/// up; all of it from its onset on, and on one side of a front.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Current {
    /// Steady current at the surface, north, m/s.
    #[serde(deserialize_with = "quantity::velocity")]
    pub north_mps: f64,
    /// Steady current at the surface, east, m/s.
    #[serde(deserialize_with = "quantity::velocity")]
    pub east_mps: f64,
    /// Change of the north current with depth, m/s per m.
    #[serde(deserialize_with = "quantity::shear")]
    pub shear_north_mps_per_m: f64,
    /// Change of the east current with depth, m/s per m.
    #[serde(deserialize_with = "quantity::shear")]
    pub shear_east_mps_per_m: f64,
    /// Amplitude of the rotary tide, m/s.
    #[serde(deserialize_with = "quantity::speed")]
    pub tide_mps: f64,
    /// Period of the rotary tide, s.
    #[serde(deserialize_with = "quantity::duration")]
    pub tide_period_s: f64,
    /// Direction the tide flows to at time zero, rad; it turns clockwise.
    #[serde(deserialize_with = "quantity::angle")]
    pub tide_phase_rad: f64,
    /// Change of the north and of the east current with the distance east, m/s per m.
    #[serde(deserialize_with = "quantity::shear")]
    pub gradient_per_s: [f64; 2],
    /// The current sets in at this time and grows over five minutes, s; 0: it is there from the start.
    #[serde(deserialize_with = "quantity::delay")]
    pub onset_s: f64,
    /// The current flows east of this line only, across a front of some 40 m, m; everywhere if left out.
    #[serde(deserialize_with = "quantity::coordinate")]
    pub front_east_m: Option<f64>,
}

impl Default for Current {
    fn default() -> Self {
        Self {
            north_mps: 0.0,
            east_mps: 0.0,
            shear_north_mps_per_m: 0.0,
            shear_east_mps_per_m: 0.0,
            tide_mps: 0.0,
            tide_period_s: 44_714.0, // M2, 12.42 h
            tide_phase_rad: 0.0,
            gradient_per_s: [0.0; 2],
            onset_s: 0.0,
            front_east_m: None,
        }
    }
}

/// How the ship moves, before its wander.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ShipTrack {
    /// On the circle about the centre, clockwise seen from above.
    #[default]
    Circle,
    /// It keeps its station, or is moored: at rest where the circle would begin. A buoy's swing is a large wander.
    Station,
    /// It drifts from there on a straight course.
    Drift,
    /// It steams to and fro from there, along a line on its course.
    Line,
}

/// `[ship]`: constant speed on a track, plus a small wander.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Ship {
    /// How it moves.
    pub track: ShipTrack,
    /// Course of a drift or a line, rad.
    #[serde(deserialize_with = "quantity::angle")]
    pub course_rad: f64,
    /// Length of a line, m.
    #[serde(deserialize_with = "quantity::positive")]
    pub length_m: f64,
    /// Centre of the circle, north and east, m.
    #[serde(deserialize_with = "quantity::coordinate")]
    pub centre_m: [f64; 2],
    /// Radius of the circle, m; of the other tracks the distance of their start from the centre.
    #[serde(deserialize_with = "quantity::positive")]
    pub radius_m: f64,
    /// Speed along the track, m/s.
    #[serde(deserialize_with = "quantity::speed")]
    pub speed_mps: f64,
    /// Bearing of the ship from the centre at time zero, rad.
    #[serde(deserialize_with = "quantity::angle")]
    pub bearing_rad: f64,
    /// Standard deviation of the wander about the track, per axis, m.
    #[serde(deserialize_with = "quantity::non_negative")]
    pub wander_m: f64,
    /// Period of the wander, s.
    #[serde(deserialize_with = "quantity::duration")]
    pub wander_period_s: f64,
    /// Depth of the transducer, m.
    #[serde(deserialize_with = "quantity::depth")]
    pub transducer_depth_m: f64,
    /// Acceleration that the ship's own estimator allows for, m/s²/√Hz.
    #[serde(deserialize_with = "quantity::positive")]
    pub estimator_mps2_per_sqrt_hz: f64,
}

impl Default for Ship {
    fn default() -> Self {
        Self {
            track: ShipTrack::Circle,
            course_rad: 0.0,
            length_m: 1000.0,
            centre_m: [500.0, 450.0],
            radius_m: 600.0,
            speed_mps: 2.0,
            bearing_rad: 0.0,
            wander_m: 0.5,
            wander_period_s: 120.0,
            transducer_depth_m: 0.0,
            estimator_mps2_per_sqrt_hz: 0.02,
        }
    }
}

/// Who pings whom in a slot of the cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Exchange {
    /// Ship to vehicle, one way.
    Downlink,
    /// Vehicle to ship, one way.
    Uplink,
    /// Vehicle to ship and back.
    TwoWay,
    /// Ship to vehicle and back: only the ship's own program sends it.
    ShipPing,
}

/// One slot of the cycle.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slot {
    /// Launch after the start of the cycle, whole seconds (packets leave on a PPS edge).
    pub offset_s: u32,
    /// What happens.
    pub exchange: Exchange,
    /// With the companion, rather than with the vehicle.
    #[serde(default)]
    pub companion: bool,
}

/// `[companion]`: a second vehicle that flies the same mission beside the first, in slots of its own.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Companion {
    /// Its modem address.
    pub address: u8,
    /// Its start, mission and fence from those of the first, north and east, m.
    #[serde(deserialize_with = "quantity::coordinate")]
    pub shift_m: [f64; 2],
}

/// `[acoustics]`: the TDMA cycle and the channel.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Acoustics {
    /// Start of the first cycle, whole seconds.
    pub first_s: u32,
    /// Length of the cycle, whole seconds.
    pub period_s: std::num::NonZeroU32,
    /// Slots of the cycle.
    pub slots: Vec<Slot>,
    /// Time from the first to the last byte of a packet on the air, s.
    #[serde(deserialize_with = "quantity::delay")]
    pub packet_duration_s: f64,
    /// Share of packets that are lost.
    #[serde(deserialize_with = "quantity::share")]
    pub loss_share: f64,
    /// Paths longer than this are never heard, m.
    #[serde(deserialize_with = "quantity::positive")]
    pub max_range_m: f64,
    /// Time the ship takes to answer a ping, s.
    #[serde(deserialize_with = "quantity::delay")]
    pub turnaround_s: f64,
    /// One sigma of the range, m; the vehicle file's `sensors.range_m` if left out.
    #[serde(deserialize_with = "quantity::non_negative")]
    pub range_sigma_m: Option<f64>,
    /// One sigma of the range rate, m/s; the vehicle file's `sensors.range_rate_mps` if left out.
    #[serde(deserialize_with = "quantity::non_negative")]
    pub range_rate_sigma_mps: Option<f64>,
    /// The vehicle's modem has a pulse per second; without one it measures no one-way range (not with `--topside off`).
    pub vehicle_pulse: bool,
    /// Key of the packets' authentication code, 32 hexadecimal digits: ship and board share it; none if left out.
    #[serde(deserialize_with = "quantity::key")]
    pub key: Key,
    /// Modem address of the vehicle.
    pub address: u8,
    /// Whether `sim run` has topside on the ship unless its options say otherwise.
    pub topside: bool,
}

impl Default for Acoustics {
    fn default() -> Self {
        Self {
            first_s: 60,
            period_s: const { std::num::NonZeroU32::new(30).unwrap() },
            slots: vec![Slot { offset_s: 0, exchange: Exchange::Downlink, companion: false }],
            packet_duration_s: 3.6,
            loss_share: 0.0,
            max_range_m: 3000.0,
            turnaround_s: 1.0,
            range_sigma_m: None,
            range_rate_sigma_mps: None,
            vehicle_pulse: true,
            key: Key::NONE,
            address: 2,
            topside: true,
        }
    }
}

/// `[plant]`: physics that the declared vehicle leaves out.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Plant {
    /// Integration step, µs; a divisor of one second, at most 10 000 (100 Hz).
    #[serde(deserialize_with = "quantity::step_us")]
    pub step_us: u64,
    /// Factor on the process noise of the vehicle file.
    #[serde(deserialize_with = "quantity::factor")]
    pub process_noise_factor: f64,
    /// Fastest a fin servo turns, rad/s.
    #[serde(deserialize_with = "quantity::positive")]
    pub servo_rate_radps: f64,
    /// Time constant of the propeller's speed, s.
    #[serde(deserialize_with = "quantity::delay")]
    pub propeller_lag_s: f64,
    /// Factor on the area of each fin: top, bottom, port, starboard.
    #[serde(deserialize_with = "quantity::factor")]
    pub fin_area_factor: [f64; 4],
    /// There is a surface at which the hull loses buoyancy.
    pub surface: bool,
    /// Added to the declared vector from centre of buoyancy to centre of gravity, m.
    #[serde(deserialize_with = "quantity::lever")]
    pub cg_offset_m: [f64; 3],
}

impl Default for Plant {
    fn default() -> Self {
        Self {
            step_us: 10_000,
            process_noise_factor: 1.0,
            servo_rate_radps: 1.5,
            propeller_lag_s: 0.2,
            fin_area_factor: [1.0; 4],
            surface: true,
            cg_offset_m: [0.0; 3],
        }
    }
}
