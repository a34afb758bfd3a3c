//! Reads a table by its format: binds the columns, converts rows, reports what was dropped and why.

use super::calendar;
use super::format::{Format, Known, Role};
use super::origin::Origin;
use crate::DataError;
use crate::log::table::{self, Records};
use crate::log::{BETWEEN_RUNS_US, Column, Log, LogRow, MAX_SECONDS, run_note};
use backseat_core::state::wrap_angle;
use csv::{ByteRecord, ReaderBuilder, Trim};
use std::path::Path;

/// Water over the antenna from which on no receiver has a fix, m.
const SUBMERGED_M: f64 = 1.0;

const HOUR_US: i64 = 3_600_000_000;
const DAY_US: i64 = 24 * HOUR_US;

/// How the cells of a table are written.
#[derive(Clone, Copy)]
pub(super) struct Cells<'a> {
    /// What stands between two of them.
    pub separator: u8,
    /// Texts of a cell without a sample, beside none.
    pub missing: &'a [String],
}

/// Reads a table of this format.
pub(super) fn read(path: &Path, format: &Format, cells: Cells<'_>) -> Result<Log, DataError> {
    let mut records = Records::open(path, ReaderBuilder::new().delimiter(cells.separator).trim(Trim::All))?;
    records.advance()?;
    let mut importer = Importer::bind(path, format, cells, &records.record)?;
    while let Some(line) = records.advance()? {
        table::check_rows(path, line, importer.log.rows.len() as u64 + 1)?;
        if let Some(error) = importer.row(line, &records.record).err() {
            // A log that was cut off ends within a row.
            let is_last = records.advance()?.is_none();
            if !(is_last && importer.is_short && !importer.log.rows.is_empty()) {
                return Err(error);
            }
            importer.log.notes.push(format!("line {line}, the last, was cut off and is left out"));
            break;
        }
    }
    importer.finish()
}

struct Importer<'a> {
    path: &'a Path,
    format: &'a Format,
    written: Cells<'a>,
    cells: usize,
    bound: Vec<(usize, &'a Known)>,
    origin: Option<Origin>,
    start_us: Option<i64>,
    /// Times are those of a calendar.
    has_date: bool,
    /// Hours or days that times without them have gone through, µs, and the last such time.
    passed_us: i64,
    clock_us: Option<i64>,
    /// Such times are those within an hour.
    lacks_hours: bool,
    /// Label and number of the run, and the time at which it begins, µs.
    run: (Vec<u8>, u32, u64),
    /// The row has fewer cells than the header.
    is_short: bool,
    /// Positions that are no fixes.
    dropped_positions: usize,
    /// Rows that the log itself marks as not to be used.
    left_out: usize,
    log: Log,
}

impl<'a> Importer<'a> {
    fn bind(path: &'a Path, format: &'a Format, written: Cells<'a>, header: &ByteRecord) -> Result<Self, DataError> {
        let names: Vec<String> = header.iter().map(|cell| String::from_utf8_lossy(cell).into_owned()).collect();
        let fail = |cell: usize, message: String| Err(DataError::at(path, 1, cell as u64, message));
        table::check_columns(path, header)?;
        let needed = format.needed.iter().map(String::as_str);
        let every = format.columns.iter().filter(|_| format.every_column_needed).map(|known| &*known.name);
        if let Some(missing) = needed.chain(every).find(|name| !names.iter().any(|found| found == name)) {
            let found: String = names.join(", ").chars().take(120).collect();
            return fail(0, format!("{}: no column {missing}; found: {found}", format.name));
        }
        let mut bound: Vec<(usize, &Known)> = Vec::new();
        for known in format.columns.iter() {
            let mut places = (0..names.len()).filter(|place| names[*place] == known.name);
            let (Some(place), second) = (places.next(), places.next()) else { continue };
            if let Some(second) = second {
                return fail(second + 1, format!("column {} appears twice", known.name));
            }
            bound.push((place, known));
        }
        // Local positions are what latitude and longitude would give.
        let has_local = [Column::GpsX, Column::GpsY].iter().all(|column| is_bound(&bound, *column));
        let mut notes = Vec::new();
        if has_local {
            let spare: Vec<&str> = bound.iter().filter(|(_, k)| is_global(k.role)).map(|(_, k)| &*k.name).collect();
            if !spare.is_empty() {
                notes.push(format!("dropped {} (north_m and east_m are used)", spare.join(", ")));
            }
            bound.retain(|(_, known)| !is_global(known.role));
        }
        let used: Vec<&str> = bound.iter().map(|(_, known)| &*known.name).collect();
        notes.insert(0, format!("{}; recognised: {}", format.name, used.join(", ")));
        let spare = format.columns.iter().map(|known| &*known.name);
        let mentioned: Vec<&str> = if has_local { spare.collect() } else { used };
        notes.extend(dropped(format, &names, &mentioned));
        notes.extend(format.remarks.iter().cloned());
        let mut importer = Self {
            path,
            format,
            written,
            cells: header.len(),
            bound,
            origin: None,
            start_us: None,
            has_date: false,
            passed_us: 0,
            clock_us: None,
            lacks_hours: false,
            run: (Vec::new(), 0, 0),
            is_short: false,
            dropped_positions: 0,
            left_out: 0,
            log: Log { path: path.to_owned(), notes, ..Log::default() },
        };
        if let Some(beginnings) = &format.file_is_run {
            importer.enter_run(run_of(path, beginnings).as_bytes());
        }
        Ok(importer)
    }

