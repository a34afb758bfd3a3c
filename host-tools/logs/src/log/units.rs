//! Units that a mapping takes, and in which columns are recorded by mistake: what one of each is in the column's own.

use std::f64::consts::PI;

/// rad/s in one rpm.
pub const RADPS_PER_RPM: f64 = PI / 30.0;
pub(crate) const RAD_PER_DEG: f64 = PI / 180.0;
pub(crate) const MPS_PER_KNOT: f64 = 1852.0 / 3600.0;
pub(crate) const M_PER_FOOT: f64 = 0.3048;
/// Weight of sea water of 1025 kg/m³, N/m³.
pub(crate) const SEA_WATER_N_PER_M3: f64 = 1025.0 * 9.81;

/// A unit, and what one of it is in the column's own.
pub type Unit = (&'static str, f64);

/// Units of a time.
pub const TIME: &[Unit] =
    &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("min", 60.0), ("h", 3600.0), ("d", 86_400.0)];

/// Pressures, Pa.
pub(crate) const PASCALS: [Unit; 6] =
    [("dbar", 1e4), ("bar", 1e5), ("kPa", 1e3), ("mbar", 1e2), ("Pa", 1.0), ("psi", 6_894.757)];

/// The same, as a depth in sea water, m.
static PRESSURES: [Unit; 6] = {
    let mut units = PASCALS;
    let mut at = 0;
    while at < units.len() {
        units[at].1 /= SEA_WATER_N_PER_M3;
        at += 1;
    }
    units
};

/// Units by the ending of a column's name, frequent ones first; a cdeg is a hundredth of a degree.
const UNITS: [(&str, &[Unit]); 9] = [
    (
        "_radps",
        &[
            ("rad/s", 1.0),
            ("deg/s", RAD_PER_DEG),
            ("deg/min", RAD_PER_DEG / 60.0),
            ("mrad/s", 1e-3),
            ("rpm", RADPS_PER_RPM),
        ],
    ),
    (
        "_rad",
        &[
            ("rad", 1.0),
            ("deg", RAD_PER_DEG),
            ("cdeg", RAD_PER_DEG / 100.0),
            ("mrad", 1e-3),
            ("gon", PI / 200.0),
            ("mil", PI / 3200.0),
        ],
    ),
    (
        "_mps",
        &[
            ("m/s", 1.0),
            ("kn", MPS_PER_KNOT),
            ("mm/s", 1e-3),
            ("cm/s", 1e-2),
            ("km/h", 1.0 / 3.6),
            ("ft/s", M_PER_FOOT),
        ],
    ),
    ("_rpm", &[("rpm", 1.0), ("rad/s", 1.0 / RADPS_PER_RPM), ("1/s", 60.0), ("rps", 60.0), ("deg/s", 1.0 / 6.0)]),
    ("_per_m3", &[("kg/m^3", 1.0), ("g/cm^3", 1e3)]),
    ("_m3", &[("m^3", 1.0), ("l", 1e-3), ("cc", 1e-6)]),
    (
        "_m",
        &[
            ("m", 1.0),
            ("ft", M_PER_FOOT),
            ("cm", 1e-2),
            ("mm", 1e-3),
            ("km", 1e3),
            ("fathom", 6.0 * M_PER_FOOT),
            ("in", M_PER_FOOT / 12.0),
            ("yd", 3.0 * M_PER_FOOT),
            ("nmi", 1852.0),
        ],
    ),
    ("_s", &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)]),
    ("_deg", &[("deg", 1.0), ("rad", 1.0 / RAD_PER_DEG)]),
];

/// Units of a column by its name, its own first; a depth may be a pressure.
pub fn of(column: &str) -> impl Iterator<Item = &'static Unit> + Clone {
    let units = UNITS.iter().find(|(ending, _)| column.ends_with(ending)).map_or(&[("1", 1.0)][..], |(_, units)| units);
    units.iter().chain(if column == "depth_m" { &PRESSURES[..] } else { &[] })
}

/// What one of a unit is in the own unit of a column; `None` of a unit that it does not take.
#[must_use]
pub fn factor(column: &str, unit: &str) -> Option<f64> {
    of(column).find(|(known, _)| *known == unit).map(|(_, factor)| *factor)
}
