//! Mission logs of the OceanServer Underwater Vehicle Console (Iver2, Iver3, EcoMapper).
//!
//! Two dialects: the native text, separated by `;`, and the same columns renamed with units and
//! separated by commas (repository Mehruza/CIS3590_Project). Columns are found by their names:
//! their order changed across UVC 2.7, 3.0, 3.1, 3.31, 4.2, 4.5 and 4.7, and older releases have
//! feet where newer ones have metres.

use super::calendar;
use crate::DataError;
use crate::log::{Column, Log, LogRow, table};
use csv::{ByteRecord, ReaderBuilder, Trim};
use std::f64::consts::PI;
use std::path::Path;

const RAD_PER_DEG: f64 = PI / 180.0;
const MPS_PER_KNOT: f64 = 1852.0 / 3600.0;
const M_PER_FOOT: f64 = 0.3048;
/// Count of a centred servo and of a stopped motor (the frontseat's 0x80).
const SERVO_MIDDLE: f64 = 128.0;

/// Which of the two writings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dialect {
    Native,
    Renamed,
}

/// What a column is for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    /// Seconds since the start.
    Seconds,
    TimeOfDay,
    Date,
    LatitudeDeg,
    LongitudeDeg,
    /// No satellites: the position beside it is the vehicle's own reckoning, not a fix.
    Satellites,
    /// A number for the log: column and factor.
    Sample(Column),
    /// A servo's count, from the middle of its byte.
    Count(Column),
}

/// Name, role, factor to the log's unit.
type Known = (&'static str, Role, f64);

const NATIVE: [Known; 13] = [
    ("Latitude", Role::LatitudeDeg, 1.0),
    ("Longitude", Role::LongitudeDeg, 1.0),
    ("Time", Role::TimeOfDay, 1.0),
    ("Date", Role::Date, 1.0),
    ("Number of Sats", Role::Satellites, 1.0),
    ("C True Heading", Role::Sample(Column::Heading), RAD_PER_DEG),
    ("Pitch Angle", Role::Sample(Column::Pitch), RAD_PER_DEG),
    ("Roll Angle", Role::Sample(Column::Roll), RAD_PER_DEG),
    ("DFS Depth (m)", Role::Sample(Column::Depth), 1.0),
    ("DFS Depth (ft)", Role::Sample(Column::Depth), M_PER_FOOT),
    ("Vehicle Speed (kn)", Role::Sample(Column::SpeedLog), MPS_PER_KNOT),
    ("Motor Speed CMD", Role::Count(Column::PropCount), 1.0),
    ("Fin Yaw T", Role::Count(Column::YawFinCount), 1.0),
];

const RENAMED: [Known; 12] = [
    ("t_s", Role::Seconds, 1.0),
    ("north_m", Role::Sample(Column::GpsX), 1.0),
    ("east_m", Role::Sample(Column::GpsY), 1.0),
    ("lat_deg", Role::LatitudeDeg, 1.0),
    ("lon_deg", Role::LongitudeDeg, 1.0),
    ("heading_true_deg", Role::Sample(Column::Heading), RAD_PER_DEG),
    ("pitch_deg", Role::Sample(Column::Pitch), RAD_PER_DEG),
    ("roll_deg", Role::Sample(Column::Roll), RAD_PER_DEG),
    ("depth_m", Role::Sample(Column::Depth), 1.0),
    ("speed_log_mps", Role::Sample(Column::SpeedLog), 1.0),
    ("motor_cmd", Role::Count(Column::PropCount), 1.0),
    ("fin_yaw_t", Role::Count(Column::YawFinCount), 1.0),
];

/// Columns that look useful and are not, with the reason.
const DROPPED: [(&str, &str); 7] = [
    ("fin", "servo counts: angle per count and sign unknown"),
    ("magnetic", "the true heading is there"),
    ("mag_", "the true heading is there"),
    ("dvl", "no body velocity, only fix and altitude"),
    ("gps", "speed and course of the receiver: the position is used"),
    ("next", "commands of the mission, not measurements"),
    ("goal", "commands of the mission, not measurements"),
];

impl Dialect {
    /// The dialect of a header line, if it is one.
    pub(super) fn of(header: &str) -> Option<Self> {
        let has = |name: &str, separator: char| header.trim().split(separator).any(|cell| cell.trim() == name);
        if has("Latitude", ';') && has("Longitude", ';') {
            Some(Self::Native)
        } else if has("heading_true_deg", ',') && has("speed_log_mps", ',') {
            Some(Self::Renamed)
        } else {
            None
        }
    }

    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Native => "Iver UVC mission log",
            Self::Renamed => "Iver UVC mission log, renamed columns",
        }
    }

    const fn separator(self) -> u8 {
        match self {
            Self::Native => b';',
            Self::Renamed => b',',
        }
    }

    const fn known(self) -> &'static [Known] {
        match self {
            Self::Native => &NATIVE,
            Self::Renamed => &RENAMED,
        }
    }
}

