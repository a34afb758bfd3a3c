//! A table of any other maker by a mapping that the user writes.

use super::engine::Cells;
use super::format::{Format, Known, Role};
use super::line_time::DateOrder;
use crate::DataError;
use crate::log::units::{self, RAD_PER_DEG, Unit};
use crate::log::{Column, Source};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// Name of what such a table is.
pub(super) const NAME: &str = "table by a column mapping";

/// The time of a vehicle log.
const TIME: &str = "t_s";

/// Of constants alone nothing comes in a table; in a log of messages they stand beside what it has by itself.
const EMPTY: &str = "[columns] is empty: map at least one column of the vehicle log";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    separator: Option<Spanned<String>>,
    #[serde(default)]
    missing: Vec<String>,
    time: Option<TimeEntry>,
    #[serde(default)]
    columns: BTreeMap<String, Spanned<Entry>>,
    quaternion: Option<QuaternionEntry>,
    #[serde(default)]
    constants: BTreeMap<String, Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct QuaternionEntry {
    columns: [String; 4],
    frames: Spanned<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TimeEntry {
    column: Spanned<String>,
    unit: Option<Spanned<String>>,
    base: Option<Spanned<String>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    column: Spanned<String>,
    unit: Option<Spanned<String>>,
    sign: Option<Spanned<f64>>,
    scale: Option<Spanned<f64>>,
    offset: Option<Spanned<f64>>,
}

/// How a table's columns become those of a vehicle log.
///
/// ```toml
/// separator = ";"                 # left out: a comma
/// missing = ["NaN", "-9999"]      # what stands in a cell without a sample; left out: nothing does
///
/// [time]                          # of a table; a ROS 2 bag has its own
/// column = "Time (ms)"
/// unit = "ms"                     # s, ms, us, ns, min, h, d; hms for HH:MM:SS; iso, dmy, mdy for yyyy-mm-dd,
///                                 # dd/mm/yyyy, mm/dd/yyyy and hh:mm:ss behind it; datenum (MATLAB), excel: days
///                                 # since year 0, since 1900
/// base = "epoch"                  # the first row is zero; left out: seconds since the start of the log
///
/// [columns.depth_m]               # a column of the vehicle log, or latitude_deg and longitude_deg
/// column = "Depth (ft)"           # of a ROS 2 bag: "/topic", "/topic[2]", "/topic.field[name]"
/// unit = "ft"                     # left out: the unit of the vehicle log
/// sign = -1                       # left out: 1
/// offset = 0.5                    # added before, in the table's unit; left out: 0
/// scale = 1.02                    # times the unit's factor; left out: 1
///
/// [quaternion]                    # instead of roll_rad, pitch_rad, heading_rad: from body to the local frame
/// columns = ["qw", "qx", "qy", "qz"]
/// frames = "enu-flu"              # or "ned-frd"
///
/// [constants]                     # what every row shares, in the unit of the vehicle log
/// prop_rpm = 1000.0
/// ```
#[derive(Clone, Debug)]
pub struct ColumnMap {
    format: Format,
    separator: u8,
    missing: Vec<String>,
    path: PathBuf,
}

impl ColumnMap {
    /// Reads a mapping.
    ///
    /// # Errors
    /// Where the file is no mapping: line, column, what was expected.
    pub fn read(path: &Path) -> Result<Self, DataError> {
        let text = crate::settings::read(path)?;
        Self::parse(&text, path)
    }

    /// A mapping from text; `path` is for messages.
    ///
    /// # Errors
    /// As [`ColumnMap::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, DataError> {
        let at = |span: Range<usize>, message: String| {
            let (line, column) = crate::settings::place(text, span.start);
            DataError::at(path, line, column, message)
        };
        let file: File = toml::from_str(text).map_err(|e| {
            let message = e.message().lines().collect::<Vec<_>>().join("; ");
            match e.span() {
                Some(span) => at(span, message),
                None => DataError::file(path, message),
            }
        })?;
        let separator = match &file.separator {
            None => b',',
            Some(text) => match text.get_ref().as_bytes() {
                [one] => *one,
                _ => return Err(at(text.span(), "separator: expected one character".to_owned())),
            },
        };
        let mut columns = Vec::new();
        if let Some(time) = &file.time {
            let role = time_role(time).map_err(|(span, message)| at(span, message))?;
            columns.push(Known { name: time.column.get_ref().clone(), role });
        }
        for (target, entry) in &file.columns {
            let role = entry_role(target, entry).map_err(|(span, message)| at(span, message))?;
            columns.push(Known { name: entry.get_ref().column.get_ref().clone(), role });
        }
        if let Some(quaternion) = &file.quaternion {
            let is_enu_flu = match quaternion.frames.get_ref().as_str() {
                "enu-flu" => true,
                "ned-frd" => false,
                other => {
                    let message = format!("quaternion.frames: {other:?}; expected \"enu-flu\" or \"ned-frd\"");
                    return Err(at(quaternion.frames.span(), message));
                }
            };
            for (part, name) in quaternion.columns.iter().enumerate() {
                columns.push(Known { name: name.clone(), role: Role::Quaternion { part, is_enu_flu } });
            }
        }
        let mut constants = Vec::new();
        for (target, value) in &file.constants {
            match Column::from_name(target).filter(|_| value.get_ref().is_finite()) {
                Some(column) => constants.push((column, *value.get_ref())),
                None => {
                    let message =
                        format!("constants.{target}: expected a column of the vehicle log and a finite number");
                    return Err(at(value.span(), message));
                }
            }
        }
        if file.columns.is_empty() && file.quaternion.is_none() && constants.is_empty() {
            return Err(DataError::file(path, EMPTY));
        }
        Ok(Self {
            format: Format {
                name: NAME.to_owned(),
                separators: Vec::new(),
                columns,
                every_column_needed: true,
                needed: Vec::new(),
                file_is_run: None,
                constants,
                dropped: Vec::new(),
                remarks: Vec::new(),
            },
            separator,
            missing: file.missing,
            path: path.to_owned(),
        })
    }

    /// Fails if it does not say what a table's columns are, and which has the time.
    pub(super) fn check_table(&self) -> Result<(), DataError> {
        if self.format.columns.iter().all(|known| known.role.is_time()) {
            return Err(DataError::file(&self.path, EMPTY));
        }
        match self.has_time() {
            true => Ok(()),
            false => Err(DataError::file(&self.path, "missing [time]: the column of a table that has the time")),
        }
    }

    /// Of a vehicle log, whose other columns stay as they are: the same, with those.
    pub(super) fn beside(&self, header: &[&str]) -> Self {
        let mut whole = self.clone();
        let is_mapped = |column: Column| {
            self.format.columns.iter().any(|known| matches!(known.role, Role::Sample { column: c, .. } if c == column))
        };
        whole.format.columns.extend(header.iter().filter_map(|name| {
            let role = match Column::from_name(name) {
                Some(column) if !is_mapped(column) => Role::Sample { column, scale: 1.0, offset: 0.0 },
                None if *name == TIME => Role::Seconds(1.0),
                _ => return None,
            };
            Some(Known { name: (*name).to_owned(), role })
        }));
        whole
    }

    /// What each column of the log is made of.
    pub(super) fn sources(&self) -> BTreeMap<Column, Source> {
        let of = |known: &Known| match known.role {
            Role::Sample { column, scale, offset } => {
                Some((column, Source { name: known.name.clone(), scale, offset }))
            }
            _ => None,
        };
        self.format.columns.iter().filter_map(of).collect()
    }

    /// The column that has the time.
    pub(super) fn time_column(&self) -> Option<String> {
        self.format.columns.iter().find(|known| known.role.is_time()).map(|known| known.name.clone())
    }

    /// Whether it says which column of a table has the time.
    pub(super) fn has_time(&self) -> bool {
        self.format.columns.iter().any(|known| known.role.is_time())
    }

    /// Columns of the table and what they become.
    pub fn columns(&self) -> impl Iterator<Item = (&str, &'static str)> {
        self.format.columns.iter().map(|known| (&*known.name, known.role.name()))
    }

    pub(super) fn cells(&self) -> Cells<'_> {
        Cells { separator: self.separator, missing: &self.missing }
    }

    pub(super) const fn format(&self) -> &Format {
        &self.format
    }
}

