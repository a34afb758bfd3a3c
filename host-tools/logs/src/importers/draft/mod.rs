//! A draft of a column mapping for a table that nobody described: names and ranges of its columns, and guesses.

mod names;

use super::ros_bag::{GAUGE_PA, SURFACE_PA};
use crate::DataError;
use crate::log::table;
use csv::{ByteRecord, ReaderBuilder, Trim};
use names::{MISSING, NAMES, PRESSURE, ROS, UNITS};
use std::fmt::Write as _;
use std::path::Path;

/// Rows that are looked at.
const ROWS: usize = 20_000;

/// A drafted mapping.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Draft {
    /// The mapping, TOML with comments.
    pub text: String,
    /// Columns of the table, and what they were taken for.
    pub guesses: Vec<(String, String)>,
    /// Columns that nothing was guessed for.
    pub unused: Vec<String>,
}

/// A column of the table.
struct Seen {
    name: String,
    /// Lower case, without a unit in brackets, words joined by `_`.
    plain: String,
    /// The unit that its name states, if any.
    unit: Option<&'static str>,
    numbers: usize,
    texts: usize,
    min: f64,
    max: f64,
    first: Option<f64>,
    last: f64,
    sample: String,
    /// What stands where there is no sample.
    missing: Option<String>,
}

/// Drafts a mapping from the header and the first rows of a table.
///
/// # Errors
/// A file that cannot be read, or is no table.
pub fn draft(path: &Path) -> Result<Draft, DataError> {
    draft_of(path).map_err(|error| crate::kinds::instead(path, error))
}

fn draft_of(path: &Path) -> Result<Draft, DataError> {
    if let Some((name, _)) = super::other_than_table(path)? {
        let message = format!("{name}: needs no mapping, every command reads it (`backseat info` says what it holds)");
        return Err(DataError::file(path, message));
    }
    super::check_text(path, &super::header(path)?)?;
    let separator = separator(path)?;
    let mut reader =
        table::lines(ReaderBuilder::new().delimiter(separator).trim(Trim::All)).from_reader(table::open(path)?);
    let mut record = ByteRecord::new();
    if !reader.read_byte_record(&mut record).map_err(|e| table::csv_error(path, 1, &e))? {
        return Err(DataError::file(path, "the file is empty; expected a header line with the names of the columns"));
    }
    let mut columns: Vec<Seen> = record.iter().map(|cell| Seen::new(&String::from_utf8_lossy(cell))).collect();
    if columns.len() < 2 {
        return Err(DataError::at(path, 1, 0, "no table: expected columns separated by a comma, a semicolon or a tab"));
    }
    for row in 0..ROWS {
        let line = row as u64 + 2;
        if !reader.read_byte_record(&mut record).map_err(|e| table::csv_error(path, line, &e))? {
            break;
        }
        for (column, cell) in columns.iter_mut().zip(&record) {
            column.add(separator, cell);
        }
    }
    Ok(compose(path, separator, &columns))
}

/// The separator that the header has most often.
fn separator(path: &Path) -> Result<u8, DataError> {
    let header = super::header(path)?;
    let count = |separator: &u8| header.bytes().filter(|byte| byte == separator).count();
    Ok(*b",;\t".iter().max_by_key(|separator| count(separator)).unwrap_or(&b','))
}

impl Seen {
    fn new(name: &str) -> Self {
        let name = name.trim().trim_matches('"').to_owned();
        let lower = name.to_lowercase();
        let (outside, inside) = match lower.find(['(', '[']) {
            Some(at) => (lower[..at].trim(), lower[at + 1..].trim_end_matches([')', ']', ' '])),
            None => (lower.as_str(), ""),
        };
        let suffix = lower.rsplit(['_', ' ', '.']).next().unwrap_or_default();
        let unit = |text: &str| UNITS.iter().find(|(name, _)| *name == text).map(|(_, unit)| *unit);
        let stated = unit(inside).or_else(|| unit(suffix).filter(|_| suffix != lower));
        Self {
            plain: outside.replace([' ', '-'], "_"),
            unit: stated,
            name,
            numbers: 0,
            texts: 0,
            min: f64::INFINITY,
            max: f64::NEG_INFINITY,
            first: None,
            last: f64::NAN,
            sample: String::new(),
            missing: None,
        }
    }