    fn row(&mut self, line: u64, record: &ByteRecord) -> Result<(), DataError> {
        self.is_short = record.len() < self.cells;
        // A trailing separator makes one more cell, its absence one less.
        if record.len() + 1 < self.cells || record.len() > self.cells + 1 {
            let message = format!("{} cells where the header has {}", record.len(), self.cells);
            return Err(DataError::at(self.path, line, 0, message));
        }
        let mut row = LogRow::new(0);
        for &(column, value) in self.format.constants.iter() {
            row.set(column, value);
        }
        let (mut time, mut run) = (Time::default(), None);
        let mut quaternion = [None; 4];
        let (mut is_quaternion_enu_flu, mut is_left_out) = (false, false);
        let (mut place, mut is_fix): ([Option<f64>; 2], Option<bool>) = ([None; 2], None);
        for &(cell, known) in &self.bound {
            let text = record.get(cell).unwrap_or_default();
            let is_missing = self.written.missing.iter().any(|missing| missing.as_bytes() == text);
            let text = if is_missing { &[] } else { text };
            let fail =
                |message: String| DataError::at(self.path, line, cell as u64 + 1, format!("{}: {message}", known.name));
            let number = || {
                let value = table::number_between(self.written.separator, text).map_err(fail)?;
                Ok::<_, DataError>((!value.is_nan()).then_some(value))
            };
            let readable = || std::str::from_utf8(text).unwrap_or_default();
            if known.role.is_time() {
                time.cell = cell as u64 + 1;
                time.name = &known.name;
            }
            match known.role {
                Role::TimeOfDay => {
                    time.day_us = calendar::time_us(readable());
                    time.minutes_us = calendar::minutes_us(readable());
                    if time.day_us.or(time.minutes_us).is_none() {
                        return Err(fail(format!("{:?} is not HH:MM:SS or MM:SS.s", readable())));
                    }
                }
                Role::Date => {
                    let parsed = calendar::date_days(readable());
                    time.days = Some(parsed.ok_or_else(|| fail(format!("{:?} is not M/D/YYYY", readable())))?);
                }
                Role::Instant(order) => {
                    let complaint = || fail(format!("{:?} is not {}", readable(), order.pattern()));
                    time.seconds = Some(order.unix_us(readable()).ok_or_else(complaint)? as f64 * 1e-6);
                    time.is_epoch = true;
                }
                Role::Days(first) => {
                    let days = number()?.ok_or_else(|| fail("is empty; every row needs its time".to_owned()))?;
                    let seconds = (days - first) * 86_400.0;
                    if !(0.0..MAX_SECONDS).contains(&seconds) {
                        return Err(fail(format!("day {days} is not between 1970 and 2096: another unit?")));
                    }
                    time.seconds = Some(seconds);
                    time.is_epoch = true;
                }
                Role::Seconds(_) | Role::Epoch(_) | Role::Arrival => {
                    let factor =
                        if let Role::Seconds(factor) | Role::Epoch(factor) = known.role { factor } else { 1.0 };
                    let seconds =
                        number()?.ok_or_else(|| fail("is empty; every row needs its time".to_owned()))? * factor;
                    if !(0.0..MAX_SECONDS).contains(&seconds) {
                        return Err(fail(format!("{seconds} is outside 0 to {MAX_SECONDS} s")));
                    }
                    time.is_epoch = matches!(known.role, Role::Epoch(_));
                    time.seconds = Some(seconds);
                    if known.role == Role::Arrival {
                        row.set(Column::Toa, seconds);
                    }
                }
                Role::Place { axis, is_in_radians } => {
                    let limit = [90.0, 180.0][axis];
                    place[axis] = number()?.map(|angle| if is_in_radians { angle.to_degrees() } else { angle });
                    if let Some(degrees) = place[axis].filter(|degrees| degrees.abs() > limit) {
                        return Err(fail(format!("{degrees} is outside -{limit} to {limit} degrees")));
                    }
                }
                Role::Quaternion { part, is_enu_flu } => {
                    quaternion[part] = number()?;
                    is_quaternion_enu_flu = is_enu_flu;
                }
                Role::Label(column) => {
                    let digits: String = readable().chars().filter(char::is_ascii_digit).collect();
                    let complaint = || fail(format!("{:?} holds no number, such as M11", readable()));
                    row.set(column, digits.parse().map_err(|_| complaint())?);
                }
                Role::Run => run = Some(text),
                Role::LeftOut => is_left_out = text.eq_ignore_ascii_case(b"true"),
                Role::Satellites => is_fix = Some(number()?.is_none_or(|count| count > 0.0)),
                Role::FixStatus => is_fix = Some(number()? == Some(0.0)),
                Role::Sample { column, scale, offset } => {
                    if let Some(value) = number()? {
                        let value = (value + offset) * scale;
                        // an instrument that hangs upside down reads a roll of 180 degrees, which goes on beyond
                        let is_turned = column == Column::Heading || column == Column::Roll && offset != 0.0;
                        row.set(column, if is_turned { wrap_angle(value) } else { value });
                    }
                }
            }
        }
        if let [Some(w), Some(x), Some(y), Some(z)] = quaternion
            && let Some(euler_rad) = euler_rad([w, x, y, z], is_quaternion_enu_flu)
        {
            row.set_all(Column::Roll, &euler_rad);
        }
        if is_left_out {
            self.left_out += 1;
            return Ok(());
        }
        if let Some(label) = run {
            self.enter_run(label);
        }
        if self.run.1 > 0 {
            row.set(Column::Run, f64::from(self.run.1));
        }
        row.time_us = self.time_us(line, &time)?;
        if let [Some(latitude), Some(longitude)] = place {
            let is_submerged = row.get(Column::Depth).is_some_and(|depth_m| depth_m > SUBMERGED_M);
            if is_fix != Some(false) && !is_submerged {
                let origin = self.origin.get_or_insert_with(|| Origin::new(latitude, longitude));
                row.set_all(Column::GpsX, &origin.local_m(latitude, longitude));
            } else {
                self.dropped_positions += 1;
            }
        }
        self.log.rows.push(row);
        Ok(())
    }