/// Reads a UVC mission log.
pub(super) fn read(path: &Path, dialect: Dialect) -> Result<Log, DataError> {
    let mut reader = table::lines(ReaderBuilder::new().delimiter(dialect.separator()).quoting(false).trim(Trim::All))
        .from_reader(table::open(path)?);
    let mut record = ByteRecord::new();
    reader.read_byte_record(&mut record).map_err(|e| table::csv_error(path, 1, &e))?;
    let mut importer = Importer::bind(path, dialect, &record)?;
    loop {
        let line = reader.position().line();
        if !reader.read_byte_record(&mut record).map_err(|e| table::csv_error(path, line, &e))? {
            break;
        }
        if table::is_blank(&record) {
            continue;
        }
        let line = record.position().map_or(line, csv::Position::line);
        importer.row(line, &record)?;
    }
    importer.finish()
}

struct Importer<'a> {
    path: &'a Path,
    columns: usize,
    /// (cell, name, role, factor)
    bound: Vec<(usize, Known)>,
    /// Where lat, lon were at the start, rad, and what an arc is worth there, m.
    origin: Option<Origin>,
    /// Day and time of the first row, µs.
    start_us: Option<i64>,
    without_satellites: usize,
    log: Log,
}

impl<'a> Importer<'a> {
    fn bind(path: &'a Path, dialect: Dialect, header: &ByteRecord) -> Result<Self, DataError> {
        let names: Vec<String> = header.iter().map(|cell| String::from_utf8_lossy(cell).into_owned()).collect();
        let find = |name: &str| names.iter().position(|found| found == name);
        let mut bound: Vec<(usize, Known)> =
            dialect.known().iter().filter_map(|known| Some((find(known.0)?, *known))).collect();
        let has = |bound: &[(usize, Known)], role: Role| bound.iter().any(|(_, known)| known.1 == role);
        if has(&bound, Role::Sample(Column::GpsX)) && has(&bound, Role::Sample(Column::GpsY)) {
            bound.retain(|(_, known)| !matches!(known.1, Role::LatitudeDeg | Role::LongitudeDeg));
        }
        let time = if dialect == Dialect::Native { Role::TimeOfDay } else { Role::Seconds };
        let needed = [time, Role::Sample(Column::Heading), Role::Sample(Column::SpeedLog)];
        for role in needed {
            if !has(&bound, role) {
                let expected: Vec<&str> =
                    dialect.known().iter().filter(|known| known.1 == role).map(|known| known.0).collect();
                let message = format!("{}: no column {}", dialect.name(), expected.join(" or "));
                return Err(DataError::at(path, 1, 0, message));
            }
        }
        let used: Vec<&str> = bound.iter().map(|(_, known)| known.0).collect();
        let mut notes = vec![format!("{}; recognised: {}", dialect.name(), used.join(", "))];
        let unused = || names.iter().filter(|name| !name.is_empty() && !used.contains(&name.as_str()));
        let reason = |name: &str| {
            let lower = name.to_ascii_lowercase();
            DROPPED.iter().find(|(part, _)| lower.contains(part)).map(|(_, reason)| *reason)
        };
        let mut told: Vec<&str> = Vec::new();
        for (_, why) in DROPPED {
            let these: Vec<&str> = unused().filter(|name| reason(name) == Some(why)).map(String::as_str).collect();
            if !these.is_empty() && !told.contains(&why) {
                told.push(why);
                notes.push(format!("dropped {} ({why})", these.join(", ")));
            }
        }
        let rest: Vec<&str> = unused().filter(|name| reason(name).is_none()).map(String::as_str).collect();
        if !rest.is_empty() {
            notes.push(format!("dropped {} (not part of a vehicle log)", rest.join(", ")));
        }
        Ok(Self {
            path,
            columns: header.len(),
            bound,
            origin: None,
            start_us: None,
            without_satellites: 0,
            log: Log { path: path.to_owned(), rows: Vec::new(), notes },
        })
    }

