//! Mission logs of the OceanServer Underwater Vehicle Console (Iver2, Iver3, EcoMapper).
//!
//! Two dialects: the native text, separated by `;` (by `,` after a spreadsheet, whose times may be `17:37.3` without
//! the hour), and the same columns renamed with units (both in repository Mehruza/CIS3590_Project). Columns are found
//! by their names: their order changed across UVC 2.7, 3.0, 3.1, 3.31, 4.2, 4.5 and 4.7, and older releases have feet
//! where newer ones have metres.

use super::RAD_PER_DEG;
use super::format::{Format, Known, Role, known};
use crate::log::{Column, M_PER_FOOT, MPS_PER_KNOT};
use std::borrow::Cow;

/// Count of a centred servo and of a stopped motor (the frontseat's 0x80).
const SERVO_MIDDLE: f64 = 128.0;

const fn count(column: Column) -> Role {
    Role::Sample { column, scale: 1.0, offset: -SERVO_MIDDLE }
}

const fn angle(column: Column) -> Role {
    Role::scaled(column, RAD_PER_DEG)
}

const NATIVE_COLUMNS: &[Known] = &[
    known("Latitude", Role::Latitude),
    known("Longitude", Role::Longitude),
    known("Time", Role::TimeOfDay),
    known("Date", Role::Date),
    // No satellites: the position beside it is the vehicle's own reckoning, not a fix.
    known("Number of Sats", Role::Satellites),
    known("C True Heading", angle(Column::Heading)),
    known("Pitch Angle", angle(Column::Pitch)),
    known("Roll Angle", angle(Column::Roll)),
    known("DFS Depth (m)", Role::plain(Column::Depth)),
    known("DFS Depth (ft)", Role::scaled(Column::Depth, M_PER_FOOT)),
    known("Vehicle Speed (kn)", Role::scaled(Column::SpeedLog, MPS_PER_KNOT)),
    known("Sound Speed (m/s)", Role::plain(Column::SoundSpeed)),
    known("Motor Speed CMD", count(Column::PropCount)),
    known("Fin Yaw T", count(Column::YawFinCount)),
];

const RENAMED_COLUMNS: &[Known] = &[
    known("t_s", Role::Seconds(1.0)),
    known("north_m", Role::plain(Column::GpsX)),
    known("east_m", Role::plain(Column::GpsY)),
    known("lat_deg", Role::Latitude),
    known("lon_deg", Role::Longitude),
    known("heading_true_deg", angle(Column::Heading)),
    known("pitch_deg", angle(Column::Pitch)),
    known("roll_deg", angle(Column::Roll)),
    known("depth_m", Role::plain(Column::Depth)),
    known("speed_log_mps", Role::plain(Column::SpeedLog)),
    known("motor_cmd", count(Column::PropCount)),
    known("fin_yaw_t", count(Column::YawFinCount)),
    known("sound_speed_mps", Role::plain(Column::SoundSpeed)),
];

const DROPPED: &[(&str, &str)] = &[
    ("fin", "servo counts: angle per count and sign unknown"),
    ("magnetic", "the true heading is used instead"),
    ("mag_", "the true heading is used instead"),
    ("dvl", "no body velocity, only fix and altitude"),
    ("gps", "speed and course of the receiver; the position is used instead"),
    ("next", "commands of the mission, not measurements"),
    ("goal", "commands of the mission, not measurements"),
];

/// As the vehicle writes it.
pub(super) static NATIVE: Format = Format {
    name: "Iver UVC mission log",
    separators: b";,\t",
    columns: Cow::Borrowed(NATIVE_COLUMNS),
    needed: &["Time", "C True Heading", "Vehicle Speed (kn)"],
    every_column_needed: false,
    constants: Cow::Borrowed(&[]),
    dropped: DROPPED,
    remarks: &[],
};

/// Columns renamed with their units.
pub(super) static RENAMED: Format = Format {
    name: "Iver UVC mission log, renamed columns",
    separators: b",",
    columns: Cow::Borrowed(RENAMED_COLUMNS),
    needed: &["t_s", "heading_true_deg", "speed_log_mps"],
    every_column_needed: false,
    constants: Cow::Borrowed(&[]),
    dropped: DROPPED,
    remarks: &[],
};

#[cfg(test)]
mod tests {
    use super::super::tests::import;
    use super::*;

    // Rows written for these tests; no measured file is part of the project.
    const RENAMED_ROWS: &str = "t_s,lat_deg,lon_deg,north_m,east_m,mag_var_deg,heading_true_deg,pitch_deg,roll_deg,depth_m,speed_log_mps,motor_cmd,fin_yaw_t,power_W\n\
        0.0,25.9,-80.1,0.0,0.0,-7.1,90.0,0.0,0.0,0.0,1.0,160,128,22\n\
        1.0,25.9,-80.1,0.0,1.0,-7.1,90.0,0.0,0.0,,1.0,160,128,22\n\
        2.0,25.9,-80.1,0.1,2.1,-7.1,90.0,0.0,0.0,0.1,1.0,160,128,22\n";

