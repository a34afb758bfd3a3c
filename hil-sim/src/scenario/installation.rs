//! `[installation]`: where the simulated sensors really sit. What is declared stands in the vehicle file.

use crate::quantity;
use serde::Deserialize;

/// `[installation]`: positions from the centre of gravity, body frame; turns are roll, pitch, yaw of the sensor's axes
/// in the body; data arrive the delay after they were valid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Installation {
    /// DVL, m.
    #[serde(deserialize_with = "quantity::arm")]
    pub dvl_arm_m: [f64; 3],
    /// DVL, rad.
    #[serde(deserialize_with = "quantity::turn")]
    pub dvl_turn_rad: [f64; 3],
    /// DVL, s.
    #[serde(deserialize_with = "quantity::delay")]
    pub dvl_delay_s: f64,
    /// AHRS, rad.
    #[serde(deserialize_with = "quantity::turn")]
    pub ahrs_turn_rad: [f64; 3],
    /// AHRS, s.
    #[serde(deserialize_with = "quantity::delay")]
    pub ahrs_delay_s: f64,
    /// Pressure sensor, m.
    #[serde(deserialize_with = "quantity::arm")]
    pub depth_arm_m: [f64; 3],
    /// Pressure sensor, s.
    #[serde(deserialize_with = "quantity::delay")]
    pub depth_delay_s: f64,
    /// GNSS antenna, m.
    #[serde(deserialize_with = "quantity::arm")]
    pub gnss_arm_m: [f64; 3],
    /// GNSS, s beyond what the emulated receiver takes by itself.
    #[serde(deserialize_with = "quantity::delay")]
    pub gnss_delay_s: f64,
    /// Acoustic transducer, m.
    #[serde(deserialize_with = "quantity::arm")]
    pub transducer_arm_m: [f64; 3],
    /// What modem and hardware add to every time of flight, s.
    #[serde(deserialize_with = "quantity::delay")]
    pub transducer_delay_s: f64,
}