    fn row(&mut self, line: u64, record: &ByteRecord) -> Result<(), DataError> {
        // A trailing separator makes one more cell, its absence one less.
        if record.len() + 1 < self.columns || record.len() > self.columns + 1 {
            let message = format!("{} cells where the header has {}", record.len(), self.columns);
            return Err(DataError::at(self.path, line, 0, message));
        }
        let mut row = LogRow::new(0);
        let (mut seconds, mut day_us, mut days) = (None, None, None);
        let (mut latitude, mut longitude, mut has_fix) = (None, None, true);
        for (cell, (name, role, factor)) in &self.bound {
            let text = record.get(*cell).unwrap_or_default();
            let fail = |message: String| DataError::at(self.path, line, *cell as u64 + 1, format!("{name}: {message}"));
            let readable = std::str::from_utf8(text).unwrap_or_default();
            match role {
                Role::TimeOfDay => {
                    let parsed = calendar::time_us(readable);
                    day_us = Some(parsed.ok_or_else(|| fail(format!("\"{readable}\" is not HH:MM:SS")))?);
                }
                Role::Date => {
                    let parsed = calendar::date_days(readable);
                    days = Some(parsed.ok_or_else(|| fail(format!("\"{readable}\" is not M/D/YYYY")))?);
                }
                _ => {
                    let value = table::number(text).map_err(fail)?;
                    let value = (!value.is_nan()).then_some(value * factor);
                    match role {
                        Role::Seconds => seconds = value,
                        Role::LatitudeDeg => latitude = value,
                        Role::LongitudeDeg => longitude = value,
                        Role::Satellites => has_fix = value.is_none_or(|count| count > 0.0),
                        Role::Sample(column) => {
                            row.set(*column, value.unwrap_or(f64::NAN));
                        }
                        Role::Count(column) => {
                            row.set(*column, value.map_or(f64::NAN, |count| count - SERVO_MIDDLE));
                        }
                        Role::TimeOfDay | Role::Date => {}
                    }
                }
            }
        }
        row.time_us = self.time_us(line, seconds, days, day_us)?;
        if let (Some(latitude), Some(longitude)) = (latitude, longitude) {
            if !(-90.0..=90.0).contains(&latitude) || !(-180.0..=180.0).contains(&longitude) {
                let message = format!("{latitude}, {longitude} is no latitude and longitude in degrees");
                return Err(DataError::at(self.path, line, 0, message));
            }
            if has_fix {
                let origin = self.origin.get_or_insert_with(|| Origin::new(latitude, longitude));
                row.set_all(Column::GpsX, &origin.local_m(latitude, longitude));
            } else {
                self.without_satellites += 1;
            }
        }
        self.log.rows.push(row);
        Ok(())
    }

    fn time_us(
        &mut self,
        line: u64,
        seconds: Option<f64>,
        days: Option<i64>,
        day_us: Option<i64>,
    ) -> Result<u64, DataError> {
        let fail = |message: &str| DataError::at(self.path, line, 0, message);
        let absolute_us = match (seconds, day_us) {
            (Some(seconds), _) => (seconds * 1e6).round() as i64,
            (None, Some(day_us)) => days.unwrap_or(0) * 86_400_000_000 + day_us,
            (None, None) => return Err(fail("the time is empty")),
        };
        let start_us = *self.start_us.get_or_insert(if seconds.is_some() { 0 } else { absolute_us });
        let previous_us = self.log.rows.last().map_or(0, |row| row.time_us);
        match u64::try_from(absolute_us - start_us) {
            Ok(time_us) if time_us >= previous_us => Ok(time_us),
            _ => Err(fail("the time is before that of the row above")),
        }
    }

    fn finish(mut self) -> Result<Log, DataError> {
        if self.log.rows.is_empty() {
            return Err(DataError::file(self.path, "no rows after the header"));
        }
        if self.without_satellites > 0 {
            let count = self.without_satellites;
            self.log.notes.push(format!("{count} positions dropped (no satellites: the vehicle's own reckoning)"));
        }
        Ok(self.log)
    }
}

/// Origin of the local plane: the log's first fix.
struct Origin {
    latitude_deg: f64,
    longitude_deg: f64,
    m_per_deg: [f64; 2],
}

impl Origin {
    /// Radii of curvature of the WGS 84 ellipsoid at the origin; a mission of 10 km errs by metres.
    fn new(latitude_deg: f64, longitude_deg: f64) -> Self {
        const A_M: f64 = 6_378_137.0;
        const E2: f64 = 6.694_379_990_141_32e-3;
        let (sin, cos) = (latitude_deg * RAD_PER_DEG).sin_cos();
        let w2 = 1.0 - E2 * sin * sin;
        let (meridian_m, prime_m) = (A_M * (1.0 - E2) / (w2 * w2.sqrt()), A_M / w2.sqrt());
        Self { latitude_deg, longitude_deg, m_per_deg: [meridian_m * RAD_PER_DEG, prime_m * cos * RAD_PER_DEG] }
    }