/// Times by a clock or a calendar. A MATLAB datenum counts from year 0, a spreadsheet from 1900, with a leap day too many.
const CALENDAR: [(&str, Role); 6] = [
    ("hms", Role::TimeOfDay),
    ("iso", Role::Instant(DateOrder::YearMonthDay)),
    ("dmy", Role::Instant(DateOrder::DayMonthYear)),
    ("mdy", Role::Instant(DateOrder::MonthDayYear)),
    ("datenum", Role::Days(719_529.0)),
    ("excel", Role::Days(25_569.0)),
];

/// What is wrong and where.
type Complaint = (Range<usize>, String);

fn time_role(time: &TimeEntry) -> Result<Role, Complaint> {
    let is_epoch = match &time.base {
        None => false,
        Some(base) if base.get_ref() == "epoch" => true,
        Some(base) if base.get_ref() == "start" => false,
        Some(base) => {
            let message = format!("time.base: {:?}; expected \"start\" or \"epoch\"", base.get_ref());
            return Err((base.span(), message));
        }
    };
    if let Some((_, role)) =
        time.unit.as_ref().and_then(|unit| CALENDAR.iter().find(|(known, _)| known == unit.get_ref()))
    {
        return Ok(*role);
    }
    let factor = factor("time", time.unit.as_ref(), units::TIME.iter())?;
    Ok(if is_epoch { Role::Epoch(factor) } else { Role::Seconds(factor) })
}

