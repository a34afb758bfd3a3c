//! Units at the edges.

use core::f64::consts::PI;

/// m/s in a knot.
pub(crate) const KNOT_MPS: f64 = 1852.0 / 3600.0;
/// Metres in an international foot.
pub(crate) const FOOT_M: f64 = 0.3048;
/// m/s² in the g of the sensor makers.
pub(crate) const G_MPS2: f64 = 9.806_65;

pub(crate) fn radians(degrees: f64) -> f64 {
    degrees * (PI / 180.0)
}

pub(crate) fn degrees(radians: f64) -> f64 {
    radians * (180.0 / PI)
}