    /// A new label begins a new run, whose times count from its own start.
    fn enter_run(&mut self, label: &[u8]) {
        if self.run.1 > 0 && self.run.0 == label {
            return;
        }
        let begins_us = self.log.rows.last().map_or(0, |row| row.time_us + BETWEEN_RUNS_US);
        self.run = (label.to_vec(), self.run.1 + 1, begins_us);
        self.start_us = None;
        let label = String::from_utf8_lossy(label).into_owned();
        self.log.runs.push((label.clone(), begins_us));
        self.log.notes.push(run_note(self.log.runs.len(), &label, begins_us));
    }

    fn time_us(&mut self, line: u64, time: &Time<'_>) -> Result<u64, DataError> {
        if time.cell == 0 {
            // A table of places.
            return Ok(0);
        }
        let fail = |message: &str| DataError::at(self.path, line, time.cell, format!("{}: {message}", time.name));
        let absolute_us = match (time.seconds, time.day_us, time.minutes_us) {
            (Some(seconds), ..) => (seconds * 1e6).round() as i64,
            (None, Some(day_us), _) => match time.days {
                Some(days) => days * DAY_US + day_us,
                None => self.going_on(day_us, DAY_US),
            },
            (None, None, Some(minutes_us)) => {
                self.lacks_hours = true;
                self.going_on(minutes_us, HOUR_US)
            }
            (None, None, None) => return Err(fail("is empty; every row needs its time")),
        };
        let is_absolute = time.seconds.is_some() && !time.is_epoch;
        self.has_date = time.is_epoch || time.days.is_some();
        let start_us = *self.start_us.get_or_insert(if is_absolute { 0 } else { absolute_us });
        let previous_us = self.log.rows.last().map_or(0, |row| row.time_us);
        match u64::try_from(absolute_us - start_us).map(|time_us| time_us + self.run.2) {
            // what a vehicle log can hold
            Ok(time_us) if time_us as f64 * 1e-6 >= MAX_SECONDS => {
                Err(fail("the time is more than a century after the first"))
            }
            Ok(time_us) if time_us >= previous_us => Ok(time_us),
            _ => Err(fail("the time is before that of the row above")),
        }
    }