    fn add(&mut self, separator: u8, cell: &[u8]) {
        let text = String::from_utf8_lossy(cell);
        let text = text.trim();
        if text.is_empty() {
            return;
        }
        if MISSING.contains(&text.to_lowercase().as_str()) {
            self.missing = Some(text.to_owned());
            return;
        }
        if self.sample.is_empty() {
            self.sample = text.chars().take(24).collect();
        }
        match table::number_between(separator, text.as_bytes()).ok().filter(|value| value.is_finite()) {
            Some(value) => {
                self.numbers += 1;
                (self.min, self.max, self.last) = (self.min.min(value), self.max.max(value), value);
                self.first = self.first.or(Some(value));
            }
            None => self.texts += 1,
        }
    }

    fn is_number(&self) -> bool {
        self.numbers > 0 && self.numbers >= 9 * self.texts
    }

    fn is_pressure(&self) -> bool {
        self.plain.contains(PRESSURE)
    }

    /// Its unit, if it is a pressure, in Pa.
    fn pascals(&self) -> f64 {
        match self.unit_for("depth_m", false) {
            "Pa" => 1.0,
            "mbar" => 1e2,
            "kPa" => 1e3,
            "bar" => 1e5,
            _ => 1e4,
        }
    }

    /// Which part of a quaternion it is by its name: 0 for w, 1 to 3 for x, y, z.
    fn quaternion_part(&self) -> Option<usize> {
        let split = self.plain.rsplit_once(['.', '_']);
        let (stem, part) = split.or_else(|| self.plain.strip_prefix('q').map(|part| ("q", part)))?;
        let part = ["w", "x", "y", "z"].iter().position(|name| *name == part)?;
        (stem == "q" || ["quat", "orient"].iter().any(|name| stem.contains(name))).then_some(part)
    }

    /// What its name says it is.
    fn target(&self) -> Option<&'static str> {
        let is = |part: &str| match part.strip_prefix('=') {
            // the whole name, perhaps with its unit behind
            Some(whole) => self.plain == whole || self.plain.rsplit_once('_').is_some_and(|(stem, _)| stem == whole),
            None => self.plain.contains(part),
        };
        let found = NAMES.iter().find(|(parts, _)| parts.iter().any(|part| is(part)));
        found.map(|(_, target)| *target).filter(|target| !target.is_empty() && self.is_number())
    }

    /// The same where the frames may be those of ROS, in which a position has east first.
    fn target_in(&self, is_ros: bool) -> Option<&'static str> {
        match self.target() {
            Some("gps_x_m") if is_ros && self.plain.contains("position") => Some("gps_y_m"),
            Some("gps_y_m") if is_ros && self.plain.contains("position") => Some("gps_x_m"),
            target => target,
        }
    }

    /// Whether its axis is against that of the vehicle log.
    fn is_turned(&self, target: &str, is_ros: bool) -> bool {
        let body = ["pitch_rad", "q_radps", "r_radps", "dvl_v_mps", "dvl_w_mps"];
        (is_ros && body.contains(&target)) || (target == "heading_rad" && (is_ros || self.plain.contains("enu")))
    }

    /// Its unit, by its name or by its range.
    fn unit_for(&self, target: &str, has_degrees: bool) -> &'static str {
        let largest = self.min.abs().max(self.max.abs());
        let fits = |units: &[&'static str]| self.unit.filter(|unit| units.contains(unit));
        match target {
            t if t.ends_with("_radps") => {
                fits(&["rad/s", "deg/s"]).unwrap_or(if largest > 3.0 { "deg/s" } else { "rad/s" })
            }
            t if t.ends_with("_rad") => {
                fits(&["rad", "deg"]).unwrap_or(if has_degrees || largest > 6.3 { "deg" } else { "rad" })
            }
            t if t.ends_with("_mps") => fits(&["m/s", "cm/s", "mm/s", "kn", "km/h"]).unwrap_or(match largest {
                l if t != "sound_speed_mps" && l > 1000.0 => "mm/s",
                l if t != "sound_speed_mps" && l > 15.0 => "cm/s",
                _ => "m/s",
            }),
            t if t.ends_with("_rpm") => fits(&["rpm", "rad/s"]).unwrap_or("rpm"),
            t if t.ends_with("_deg") => "deg",
            t if t.ends_with("_per_m3") => {
                if largest < 10.0 {
                    "g/cm^3"
                } else {
                    "kg/m^3"
                }
            }
            _ if self.is_pressure() => fits(&["dbar", "bar", "mbar", "kPa", "Pa"]).unwrap_or("dbar"),
            _ => fits(&["m", "cm", "mm", "km", "ft"]).unwrap_or("m"),
        }
    }

    fn range(&self) -> String {
        if self.is_number() {
            format!("{} to {}, {} values", self.min, self.max, self.numbers)
        } else {
            format!("for example {:?}", self.sample)
        }
    }
}

