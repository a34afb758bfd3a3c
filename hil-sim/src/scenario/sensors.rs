//! `[sensors]`: one table a sensor. Noise left out is the vehicle file's.

use crate::quantity::{self, settings};
use serde::Deserialize;

/// `[sensors]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sensors {
    /// Pressure depth.
    pub depth: Depth,
    /// Attitude and rates.
    pub ahrs: Ahrs,
    /// Doppler log.
    pub dvl: Dvl,
    /// GNSS of the vehicle.
    pub gnss: Gnss,
    /// GNSS of the ship.
    pub ship_gnss: ShipGnss,
}

settings! {
    /// `[sensors.depth]`.
    #[derive(Copy)]
    pub struct Depth {
        /// Present at all.
        fitted: bool = true,
        /// Samples per second.
        rate_hz: f64 as "quantity::rate" = 7.0,
        /// Time of the first sample, s; the defaults keep sensors from sampling all at once.
        offset_s: f64 as "quantity::delay" = 0.14,
        /// One sigma, m; else `sensors.depth_m` of the vehicle file.
        sigma_m: Option<f64> as "quantity::non_negative" = None,
    }

    /// `[sensors.ahrs]`.
    #[derive(Copy)]
    pub struct Ahrs {
        /// Present at all.
        fitted: bool = true,
        /// Samples per second.
        rate_hz: f64 as "quantity::rate" = 3.0,
        /// Time of the first sample, s; the defaults keep sensors from sampling all at once.
        offset_s: f64 as "quantity::delay" = 0.05,
        /// One sigma of roll, pitch, and heading if it has none of its own, rad; else `sensors.attitude_rad`.
        attitude_sigma_rad: Option<f64> as "quantity::non_negative" = None,
        /// One sigma of heading, rad; else `attitude_sigma_rad`, or `sensors.heading_rad` without one.
        heading_sigma_rad: Option<f64> as "quantity::non_negative" = None,
        /// One sigma of each rate, rad/s; else `sensors.rates_radps`.
        rates_sigma_radps: Option<f64> as "quantity::non_negative" = None,
    }

    /// `[sensors.dvl]`.
    #[derive(Copy)]
    pub struct Dvl {
        /// Present at all.
        fitted: bool = true,
        /// Samples per second.
        rate_hz: f64 as "quantity::rate" = 5.0,
        /// Time of the first sample, s; the defaults keep sensors from sampling all at once.
        offset_s: f64 as "quantity::delay" = 0.2,
        /// One sigma of each component, m/s; else `sensors.dvl_mps`.
        sigma_mps: Option<f64> as "quantity::non_negative" = None,
        /// One sigma of the altitude, m.
        altitude_sigma_m: f64 as "quantity::non_negative" = 0.05,
        /// Bottom lock is lost below this altitude, m.
        min_altitude_m: f64 as "quantity::length" = 0.5,
        /// Bottom lock is lost above this altitude, m.
        max_altitude_m: f64 as "quantity::length" = 80.0,
        /// Bottom lock is lost for good at this time, s.
        until_s: Option<f64> as "quantity::duration" = None,
    }

    /// `[sensors.gnss]`: receiver of the vehicle.
    #[derive(Copy)]
    pub struct Gnss {
        /// Present at all.
        fitted: bool = true,
        /// Samples per second.
        rate_hz: f64 as "quantity::rate" = 1.0,
        /// Time of the first sample, s; the defaults keep sensors from sampling all at once.
        offset_s: f64 as "quantity::delay" = 0.0,
        /// One sigma per axis, m; else `sensors.gnss_m`.
        sigma_m: Option<f64> as "quantity::non_negative" = None,
        /// Deeper than this there is no fix, m.
        max_depth_m: f64 as "quantity::depth" = 0.3,
    }

    /// `[sensors.ship_gnss]`.
    #[derive(Copy)]
    pub struct ShipGnss {
        /// Present at all.
        fitted: bool = true,
        /// Samples per second.
        rate_hz: f64 as "quantity::rate" = 1.0,
        /// Time of the first sample, s; the defaults keep sensors from sampling all at once.
        offset_s: f64 as "quantity::delay" = 0.0,
        /// One sigma per axis, m; else `sensors.ship_gnss_m`.
        sigma_m: Option<f64> as "quantity::non_negative" = None,
    }
}