    /// A clock that starts again: half a turn back is the next turn; less is a time that goes back.
    fn going_on(&mut self, clock_us: i64, turn_us: i64) -> i64 {
        let is_next = self.clock_us.is_some_and(|before_us| before_us - clock_us > turn_us / 2);
        self.passed_us += if is_next { turn_us } else { 0 };
        self.clock_us = Some(clock_us);
        self.passed_us + clock_us
    }

    fn finish(mut self) -> Result<Log, DataError> {
        if self.log.rows.is_empty() {
            return Err(DataError::file(self.path, "no rows after the header"));
        }
        self.log.start_unix_us = self.start_us.filter(|_| self.has_date);
        self.log.origin_deg = self.origin.as_ref().map(Origin::degrees);
        if self.lacks_hours {
            self.log.notes.push(
                "times without hours, as a spreadsheet shows them: where they start again an hour is added, so that gaps \
                 of an hour and more are too short"
                    .to_owned(),
            );
        }
        if self.left_out > 0 {
            let plural = if self.left_out == 1 { "" } else { "s" };
            self.log.notes.push(format!("{} row{plural} left out: the log marks them so", self.left_out));
        }
        if self.dropped_positions > 0 {
            let count = self.dropped_positions;
            let plural = if count == 1 { "" } else { "s" };
            self.log.notes.push(format!(
                "{count} position{plural} dropped: no fix (no satellites, not valid, or antenna under water)"
            ));
        }
        Ok(self.log)
    }
}

/// The time of a row.
#[derive(Default)]
struct Time<'a> {
    cell: u64,
    name: &'a str,
    seconds: Option<f64>,
    is_epoch: bool,
    day_us: Option<i64>,
    minutes_us: Option<i64>,
    days: Option<i64>,
}

/// Roll, pitch, heading of a quaternion (w, x, y, z) from body to the local frame; `None` for one of no length.
pub(super) fn euler_rad(q: [f64; 4], is_enu_flu: bool) -> Option<[f64; 3]> {
    let norm = q.iter().map(|part| part * part).sum::<f64>().sqrt();
    if norm.is_nan() || norm < 1e-6 {
        return None;
    }
    let [w, x, y, z] = q.map(|part| part / norm);
    let mut m = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ];
    if is_enu_flu {
        // rows: north is the second axis, east the first, down against the third; columns: y and z of the body turned
        // round
        let [east, north, up] = m;
        m = [[north[0], -north[1], -north[2]], [east[0], -east[1], -east[2]], [-up[0], up[1], up[2]]];
    }
    Some([m[2][1].atan2(m[2][2]), -m[2][0].clamp(-1.0, 1.0).asin(), m[1][0].atan2(m[0][0])])
}

/// The name of a file without its ending, and without the first of these that it begins with.
fn run_of(path: &Path, beginnings: &[String]) -> String {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = name.split('.').next().unwrap_or_default();
    beginnings.iter().find_map(|beginning| stem.strip_prefix(beginning.as_str())).unwrap_or(stem).to_owned()
}

fn is_bound(bound: &[(usize, &Known)], wanted: Column) -> bool {
    bound.iter().any(|(_, known)| matches!(known.role, Role::Sample { column, .. } if column == wanted))
}

const fn is_global(role: Role) -> bool {
    matches!(role, Role::Place { .. })
}

/// One line for every reason for which columns are left out.
fn dropped(format: &Format, names: &[String], mentioned: &[&str]) -> Vec<String> {
    let mut lines: Vec<(&str, Vec<&str>)> = Vec::new();
    for name in names.iter().filter(|name| !name.is_empty() && !mentioned.contains(&name.as_str())) {
        let lower = name.to_ascii_lowercase();
        let reason = format.dropped.iter().find(|(part, _)| lower.contains(part.as_str()));
        let reason = reason.map_or("not part of a vehicle log", |(_, reason)| reason.as_str());
        match lines.iter_mut().find(|(other, _)| *other == reason) {
            Some((_, names)) => names.push(name),
            None => lines.push((reason, vec![name])),
        }
    }
    lines.into_iter().map(|(reason, names)| format!("dropped {} ({reason})", names.join(", "))).collect()
}