/// What a time column is: unit and base.
fn time_unit(column: &Seen) -> Option<(&'static str, &'static str)> {
    const NAMES: [&str; 8] = ["time", "stamp", "epoch", "zeit", "seconds", "clock", "date", "utc"];
    let is_named = NAMES.iter().any(|part| column.plain.contains(part))
        || ["t", "t_s", "sec", "secs", "ms", "us", "ns"].contains(&column.plain.as_str());
    if !is_named {
        return None;
    }
    if !column.is_number() {
        let is_clock =
            super::calendar::time_us(&column.sample).or(super::calendar::minutes_us(&column.sample)).is_some();
        return is_clock.then_some(("hms", "start"));
    }
    let first = column.first?;
    let span = (column.last - first) / column.numbers.max(2) as f64;
    let stated = column.unit.filter(|unit| ["s", "ms", "us", "ns"].contains(unit));
    // nanoseconds, microseconds, milliseconds, seconds since 1970, then by the time between two rows
    let (unit, base) = match (first, span) {
        (f, _) if f > 1e17 => ("ns", "epoch"),
        (f, _) if f > 1e14 => ("us", "epoch"),
        (f, _) if f > 1e11 => ("ms", "epoch"),
        (f, _) if f > 1e8 => ("s", "epoch"),
        (_, s) if s > 1e6 => ("ns", "start"),
        (_, s) if s > 5e3 => ("us", "start"),
        (_, s) if s > 5.0 => ("ms", "start"),
        _ => ("s", "start"),
    };
    Some((stated.unwrap_or(unit), base))
}