    fn local_m(&self, latitude_deg: f64, longitude_deg: f64) -> [f64; 2] {
        let east_deg = (longitude_deg - self.longitude_deg + 540.0).rem_euclid(360.0) - 180.0;
        [(latitude_deg - self.latitude_deg) * self.m_per_deg[0], east_deg * self.m_per_deg[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::super::read;
    use super::*;
    use crate::dead_reckoning::{self, Method};

    // Rows written for these tests; no measured file is part of the project.
    const RENAMED_ROWS: &str = "t_s,lat_deg,lon_deg,north_m,east_m,mag_var_deg,heading_true_deg,pitch_deg,roll_deg,depth_m,speed_log_mps,motor_cmd,fin_yaw_t,power_W\n\
        0.0,25.9,-80.1,0.0,0.0,-7.1,90.0,0.0,0.0,0.0,1.0,160,128,22\n\
        1.0,25.9,-80.1,0.0,1.0,-7.1,90.0,0.0,0.0,,1.0,160,128,22\n\
        2.0,25.9,-80.1,0.1,2.1,-7.1,90.0,0.0,0.0,0.1,1.0,160,128,22\n";

    const NATIVE_ROWS: &str = "Latitude;Longitude;Time;Date;Number of Sats;C Magnetic Heading;C True Heading;Pitch Angle;Roll Angle;DFS Depth (ft);Vehicle Speed (kn);Fin Yaw T;DVL -Altitude (m);\n\
        25.90000000;-80.10000000;23:59:59.00;10/7/2022;8;0;0;0;0;10;2;128;3.0;\n\
        25.90000900;-80.10000000;00:00:00.00;10/8/2022;0;0;0;0;0;10;2;128;3.0;\n\
        25.90001800;-80.10000000;00:00:01.00;10/8/2022;8;0;0;0;0;10;2;128;3.0;\n";

    fn import(text: &str) -> Result<super::super::Imported, DataError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mission.log");
        std::fs::write(&path, text).unwrap();
        read(&path)
    }

    #[test]
    fn renamed_columns() {
        let imported = import(RENAMED_ROWS).unwrap();
        assert_eq!(imported.format, Dialect::Renamed.name());
        assert_eq!(imported.log.rows.len(), 3);
        assert_eq!(imported.log.rows[2].gnss_m(), Some([0.1, 2.1]));
        assert_eq!(imported.log.rows[1].get(Column::Depth), None);
        let notes = imported.log.notes.join("\n");
        assert_eq!(imported.log.rows[0].get(Column::PropCount), Some(32.0));
        for part in ["recognised: t_s", "motor_cmd", "fin_yaw_t", "power_W (not part"] {
            assert!(notes.contains(part), "{part} in {notes}");
        }
        let positions = dead_reckoning::run(&imported.log, Method::HeadingSpeed).unwrap();
        let errors = dead_reckoning::errors_against_fixes(&positions, &imported.log);
        assert!((errors.last().unwrap().1 - 0.02_f64.sqrt()).abs() < 1e-9); // rounding: 0.1 m off in both axes
    }

    #[test]
    fn native_columns_units_and_midnight() {
        let log = import(NATIVE_ROWS).unwrap().log;
        assert_eq!(log.rows[2].time_us, 2_000_000);
        assert!((log.rows[0].get(Column::Depth).unwrap() - 3.048).abs() < 1e-12); // 10 feet
        assert!((log.rows[0].get(Column::SpeedLog).unwrap() - 2.0 * 1852.0 / 3600.0).abs() < 1e-12);
        assert_eq!(log.rows[1].gnss_m(), None); // no satellites
        let north_m = log.rows[2].gnss_m().unwrap()[0];
        // 18 µ° of latitude at 25.9 N; WGS 84 has 110.78 km to the degree there (NIMA TR8350.2).
        assert!((north_m - 18e-6 * 110_780.0).abs() < 1e-3, "{north_m}");
    }

    #[test]
    fn broken_rows_name_line_and_column() {
        let told = |text: &str| import(text).unwrap_err().to_string();
        assert!(told(&NATIVE_ROWS.replace("00:00:01.00", "soon")).contains(":4:3: Time:"));
        assert!(told(&NATIVE_ROWS.replace("10/8/2022", "8.10.22")).contains(":3:4: Date:"));
        assert!(told(&RENAMED_ROWS.replace("2.0,25.9", "0.5,25.9")).contains(":4: the time is before"));
        assert!(told(&RENAMED_ROWS.replace("160,128,22\n", "160\n")).contains(":2: 12 cells"));
        assert!(told(&NATIVE_ROWS.replace("C True Heading", "Heading")).contains("no column C True Heading"));
        assert!(told(&NATIVE_ROWS.replace("25.90001800", "125.9")).contains("no latitude"));
    }
}
