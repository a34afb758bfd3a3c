//! A Slocum glider's flight and science logs (as in repository smerckel/gliderflight), times shared by both files.

use super::format::{Format, Known, Role, known};
use crate::log::Column;
use std::borrow::Cow;

const M_PER_INCH: f64 = 0.0254;
const M3_PER_CC: f64 = 1e-6;

const FLIGHT_COLUMNS: &[Known] = &[
    known("t_s", Role::Seconds(1.0)),
    known("pitch_rad", Role::plain(Column::Pitch)),
    known("roll_rad", Role::plain(Column::Roll)),
    known("heading_mag_rad", Role::plain(Column::Heading)),
    known("depth_m", Role::plain(Column::Depth)),
    known("ballast_cc", Role::scaled(Column::Ballast, M3_PER_CC)),
    known("battpos_in", Role::scaled(Column::MovingMass, M_PER_INCH)),
    known("speed_onboard_mps", Role::plain(Column::SpeedLog)),
    known("gps_lat_deg", Role::Latitude),
    known("gps_lon_deg", Role::Longitude),
    // 0 is valid; without a status the position is the glider's own reckoning.
    known("gps_status", Role::FixStatus),
    known("water_vy_lmc_mps", Role::plain(Column::OwnCurrentN)),
    known("water_vx_lmc_mps", Role::plain(Column::OwnCurrentE)),
];

/// Attitude, depth, ballast, positions.
pub(super) static FLIGHT: Format = Format {
    name: "glider flight log",
    separators: b",",
    columns: Cow::Borrowed(FLIGHT_COLUMNS),
    needed: &["t_s", "pitch_rad", "depth_m", "ballast_cc"],
    every_column_needed: false,
    constants: Cow::Borrowed(&[]),
    dropped: &[
        ("cmd", "commands; the measured values are used instead"),
        ("lmc", "the glider's own dead reckoning"),
        ("dr_", "the glider's own dead reckoning"),
        ("pressure", "depth_m is used instead"),
        ("depth_rate", "depth_m is used instead"),
        ("fin_rad", "the glide model has no rudder"),
        ("unix", "t_s is used instead"),
    ],
    remarks: &[
        "heading and the glider's own current refer to magnetic north: the declination appears as a heading_bias",
    ],
};

const SCIENCE_COLUMNS: &[Known] = &[
    known("t_s", Role::Seconds(1.0)),
    known("density_kgm3", Role::plain(Column::WaterDensity)),
    known("U_adcp_mps", Role::plain(Column::WaterSpeed)),
];

/// CTD and current profiler.
pub(super) static SCIENCE: Format = Format {
    name: "glider science log",
    separators: b",",
    columns: Cow::Borrowed(SCIENCE_COLUMNS),
    needed: &["t_s", "density_kgm3"],
    every_column_needed: false,
    constants: Cow::Borrowed(&[]),
    dropped: &[
        ("u_adcp_all", "not quality-controlled; U_adcp_mps is used instead"),
        ("pressure", "the flight log has the depth"),
        ("ballast", "the flight log has it"),
        ("temp", "contained in the density"),
        ("cond", "contained in the density"),
        ("unix", "t_s is used instead"),
    ],
    remarks: &[],
};

#[cfg(test)]
mod tests {
    use super::super::tests::import;
    use super::*;

    const FLIGHT_ROWS: &str = "t_unix_s,t_s,pitch_rad,roll_rad,heading_mag_rad,battpos_in,ballast_cc,ballast_cmd_cc,depth_m,gps_lat_deg,gps_lon_deg,gps_status,water_vx_lmc_mps,water_vy_lmc_mps\n\
        1466704271.7,0,-0.1,0.2,2.0,1.0,230.0,233,0.5,54.7,15.1,1,0.05,0.04\n\
        1466704275.7,4.0,-0.1,0.2,2.0,1.0,230.0,,0.5,54.7,15.1,0,,\n\
        1466704279.7,8.0,-0.4,0.2,2.0,0.4,-230.0,,5.5,54.7,15.1,,,\n\
        1466704283.7,12.0,-0.4,0.2,2.0,0.4,-230.0,,5.5,54.7,15.1,0,,\n";

    #[test]
    fn units_and_which_positions_are_fixes() {
        let imported = import(FLIGHT_ROWS).unwrap();
        assert_eq!(imported.format, "glider flight log");
        let log = imported.log;
        let fixes: Vec<u64> = log.rows.iter().filter(|row| row.gnss_m().is_some()).map(|row| row.time_us).collect();
        assert_eq!(fixes, [4_000_000], "stale, reckoned and submerged positions are no fixes");
        assert!((log.rows[2].get(Column::Ballast).unwrap() + 230e-6).abs() < 1e-15);
        assert!((log.rows[0].get(Column::MovingMass).unwrap() - 0.0254).abs() < 1e-15);
        assert_eq!(log.rows[0].get(Column::OwnCurrentE), Some(0.05));
        assert!(log.notes.iter().any(|note| note.starts_with("3 positions dropped")), "{:?}", log.notes);
    }

    #[test]
    fn two_logs_join_by_time() {
        let mut log = import(FLIGHT_ROWS).unwrap().log;
        let science = import("t_s,density_kgm3,U_adcp_mps\n4.0,1005.5,\n6.0,1006.0,0.3\n").unwrap().log;
        log.join(science);
        let times: Vec<u64> = log.rows.iter().map(|row| row.time_us / 1_000_000).collect();
        assert_eq!(times, [0, 4, 4, 6, 8, 12]);
        assert_eq!(log.column(Column::WaterSpeed).collect::<Vec<_>>(), [(6_000_000, 0.3)]);
    }
}