fn entry_role(target: &str, entry: &Spanned<Entry>) -> Result<Role, Complaint> {
    let (span, entry) = (entry.span(), entry.get_ref());
    let name = format!("columns.{target}");
    if target == "run" {
        return Ok(Role::Run);
    }
    let global = ["latitude_deg", "longitude_deg"].iter().position(|name| *name == target);
    let column = Column::from_name(target);
    if global.is_none() && column.is_none() {
        let known: Vec<&str> = Column::ALL.iter().map(|column| column.name()).collect();
        let message = format!(
            "{name}: the vehicle log has no such column; it has {}, latitude_deg, longitude_deg",
            known.join(", ")
        );
        return Err((span, message));
    }
    let factor = factor(&name, entry.unit.as_ref(), units::of(target))?;
    let sign = entry.sign.as_ref().map_or(1.0, |sign| *sign.get_ref());
    if sign.abs() != 1.0 {
        let span = entry.sign.as_ref().map_or(span, Spanned::span);
        return Err((span, format!("{name}.sign: {sign}; expected 1 or -1")));
    }
    let number = |value: &Option<Spanned<f64>>, key: &str, otherwise: f64| match value {
        Some(value) if !value.get_ref().is_finite() || (key == "scale" && *value.get_ref() == 0.0) => {
            Err((value.span(), format!("{name}.{key}: {} is not a usable number", value.get_ref())))
        }
        value => Ok(value.as_ref().map_or(otherwise, |value| *value.get_ref())),
    };
    let scale = sign * factor * number(&entry.scale, "scale", 1.0)?;
    let offset = number(&entry.offset, "offset", 0.0)?;
    match (global, column) {
        (Some(axis), _) if offset == 0.0 && [1.0, 1.0 / RAD_PER_DEG].contains(&scale) => {
            Ok(Role::Place { axis, is_in_radians: scale != 1.0 })
        }
        (Some(_), _) => {
            Err((span, format!("{name}: positions are in deg or rad; sign, scale and offset do not apply")))
        }
        (None, Some(column)) => Ok(Role::Sample { column, scale, offset }),
        (None, None) => Err((span, format!("{name}: unknown"))),
    }
}

fn factor(
    name: &str,
    unit: Option<&Spanned<String>>,
    mut units: impl Iterator<Item = &'static Unit> + Clone,
) -> Result<f64, Complaint> {
    let Some(unit) = unit else { return Ok(1.0) };
    let all = units.clone();
    units.find(|(known, _)| known == unit.get_ref()).map(|(_, factor)| *factor).ok_or_else(|| {
        let known: Vec<&str> = all.map(|(known, _)| *known).collect();
        let also = CALENDAR.iter().map(|(known, _)| *known).filter(|_| name == "time");
        let known: Vec<&str> = known.into_iter().chain(also).collect();
        (unit.span(), format!("{name}.unit: {:?}; expected one of {}", unit.get_ref(), known.join(", ")))
    })
}

#[cfg(test)]
mod tests {
    use super::super::tests::import_mapped;
    use super::*;

    const MAP: &str = "separator = \";\"\n[time]\ncolumn = \"ms\"\nunit = \"ms\"\nbase = \"epoch\"\n\
        [columns.depth_m]\ncolumn = \"Tiefe\"\nunit = \"ft\"\nsign = -1\noffset = 1\n\
        [columns.heading_rad]\ncolumn = \"Kurs\"\nunit = \"deg\"\n[columns.dvl_u_mps]\ncolumn = \"v\"\nscale = 2\n";

