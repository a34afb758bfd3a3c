//! Logs of a small vehicle with DVL and AHRS at 10 Hz (repository nature1949/AUV_navigation_dataset).
//!
//! Axes are forward, left, up in an east-north-up frame with the yaw counted from east, counter-clockwise.

use super::format::{Format, Known, Role, known};
use crate::log::Column;
use std::borrow::Cow;
use std::f64::consts::FRAC_PI_2;

const fn turned(column: Column) -> Role {
    Role::scaled(column, -1.0)
}

const COLUMNS: &[Known] = &[
    known("t_s", Role::Seconds(1.0)),
    known("north_m", Role::plain(Column::GpsX)),
    known("east_m", Role::plain(Column::GpsY)),
    known("roll_rad", Role::plain(Column::Roll)),
    known("pitch_rad", turned(Column::Pitch)),
    known("yaw_enu_rad", Role::Sample { column: Column::Heading, scale: -1.0, offset: -FRAC_PI_2 }),
    known("dvl_fwd_mps", Role::plain(Column::DvlU)),
    known("dvl_left_mps", turned(Column::DvlV)),
    known("dvl_up_mps", turned(Column::DvlW)),
    known("wx_radps", Role::plain(Column::P)),
    known("wy_radps", turned(Column::Q)),
    known("wz_radps", turned(Column::R)),
];

/// The one format.
pub(super) static FORMAT: Format = Format {
    name: "DVL and AHRS log, forward-left-up axes",
    separators: b",",
    columns: Cow::Borrowed(COLUMNS),
    needed: &["t_s", "yaw_enu_rad", "dvl_fwd_mps", "dvl_left_mps"],
    every_column_needed: false,
    constants: Cow::Borrowed(&[]),
    dropped: &[
        ("lat", "north_m and east_m are used"),
        ("lon", "north_m and east_m are used"),
        ("raw", "velocities derived from the positions"),
    ],
    remarks: &["turned from forward-left-up to forward-right-down, yaw from east to heading from north"],
};

#[cfg(test)]
mod tests {
    use super::super::tests::import;
    use super::*;

    #[test]
    fn val_axes() {
        // Heading north (yaw 90 degrees from east), drifting to the right, sinking, turning to the right.
        let text = "t_s,lat_deg,lon_deg,north_m,east_m,roll_rad,pitch_rad,yaw_enu_rad,dvl_fwd_mps,dvl_left_mps,dvl_up_mps,wx_radps,wy_radps,wz_radps,vn_raw,ve_raw\n\
            0,34.5,108.4,1,2,0.1,0.2,1.5707963267948966,1.5,-0.2,-0.3,0.01,0.02,-0.03,0,0\n\
            0.1,34.5,108.4,1,2,0.1,0.2,-3.0,1.5,-0.2,-0.3,0.01,0.02,-0.03,0,0\n";
        let log = import(text).unwrap().log;
        let row = &log.rows[0];
        assert_eq!(row.attitude_rad(), Some([0.1, -0.2, 0.0]));
        assert_eq!(row.dvl_mps(), Some([1.5, 0.2, 0.3]));
        assert_eq!(row.rates_radps(), Some([0.01, -0.02, 0.03]));
        // 3 rad clockwise from east is 261.9 degrees from north, −98.1: 1.5708 + 3 − 2 π.
        let heading = log.rows[1].get(Column::Heading).unwrap();
        assert!((heading - (FRAC_PI_2 + 3.0 - std::f64::consts::TAU)).abs() < 1e-12); // rounding
    }
}
