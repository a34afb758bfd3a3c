//! The tables of a scenario file, as they are written.
//!
//! Every key carries its unit. What is left out takes the default that stands here; noise left out
//! takes the `[sensors]` of the vehicle file.

use crate::quantity::{self, settings};
use backseat_wire::ship_state::Key;
use serde::Deserialize;

/// The default of `log_required`.
pub(super) const fn log_required() -> bool {
    true
}

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

settings! {
    /// `[environment]`: water, place and date.
    #[derive(Copy)]
    pub struct Environment {
        /// Latitude of the local frame's origin, degrees north.
        origin_latitude_deg: f64 as "quantity::latitude" = 41.5,
        /// Longitude of the local frame's origin, degrees east.
        origin_longitude_deg: f64 as "quantity::longitude" = -70.7,
        /// UTC of time zero, whole seconds since 1970.
        start_unix_s: u32 = 1_748_952_000, // 2025-06-03 12:00:00 UTC
        /// Magnetic declination, positive east, rad.
        magnetic_declination_rad: f64 as "quantity::angle" = 0.0,
        /// Sound speed that everybody declares, m/s.
        sound_speed_mps: f64 as "quantity::sound_speed" = 1500.0,
        /// Depth of the flat bottom, m.
        bottom_depth_m: f64 as "quantity::positive" = 20.0,
        /// The water's own motion.
        current: Current = Current::default(),
    }

    /// `[environment.current]`: steady part, linear shear with depth, change from place to place and a rotary tide,
    /// added up; all of it from its onset on, and on one side of a front.
    #[derive(Copy)]
    pub struct Current {
        /// Steady current at the surface, north, m/s.
        north_mps: f64 as "quantity::velocity" = 0.0,
        /// Steady current at the surface, east, m/s.
        east_mps: f64 as "quantity::velocity" = 0.0,
        /// Change of the north current with depth, m/s per m.
        shear_north_mps_per_m: f64 as "quantity::shear" = 0.0,
        /// Change of the east current with depth, m/s per m.
        shear_east_mps_per_m: f64 as "quantity::shear" = 0.0,
        /// Amplitude of the rotary tide, m/s.
        tide_mps: f64 as "quantity::speed" = 0.0,
        /// Period of the rotary tide, s.
        tide_period_s: f64 as "quantity::duration" = 44_714.0, // M2, 12.42 h
        /// Direction the tide flows to at time zero, rad; it turns clockwise.
        tide_phase_rad: f64 as "quantity::angle" = 0.0,
        /// Change of the north and of the east current with the distance east, m/s per m.
        gradient_per_s: [f64; 2] as "quantity::shear" = [0.0; 2],
        /// The current sets in at this time and grows over five minutes, s; 0: it is there from the start.
        onset_s: f64 as "quantity::delay" = 0.0,
        /// The current flows east of this line only, across a front of some 40 m, m; everywhere if left out.
        front_east_m: Option<f64> as "quantity::coordinate" = None,
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

settings! {
    /// `[ship]`: constant speed on a track, plus a small wander.
    #[derive(Copy)]
    pub struct Ship {
        /// How it moves.
        track: ShipTrack = ShipTrack::Circle,
        /// Course of a drift or a line, rad.
        course_rad: f64 as "quantity::angle" = 0.0,
        /// Length of a line, m.
        length_m: f64 as "quantity::positive" = 1000.0,
        /// Centre of the circle, north and east, m.
        centre_m: [f64; 2] as "quantity::coordinate" = [500.0, 450.0],
        /// Radius of the circle, m; of the other tracks the distance of their start from the centre.
        radius_m: f64 as "quantity::positive" = 600.0,
        /// Speed along the track, m/s.
        speed_mps: f64 as "quantity::speed" = 2.0,
        /// Bearing of the ship from the centre at time zero, rad.
        bearing_rad: f64 as "quantity::angle" = 0.0,
        /// Standard deviation of the wander about the track, per axis, m.
        wander_m: f64 as "quantity::non_negative" = 0.5,
        /// Period of the wander, s.
        wander_period_s: f64 as "quantity::duration" = 120.0,
        /// Depth of the transducer, m.
        transducer_depth_m: f64 as "quantity::depth" = 0.0,
        /// Acceleration that the ship's own estimator allows for, m/s²/√Hz.
        estimator_mps2_per_sqrt_hz: f64 as "quantity::positive" = 0.02,
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
    /// Modem address of the companion that it is with, rather than with the vehicle.
    #[serde(default)]
    pub companion: Option<u8>,
}

/// `[[companion]]`: a further vehicle that flies the same mission beside the first, in slots of its own.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Companion {
    /// Its modem address.
    pub address: u8,
    /// Its start, mission and fence from those of the first, north and east, m.
    #[serde(deserialize_with = "quantity::coordinate")]
    pub shift_m: [f64; 2],
}

settings! {
    /// `[acoustics]`: the TDMA cycle and the channel.
    pub struct Acoustics {
        /// Start of the first cycle, whole seconds.
        first_s: u32 = 60,
        /// Length of the cycle, whole seconds.
        period_s: std::num::NonZeroU32 = const { std::num::NonZeroU32::new(30).unwrap() },
        /// Slots of the cycle.
        slots: Vec<Slot> = vec![Slot { offset_s: 0, exchange: Exchange::Downlink, companion: None }],
        /// Time from the first to the last byte of a packet on the air, s.
        packet_duration_s: f64 as "quantity::delay" = 3.6,
        /// Share of packets that are lost.
        loss_share: f64 as "quantity::share" = 0.0,
        /// The ship leaves: packets sent from this time on are not heard, s.
        until_s: Option<f64> as "quantity::duration" = None,
        /// Paths longer than this are never heard, m.
        max_range_m: f64 as "quantity::positive" = 3000.0,
        /// Time the ship takes to answer a ping, s.
        turnaround_s: f64 as "quantity::delay" = 1.0,
        /// One sigma of the range, m; the vehicle file's `sensors.range_m` if left out.
        range_sigma_m: Option<f64> as "quantity::non_negative" = None,
        /// One sigma of the range rate, m/s; the vehicle file's `sensors.range_rate_mps` if left out.
        range_rate_sigma_mps: Option<f64> as "quantity::non_negative" = None,
        /// The vehicle's modem has a pulse per second; without one it measures no one-way range (not with `--topside
        /// off`).
        vehicle_pulse: bool = true,
        /// Key of the packets' authentication code, 32 hexadecimal digits: ship and board share it; none if left out.
        key: Key as "quantity::key" = Key::NONE,
        /// Modem address of the vehicle.
        address: u8 = 2,
        /// By so much the vehicle's uplinks misstate its place, north and east, m.
        misstated_m: [f64; 2] as "quantity::coordinate" = [0.0; 2],
        /// Whether `sim run` has topside on the ship unless its options say otherwise.
        topside: bool = true,
    }

    /// `[plant]`: physics that the declared vehicle leaves out.
    #[derive(Copy)]
    pub struct Plant {
        /// Integration step, µs; a divisor of one second, at most 10 000 (100 Hz).
        step_us: u64 as "quantity::step_us" = 10_000,
        /// Factor on the process noise of the vehicle file.
        process_noise_factor: f64 as "quantity::factor" = 1.0,
        /// Fastest a fin servo turns, rad/s.
        servo_rate_radps: f64 as "quantity::positive" = 1.5,
        /// Time constant of the propeller's speed, s.
        propeller_lag_s: f64 as "quantity::delay" = 0.2,
        /// Factor on the area of each fin: top, bottom, port, starboard.
        fin_area_factor: [f64; 4] as "quantity::factor" = [1.0; 4],
        /// There is a surface at which the hull loses buoyancy.
        surface: bool = true,
        /// Its hull is round where it leaves the water: awash it loses little. Otherwise buoyancy is in proportion to depth.
        round_hull: bool = false,
        /// Added to the declared vector from centre of buoyancy to centre of gravity, m.
        cg_offset_m: [f64; 3] as "quantity::lever" = [0.0; 3],
    }
}