    #[test]
    fn val_units_sign_offset_and_time_base() {
        let log = import_mapped("ms;v;Tiefe;Kurs;Rest\n1500;0.5;-11;270;x\n2500;;-21;90;x\n", MAP).unwrap().log;
        assert_eq!(log.rows.iter().map(|row| row.time_us).collect::<Vec<_>>(), [0, 1_000_000]);
        assert!((log.rows[0].get(Column::Depth).unwrap() - 3.048).abs() < 1e-12); // (−11 + 1) · −1 feet
        assert!((log.rows[0].get(Column::Heading).unwrap() + std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert_eq!(log.rows[0].get(Column::DvlU), Some(1.0));
        assert_eq!(log.rows[1].get(Column::DvlU), None);
        assert!(log.notes.iter().any(|note| note.starts_with("dropped Rest")), "{:?}", log.notes);
    }

    /// Two rows at midnight, a second apart, each as another program writes them.
    #[test]
    fn val_times_of_a_calendar() {
        const START_US: i64 = 1_795_219_199_000_000; // date -u -d '2026-11-20 23:59:59' +%s
        for (unit, first, second, start_us) in [
            ("iso", "2026-11-20 23:59:59", "2026-11-21T00:00:00Z", Some(START_US)),
            ("dmy", "20/11/2026 23:59:59", "21/11/2026 00:00:00.0", Some(START_US)),
            ("dmy", "20.11.2026 23:59:59", "21.11.2026 00:00:00", Some(START_US)),
            ("mdy", "11/20/2026 11:59:59 PM", "11/21/2026 12:00:00 AM", Some(START_US)),
            ("datenum", "740306.999988426", "740307.0", Some(START_US)), // datenum(2026,11,20,23,59,59)
            ("excel", "46346.999988426", "46347.0", Some(START_US)),
            ("hms", "23:59:59", "00:00:00", None),
            ("hms", "11:59:59 PM", "12:00:00 AM", None),
        ] {
            let text = format!(
                "separator = \";\"\n[time]\ncolumn = \"Datum\"\nunit = \"{unit}\"\n[columns.depth_m]\ncolumn = \"Tiefe\"\n"
            );
            let log = import_mapped(format!("Datum;Tiefe\n{first};1\n{second};2\n"), &text).unwrap().log;
            let near = |a: i64, b: i64| (a - b).abs() < 100; // µs: a day in a double has 10
            assert!(near(log.rows[1].time_us as i64, 1_000_000), "{unit}: {}", log.rows[1].time_us);
            assert_eq!(log.rows[0].time_us, 0);
            assert!(start_us.is_none_or(|start_us| near(log.start_unix_us.unwrap(), start_us)), "{unit}");
        }
    }

    #[test]
    fn val_the_roll_of_an_instrument_upside_down() {
        let text = "separator = \";\"\n[time]\ncolumn = \"t\"\nunit = \"s\"\nbase = \"start\"\n\
            [columns.roll_rad]\ncolumn = \"Rollen\"\nunit = \"deg\"\noffset = 180\n";
        let log = import_mapped("t;Rollen\n0;-176\n1;179\n", text).unwrap().log;
        let roll_deg = [0, 1].map(|row| log.rows[row].get(Column::Roll).unwrap().to_degrees());
        assert!((roll_deg[0] - 4.0).abs() < 1e-9 && (roll_deg[1] + 1.0).abs() < 1e-9, "{roll_deg:?}");
    }

    /// As Excel writes it where the comma is decimal, and a quoted text in between.
    #[test]
    fn decimal_commas_quotes_and_marks_of_no_sample() {
        let table = "\"ms\";v;\"Rest\";Tiefe;Kurs\n1500;0,5;\"a; b\";-11;270\n2500;n/a;x;-9999;90\n";
        let marked = format!("missing = [\"n/a\", \"-9999\"]\n{MAP}");
        let log = import_mapped(table, &marked).unwrap().log;
        assert_eq!(log.rows[0].get(Column::DvlU), Some(1.0));
        assert!((log.rows[0].get(Column::Depth).unwrap() - 3.048).abs() < 1e-12);
        assert_eq!([Column::DvlU, Column::Depth].map(|column| log.rows[1].get(column)), [None; 2]);
        let complaint = import_mapped(table, MAP).unwrap_err().to_string();
        assert!(complaint.contains(":3:2: v: \"n/a\" is not a number"), "{complaint}");
    }

    #[test]
    fn what_a_mapping_may_not_say() {
        for (from, to, message) in [
            ("unit = \"ft\"", "unit = \"kn\"", "map.toml:8:8: columns.depth_m.unit: \"kn\"; expected one of m, ft"),
            ("unit = \"ms\"", "unit = \"furlong\"", "map.toml:4:8: time.unit"),
            ("base = \"epoch\"", "base = \"now\"", "map.toml:5:8: time.base"),
            ("sign = -1", "sign = -2", "map.toml:9:8: columns.depth_m.sign: -2; expected"),
            ("offset = 1", "offset = nan", "map.toml:10:10: columns.depth_m.offset: NaN"),
            ("offset = 1", "ofset = 1", "unknown field `ofset`"),
            ("columns.depth_m", "columns.depth_ft", "columns.depth_ft: the vehicle log has no such column"),
            ("separator = \";\"", "separator = \";;\"", "map.toml:1:13: separator: expected one character"),
            ("[time]", "[times]", "unknown field `times`"),
        ] {
            let map = ColumnMap::parse(&MAP.replacen(from, to, 1), Path::new("map.toml"));
            let complaint = map.unwrap_err().to_string();
            assert!(complaint.contains(message) && complaint.lines().count() == 1, "{to}: {complaint}");
        }
    }
}
