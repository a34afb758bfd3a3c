//! Attitude and heading references, and the one sample they all become.

pub mod gx3;
pub mod mip;
pub mod os5000;

use crate::Error;
use crate::units::G_MPS2;

/// Content of one frame, body frame forward, starboard, down of the sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AhrsSample {
    /// Roll, pitch, heading, rad; the heading as measured, magnetic or true as the device is set up.
    pub euler_rad: Option<[f64; 3]>,
    /// Body rates, rad/s.
    pub rates_radps: Option<[f64; 3]>,
    /// Specific force, m/s²: (0, 0, -9.8) level at rest.
    pub specific_force_mps2: Option<[f64; 3]>,
    /// The device's own clock, µs, without roll-over; its zero means nothing.
    pub timer_us: Option<u64>,
}

pub(crate) fn finite_within(values: [f64; 3], limit: f64) -> Result<[f64; 3], Error> {
    if values.iter().all(|value| libm::fabs(*value) <= limit) { Ok(values) } else { Err(Error::OutOfRange) }
}

/// Roll and yaw within a turn, pitch within a quarter turn and rounding.
pub(crate) fn euler(values: [f64; 3]) -> Result<[f64; 3], Error> {
    let [_, pitch, _] = values;
    // Single precision rounds 90 degrees up to 1.5707964.
    if libm::fabs(pitch) > core::f64::consts::FRAC_PI_2 + 1.0e-6 {
        return Err(Error::OutOfRange);
    }
    finite_within(values, core::f64::consts::TAU)
}

/// No sensor of this class turns faster (1200 deg/s) ...
pub(crate) fn rates(values: [f64; 3]) -> Result<[f64; 3], Error> {
    finite_within(values, 22.0)
}

/// ... nor measures more than 50 g.
pub(crate) fn specific_force(g: [f64; 3]) -> Result<[f64; 3], Error> {
    Ok(finite_within(g, 50.0)?.map(|component| component * G_MPS2))
}