    /// The header of a real export in part, times and dates as Excel writes them; the rows are made up.
    const SPREADSHEET_ROWS: &str = "Latitude,Longitude,Time,Date,Number of Sats,C True Heading,Pitch Angle,Roll Angle,DFS Depth (m),Vehicle Speed (kn),Motor Speed CMD,Fin Yaw T,Date m/d/y   ,Time hh:mm:ss\n\
        25.90000000,-80.10000000,59:58.5,10/7/22,8,90,1,-1,0.0,2,160,128,10/7/22,11:59:58\n\
        25.90000000,-80.09999000,59:59.5,10/7/22,8,90,1,-1,0.0,2,160,128,10/7/22,11:59:59\n\
        25.90000000,-80.09998000,00:00.6,10/7/22,8,90,1,-1,0.0,2,160,128,10/7/22,12:00:00\n";

    #[test]
    fn a_spreadsheet_took_the_hours_away() {
        let imported = import(SPREADSHEET_ROWS).unwrap();
        assert_eq!(imported.format, NATIVE.name);
        let log = imported.log;
        assert_eq!(log.rows.iter().map(|row| row.time_us).collect::<Vec<_>>(), [0, 1_000_000, 2_100_000]);
        assert_eq!(log.rows[0].get(Column::PropCount), Some(32.0));
        assert!(log.notes.iter().any(|note| note.contains("without hours")), "{:?}", log.notes);
        // a row that goes back by less than half an hour is no new hour
        let back = SPREADSHEET_ROWS.replace("00:00.6", "50:00.6");
        assert!(import(&back).unwrap_err().to_string().contains(":4:3: Time: the time is before"));
    }

    const NATIVE_ROWS: &str = "Latitude;Longitude;Time;Date;Number of Sats;C Magnetic Heading;C True Heading;Pitch Angle;Roll Angle;DFS Depth (ft);Vehicle Speed (kn);Fin Yaw T;DVL -Altitude (m);\n\
        25.90000000;-80.10000000;23:59:59.00;10/7/2022;8;0;0;0;0;1;2;128;3.0;\n\
        25.90000900;-80.10000000;00:00:00.00;10/8/2022;0;0;0;0;0;1;2;128;3.0;\n\
        25.90001800;-80.10000000;00:00:01.00;10/8/2022;8;0;0;0;0;1;2;128;3.0;\n";

    #[test]
    fn renamed_columns() {
        let imported = import(RENAMED_ROWS).unwrap();
        assert_eq!(imported.format, RENAMED.name);
        assert_eq!(imported.log.rows.len(), 3);
        assert_eq!(imported.log.rows[2].gnss_m(), Some([0.1, 2.1]));
        assert_eq!(imported.log.rows[1].get(Column::Depth), None);
        let notes = imported.log.notes.join("\n");
        assert_eq!(imported.log.rows[0].get(Column::PropCount), Some(32.0));
        for part in ["recognised: t_s", "motor_cmd", "fin_yaw_t", "power_W (not part", "lat_deg, lon_deg (north_m"] {
            assert!(notes.contains(part), "{part} in {notes}");
        }
        let last = &imported.log.rows[2];
        assert_eq!(last.get(Column::Heading), Some(std::f64::consts::FRAC_PI_2));
        assert_eq!(last.get(Column::SpeedLog), Some(1.0));
    }

    #[test]
    fn native_columns_units_and_midnight() {
        let log = import(NATIVE_ROWS).unwrap().log;
        assert_eq!(log.rows[2].time_us, 2_000_000);
        assert!((log.rows[0].get(Column::Depth).unwrap() - 0.3048).abs() < 1e-12); // 1 foot
        assert!((log.rows[0].get(Column::SpeedLog).unwrap() - 2.0 * 1852.0 / 3600.0).abs() < 1e-12);
        assert_eq!(log.rows[1].gnss_m(), None); // no satellites
        let north_m = log.rows[2].gnss_m().unwrap()[0];
        // 18 µ° of latitude at 25.9 N; WGS 84 has 110.78 km to the degree there (NIMA TR8350.2).
        assert!((north_m - 18e-6 * 110_780.0).abs() < 1e-3, "{north_m}");
        assert!(log.notes.iter().any(|note| note.starts_with("1 position dropped")), "{:?}", log.notes);
        let deep = import(&NATIVE_ROWS.replace(";1;2;", ";10;2;")).unwrap().log;
        assert!(!deep.has(Column::GpsX)); // ten feet of water over the antenna
    }

    #[test]
    fn broken_rows_name_line_and_column() {
        let complaint = |text: &str| import(text).unwrap_err().to_string();
        assert!(complaint(&NATIVE_ROWS.replace("00:00:01.00", "soon")).contains(":4:3: Time:"));
        assert!(complaint(&NATIVE_ROWS.replace("10/8/2022", "10/8/2322")).contains("the time is more than a century"));
        assert!(complaint(&NATIVE_ROWS.replace("10/8/2022", "8.10.22")).contains(":3:4: Date:"));
        assert!(complaint(&RENAMED_ROWS.replace("2.0,25.9", "0.5,25.9")).contains(":4:1: t_s: the time is before"));
        assert!(complaint(&RENAMED_ROWS.replace("160,128,22\n1", "160\n1")).contains(":2: 12 cells"));
        assert!(complaint(&NATIVE_ROWS.replace("C True Heading", "Heading")).contains("no column C True Heading"));
        assert!(complaint(&NATIVE_ROWS.replace("25.90001800", "125.9")).contains(":4:1: Latitude: 125.9 is outside"));
    }
}
