//! `[sensors]`: one table a sensor. Noise left out is the vehicle file's.

use crate::quantity;
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

/// `[sensors.depth]`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Depth {
    /// Present at all.
    pub fitted: bool,
    /// Samples per second.
    #[serde(deserialize_with = "quantity::rate")]
    pub rate_hz: f64,
    /// Time of the first sample, s; the defaults keep sensors from sampling all at once.
    #[serde(deserialize_with = "quantity::delay")]
    pub offset_s: f64,
    /// One sigma, m; else `sensors.depth_m` of the vehicle file.
    #[serde(deserialize_with = "quantity::non_negative")]
    pub sigma_m: Option<f64>,
}

impl Default for Depth {
    fn default() -> Self {
        Self { fitted: true, rate_hz: 7.0, offset_s: 0.14, sigma_m: None }
    }
}

/// `[sensors.ahrs]`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Ahrs {
    /// Present at all.
    pub fitted: bool,
    /// Samples per second.
    #[serde(deserialize_with = "quantity::rate")]
    pub rate_hz: f64,
    /// Time of the first sample, s; the defaults keep sensors from sampling all at once.
    #[serde(deserialize_with = "quantity::delay")]
    pub offset_s: f64,
    /// One sigma of roll, pitch, and heading if it has none of its own, rad; else `sensors.attitude_rad`.
    #[serde(deserialize_with = "quantity::non_negative")]
    pub attitude_sigma_rad: Option<f64>,
    /// One sigma of heading, rad; else `attitude_sigma_rad`, or `sensors.heading_rad` without one.
    #[serde(deserialize_with = "quantity::non_negative")]
    pub heading_sigma_rad: Option<f64>,
    /// One sigma of each rate, rad/s; else `sensors.rates_radps`.
    #[serde(deserialize_with = "quantity::non_negative")]
    pub rates_sigma_radps: Option<f64>,
}

impl Default for Ahrs {
    fn default() -> Self {
        Self {
            fitted: true,
            rate_hz: 3.0,
            offset_s: 0.05,
            attitude_sigma_rad: None,
            heading_sigma_rad: None,
            rates_sigma_radps: None,
        }
    }
}

/// `[sensors.dvl]`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Dvl {
    /// Present at all.
    pub fitted: bool,
    /// Samples per second.
    #[serde(deserialize_with = "quantity::rate")]
    pub rate_hz: f64,
    /// Time of the first sample, s; the defaults keep sensors from sampling all at once.
    #[serde(deserialize_with = "quantity::delay")]
    pub offset_s: f64,
    /// One sigma of each component, m/s; else `sensors.dvl_mps`.
    #[serde(deserialize_with = "quantity::non_negative")]
    pub sigma_mps: Option<f64>,
    /// One sigma of the altitude, m.
    #[serde(deserialize_with = "quantity::non_negative")]
    pub altitude_sigma_m: f64,
    /// Bottom lock is lost below this altitude, m.
    #[serde(deserialize_with = "quantity::length")]
    pub min_altitude_m: f64,
    /// Bottom lock is lost above this altitude, m.
    #[serde(deserialize_with = "quantity::length")]
    pub max_altitude_m: f64,
    /// Bottom lock is lost for good at this time, s.
    #[serde(deserialize_with = "quantity::duration")]
    pub until_s: Option<f64>,
}

impl Default for Dvl {
    fn default() -> Self {
        Self {
            fitted: true,
            rate_hz: 5.0,
            offset_s: 0.2,
            sigma_mps: None,
            altitude_sigma_m: 0.05,
            min_altitude_m: 0.5,
            max_altitude_m: 80.0,
            until_s: None,
        }
    }
}

/// `[sensors.gnss]`: receiver of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Gnss {
    /// Present at all.
    pub fitted: bool,
    /// Samples per second.
    #[serde(deserialize_with = "quantity::rate")]
    pub rate_hz: f64,
    /// Time of the first sample, s; the defaults keep sensors from sampling all at once.
    #[serde(deserialize_with = "quantity::delay")]
    pub offset_s: f64,
    /// One sigma per axis, m; else `sensors.gnss_m`.
    #[serde(deserialize_with = "quantity::non_negative")]
    pub sigma_m: Option<f64>,
    /// Deeper than this there is no fix, m.
    #[serde(deserialize_with = "quantity::depth")]
    pub max_depth_m: f64,
}

impl Default for Gnss {
    fn default() -> Self {
        Self { fitted: true, rate_hz: 1.0, offset_s: 0.0, sigma_m: None, max_depth_m: 0.3 }
    }
}

/// `[sensors.ship_gnss]`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ShipGnss {
    /// Present at all.
    pub fitted: bool,
    /// Samples per second.
    #[serde(deserialize_with = "quantity::rate")]
    pub rate_hz: f64,
    /// Time of the first sample, s; the defaults keep sensors from sampling all at once.
    #[serde(deserialize_with = "quantity::delay")]
    pub offset_s: f64,
    /// One sigma per axis, m; else `sensors.ship_gnss_m`.
    #[serde(deserialize_with = "quantity::non_negative")]
    pub sigma_m: Option<f64>,
}

impl Default for ShipGnss {
    fn default() -> Self {
        Self { fitted: true, rate_hz: 1.0, offset_s: 0.0, sigma_m: None }
    }
}