fn compose(path: &Path, separator: u8, columns: &[Seen]) -> Draft {
    let mut text = format!(
        "# Column mapping of {}, drafted by `backseat map`: every line is a guess from names and ranges. Check units and\n\
         # signs (heading clockwise from true north, pitch nose up, depth and w down, v and y to starboard and east), then\n\
         # `backseat info LOG --columns FILE` says whether they fit each other.\n\
         # An entry has: column, unit, sign (1 or -1), scale, offset (added first, in the table's unit).\n",
        path.file_name().map_or_else(|| "a table".into(), |name| name.to_string_lossy())
    );
    let shown = if separator == b'\t' { "\\t".to_owned() } else { char::from(separator).to_string() };
    let _ = writeln!(text, "separator = \"{shown}\"");
    let mut missing: Vec<String> = columns.iter().filter_map(|column| column.missing.as_deref().map(quoted)).collect();
    missing.sort_unstable();
    missing.dedup();
    if !missing.is_empty() {
        let _ = writeln!(text, "missing = [{}]  # what stands where there is no sample", missing.join(", "));
    }
    text += "\n[time]\n";
    let (mut guesses, mut used) = (Vec::new(), Vec::new());
    let time = columns.iter().enumerate().find_map(|(place, column)| Some((place, column, time_unit(column)?)));
    match time {
        Some((place, column, (unit, base))) => {
            let _ = writeln!(text, "column = {}  # {}", quoted(&column.name), column.range());
            let _ = writeln!(
                text,
                "unit = \"{unit}\"  # s, ms, us, ns, min, h, or hms\nbase = \"{base}\"  # start, or epoch: the first row is zero"
            );
            guesses.push((column.name.clone(), format!("time in {unit}")));
            used.push(place);
        }
        None => text += "column = \"?\"  # no column looks like a time: name it here\nunit = \"s\"\n",
    }
    // a table has its angles in one unit: the heading gives it away
    let is_angle = |column: &&Seen| {
        column.target().is_some_and(|target| target.ends_with("_rad") || ["rudder", "elevator"].contains(&target))
    };
    let has_degrees = columns.iter().filter(is_angle).any(|column| column.unit_for("heading_rad", false) == "deg");
    let has_depth = columns.iter().any(|column| column.target() == Some("depth_m") && !column.is_pressure());
    let is_ros = columns.iter().any(|column| ROS.iter().any(|part| column.plain.contains(part)));
    if is_ros {
        text += "\n# Names as messages of ROS have: taken as east-north-up and forward-left-up. Check it.\n";
    }
    let mut taken: Vec<&str> = Vec::new();
    if let Some(places) = quaternion(columns) {
        let names = places.map(|place| quoted(&columns[place].name)).join(", ");
        let frames = if is_ros { "enu-flu" } else { "ned-frd" };
        let _ = writeln!(text, "\n[quaternion]\ncolumns = [{names}]  # w, x, y, z");
        let _ = writeln!(text, "frames = \"{frames}\"  # ned-frd or enu-flu");
        guesses.extend(places.map(|place| (columns[place].name.clone(), "part of a quaternion".to_owned())));
        used.extend(places);
        taken.extend(["roll_rad", "pitch_rad", "heading_rad"]);
    }
    for (place, column) in columns.iter().enumerate() {
        let Some(target) = column.target_in(is_ros).filter(|_| !used.contains(&place)) else { continue };
        if column.is_pressure() && has_depth {
            continue;
        }
        let is_turned = column.is_turned(target, is_ros);
        // one command for a pair of fins: the same column twice, with opposite signs
        let entries: Vec<(&str, i32)> = match target {
            "rudder" => vec![("fin_top_rad", 1), ("fin_bottom_rad", -1)],
            "elevator" => vec![("fin_port_rad", 1), ("fin_starboard_rad", -1)],
            one => vec![(one, if is_turned || (one == "depth_m" && column.min + column.max < 0.0) { -1 } else { 1 })],
        };
        if entries.iter().any(|(target, _)| taken.contains(target)) {
            continue;
        }
        used.push(place);
        for (target, sign) in entries {
            let _ = writeln!(text, "\n[columns.{target}]\ncolumn = {}  # {}", quoted(&column.name), column.range());
            let unit = column.unit_for(target, has_degrees);
            if !target.ends_with("_deg") {
                let _ = writeln!(text, "unit = \"{unit}\"");
            }
            if sign < 0 {
                text += "sign = -1\n";
            }
            if target == "heading_rad" && is_turned {
                let quarter = if unit == "deg" { 90.0 } else { std::f64::consts::FRAC_PI_2 };
                let _ = writeln!(text, "offset = -{quarter:?}  # counted from east, counter-clockwise");
            }
            if column.is_pressure() {
                let pa = column.pascals();
                let offset = if column.min * pa > GAUGE_PA { -SURFACE_PA / pa } else { 0.0 };
                let _ = writeln!(text, "offset = {offset:?}  # the air's share of an absolute pressure");
            }
            guesses.push((column.name.clone(), target.to_owned()));
            taken.push(target);
        }
    }
    let unused: Vec<&Seen> =
        columns.iter().enumerate().filter(|(place, _)| !used.contains(place)).map(|(_, c)| c).collect();
    if !unused.is_empty() {
        text += "\n# Not used; to use one, write an entry as above:\n";
    }
    for column in &unused {
        let _ = writeln!(text, "#   {}: {}", quoted(&column.name), column.range());
    }
    text += "\n# For what the table does not have, but every row shares: [constants], such as\n\
             # [constants]\n# prop_rpm = 1000.0\n\
             # For an attitude as a quaternion (frames: \"ned-frd\", or \"enu-flu\" as ROS has it):\n\
             # [quaternion]\n# columns = [\"qw\", \"qx\", \"qy\", \"qz\"]\n# frames = \"enu-flu\"\n\
             # A yaw from east, counter-clockwise: unit = \"deg\", sign = -1, offset = -90.\n";
    Draft { text, guesses, unused: unused.iter().map(|column| column.name.clone()).collect() }
}

/// The four columns of a quaternion, w first, of a table without a heading.
fn quaternion(columns: &[Seen]) -> Option<[usize; 4]> {
    let has_heading = columns.iter().any(|column| column.target() == Some("heading_rad"));
    let place = |part| columns.iter().position(|column| column.quaternion_part() == Some(part) && column.is_number());
    if has_heading { None } else { Some([place(0)?, place(1)?, place(2)?, place(3)?]) }
}

/// A name as a TOML string.
fn quoted(name: &str) -> String {
    toml::Value::from(name).to_string()
}

#[cfg(test)]
mod tests {
    use super::super::{ColumnMap, read_mapped};
    use super::*;
    use crate::log::Column;

    #[test]
    fn a_draft_runs_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("odd.csv");
        let text = "Stamp [ns];Depth (ft);Yaw;Pitch;Roll;Rudder;Elevator;Shaft rpm;SOG (kn);Lat;Lon;Battery\n\
            1600000000000000000;1;270;2;1;5;-5;1000;2;41.0;-70.0;ok\n\
            1600000000200000000;2;271;2;1;5;-5;1000;2;41.0;-70.0;ok\n";
        std::fs::write(&path, text).unwrap();
        let draft = draft(&path).unwrap();
        let map =
            ColumnMap::parse(&draft.text, Path::new("draft.toml")).unwrap_or_else(|e| panic!("{e}\n{}", draft.text));
        let log = read_mapped(&path, &map).unwrap().log;
        assert_eq!(log.rows[1].time_us, 200_000);
        let value = |column| log.rows[0].get(column).unwrap();
        assert!((value(Column::Depth) - 0.3048).abs() < 1e-12);
        assert!((value(Column::Heading) + std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert!((value(Column::SpeedLog) - 2.0 * 1852.0 / 3600.0).abs() < 1e-12);
        assert!((value(Column::FinTop) - 5.0_f64.to_radians()).abs() < 1e-12);
        assert!((value(Column::FinStarboard) - 5.0_f64.to_radians()).abs() < 1e-12);
        assert_eq!((value(Column::PropRpm), log.rows[0].gnss_m()), (1000.0, Some([0.0, 0.0])));
        assert_eq!(draft.unused, ["Battery"]);
    }

    /// A table as `ros2 topic echo --csv` and a spreadsheet leave it: it runs as drafted.
    #[test]
    fn names_of_ros_and_marks_of_no_sample() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ros.csv");
        // facing east, level; nose down 0.1 rad/s, to port 0.2 rad/s; sliding to port
        let text = "header.stamp,orientation.x,orientation.y,orientation.z,orientation.w,angular_velocity.x,angular_velocity.y,\
            angular_velocity.z,dvl.linear.x,dvl.linear.y,dvl.linear.z,odom.position.x,odom.position.y,prop_radps\n\
            1700000000000000000,0,0,0,1,0,0.1,0.2,1.5,0.3,0.4,7,8,NaN\n\
            1700000000500000000,0,0,0,1,0,0.1,0.2,1.5,0.3,0.4,7,8,100\n";
        std::fs::write(&path, text).unwrap();
        let draft = draft(&path).unwrap();
        assert!(draft.unused.is_empty(), "{:?}", draft.unused);
        let map = ColumnMap::parse(&draft.text, Path::new("m.toml")).unwrap_or_else(|e| panic!("{e}\n{}", draft.text));
        let rows = read_mapped(&path, &map).unwrap().log.rows;
        let value = |column| rows[0].get(column).unwrap();
        assert!((rows[0].attitude_rad().unwrap()[2] - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert_eq!([Column::Q, Column::R, Column::DvlV, Column::DvlW].map(value), [-0.1, -0.2, -0.3, -0.4]);
        assert_eq!((value(Column::DvlU), rows[0].gnss_m()), (1.5, Some([8.0, 7.0])));
        assert_eq!([0, 1].map(|row| rows[row].get(Column::PropRpm).map(f64::round)), [None, Some(955.0)]);
        std::fs::write(&path, "t,yaw enu [deg],DVL Velocity X [m/s],DVL Velocity Z [m/s]\n0,90,1,2\n1,180,1,2\n")
            .unwrap();
        let map = ColumnMap::parse(&super::draft(&path).unwrap().text, Path::new("m.toml")).unwrap();
        let rows = read_mapped(&path, &map).unwrap().log.rows;
        assert!(rows[0].get(Column::Heading).unwrap().abs() < 1e-12); // to the north
        assert_eq!([Column::DvlU, Column::DvlW].map(|column| rows[0].get(column)), [Some(1.0), Some(2.0)]);
    }

    /// 2 m of sea water above 1 atm, by its definition; a depth of its own is preferred.
    #[test]
    fn a_pressure_is_a_depth() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.csv");
        let at_2_m = (101_325.0 + 2.0 * 1025.0 * 9.81) / 100.0;
        std::fs::write(&path, format!("t,abs_pressure_mbar\n0,1013.25\n1,{at_2_m}\n")).unwrap();
        let map = ColumnMap::parse(&draft(&path).unwrap().text, Path::new("m.toml")).unwrap();
        let log = read_mapped(&path, &map).unwrap().log;
        let depths: Vec<f64> = log.rows.iter().filter_map(|row| row.get(Column::Depth)).collect();
        assert!(depths.len() == 2 && depths[0].abs() < 1e-9 && (depths[1] - 2.0).abs() < 1e-9, "{depths:?}");
        std::fs::write(&path, "t,pressure_dbar,depth_m\n0,1,1\n1,2,2\n").unwrap();
        assert_eq!(draft(&path).unwrap().unused, ["pressure_dbar"]);
    }

    #[test]
    fn a_log_that_is_no_table_needs_no_draft() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("dive.alog");
        std::fs::write(&path, "%% LOG FILE: dive.alog\n0.5 NAV_DEPTH iIver 3.0\n").unwrap();
        let complaint = draft(&path).unwrap_err().to_string();
        assert!(complaint.contains("MOOS alog: needs no mapping"), "{complaint}");
    }

    #[test]
    fn a_quaternion_and_constants() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("q.csv");
        // facing north-east (yaw 45 degrees from east), nose up by 10 degrees (pitch -10 in forward-left-up)
        let (yaw, pitch) = (45.0_f64.to_radians(), -10.0_f64.to_radians());
        let ((sy, cy), (sp, cp)) = ((0.5 * yaw).sin_cos(), (0.5 * pitch).sin_cos());
        let q = [cy * cp, -sy * sp, cy * sp, sy * cp];
        std::fs::write(&path, format!("t,w,x,y,z\n0,{},{},{},{}\n", q[0], q[1], q[2], q[3])).unwrap();
        let map = "[time]\ncolumn = \"t\"\n[columns]\n[quaternion]\ncolumns = [\"w\", \"x\", \"y\", \"z\"]\nframes = \"enu-flu\"\n\
            [constants]\nprop_rpm = 900.0\n";
        let map = ColumnMap::parse(map, Path::new("m.toml")).unwrap();
        let row = read_mapped(&path, &map).unwrap().log.rows[0].clone();
        let euler = row.attitude_rad().unwrap();
        for (found, expected) in euler.iter().zip([0.0, 10.0_f64.to_radians(), 45.0_f64.to_radians()]) {
            assert!((found - expected).abs() < 1e-12, "{euler:?}");
        }
        assert_eq!(row.get(Column::PropRpm), Some(900.0));
    }
}
