//! The entries of a draft: what each column is taken for, in which axes, and what the tests of columns make of it.

use super::names::ROS;
use super::seen::{Seen, is_actuator};
use crate::importers::ros_bag::{GAUGE_PA, SURFACE_PA};
use crate::log::Column;
use crate::log::plausibility::{Examination, Finding};
use crate::log::units;
use std::f64::consts::FRAC_PI_2;

/// One column of the vehicle log.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    pub target: &'static str,
    /// Column of the table.
    pub place: usize,
    pub unit: &'static str,
    pub sign: f64,
    pub scale: f64,
    pub offset: f64,
    /// Why it is right.
    pub sure: Option<String>,
    /// What is to be checked.
    pub checks: Vec<String>,
}

/// The axes of a table, decided for all its columns together.
pub(super) struct Frames {
    /// Forward, left, up instead of forward, starboard, down, and the words that say so.
    pub body: Option<(bool, String)>,
    /// East, north, up instead of north, east, down.
    pub world: Option<(bool, String)>,
}

impl Frames {
    pub fn of(columns: &[Seen]) -> Self {
        let by = |words: &[&str], of_velocities: bool| {
            let is_of =
                |column: &&Seen| !of_velocities || column.target().is_some_and(|target| target.starts_with("dvl_"));
            columns.iter().filter(is_of).find(|column| column.says(words)).map(|column| column.name.clone())
        };
        let ros = columns.iter().find(|column| ROS.iter().any(|part| column.plain.contains(part)));
        let ros = ros.map(|column| (true, column.name.clone()));
        let body = by(&["left", "up", "flu"], true).map(|name| (true, name));
        let body = body.or_else(|| by(&["right", "starboard", "stbd", "down", "frd"], true).map(|name| (false, name)));
        let world = by(&["enu"], false).map(|name| (true, name));
        let world = world.or_else(|| by(&["ned"], false).map(|name| (false, name)));
        Self { body: body.or_else(|| ros.clone()), world: world.or(ros) }
    }

    pub fn is_flu(&self) -> bool {
        self.body.as_ref().is_some_and(|body| body.0)
    }

    pub fn is_enu(&self) -> bool {
        self.world.as_ref().is_some_and(|world| world.0)
    }

    /// Whether the axis of a column is against that of the vehicle log: by its own name, or by the table's.
    fn is_turned(&self, column: &Seen, target: &str) -> bool {
        match target {
            "dvl_v_mps" if column.says(&["left", "right", "stbd", "starboard"]) => column.says(&["left"]),
            "dvl_w_mps" | "depth_m" if column.says(&["up", "down"]) => column.says(&["up"]),
            "depth_m" => !column.is_pressure() && column.min + column.max < 0.0,
            "heading_rad" => column.says(&["enu"]) || (self.is_enu() && !column.plain.contains("head")),
            "pitch_rad" | "q_radps" | "r_radps" | "dvl_v_mps" | "dvl_w_mps" => self.is_flu(),
            _ => false,
        }
    }
}

/// What each column is taken for; columns in no unit come apart.
pub(super) fn entries(columns: &[Seen], used: &[usize], frames: &Frames) -> (Vec<Entry>, Vec<usize>) {
    let has = |wanted: &str| columns.iter().any(|column| column.target() == Some(wanted));
    let has_degrees = columns.iter().any(|column| {
        let is_angle = |target: &str| target.ends_with("_rad") || ["rudder", "elevator"].contains(&target);
        column.target().is_some_and(is_angle) && column.unit_for("heading_rad", false) == "deg"
    });
    let has_depth = columns.iter().any(|column| column.target() == Some("depth_m") && !column.is_pressure());
    let has_local = has("gps_x_m") && has("gps_y_m");
    let has_true = columns.iter().any(|column| column.target() == Some("heading_rad") && !column.is_magnetic());
    let has_fins = has("elevator") || columns.iter().any(|c| c.target().is_some_and(|t| t.starts_with("fin_")));
    let (mut entries, mut counts): (Vec<Entry>, Vec<usize>) = (Vec::new(), Vec::new());
    // names of the vehicle log first, then those with a unit
    let mut order: Vec<usize> = (0..columns.len()).filter(|place| !used.contains(place)).collect();
    order.sort_by_key(|&place| (columns[place].exact().is_none(), columns[place].unit.is_none()));
    for place in order {
        let column = &columns[place];
        let Some(target) = column.target() else { continue };
        // a range beside a bearing is one fix; an elevation without one is a height
        let is_usbl = has("usbl_bearing_rad");
        let target = if target == "range_m" && is_usbl { "usbl_range_m" } else { target };
        if target == "usbl_elevation_rad" && !is_usbl {
            continue;
        }
        let is_second = match target {
            "depth_m" => column.is_pressure() && has_depth,
            "latitude_deg" | "longitude_deg" => has_local,
            "heading_rad" => column.is_magnetic() && has_true,
            _ => false,
        };
        if is_second {
            continue;
        }
        if is_actuator(target) && column.is_in_counts() && !target.starts_with("thruster") {
            counts.push(place);
            continue;
        }
        let swapped = frames.is_enu() && column.plain.contains("position");
        let targets: Vec<(&'static str, f64)> = match target {
            // one command for a pair of fins: the same column twice, with opposite signs
            "rudder" if has_fins => vec![("fin_top_rad", 1.0), ("fin_bottom_rad", -1.0)],
            "rudder" => vec![("rudder_rad", 1.0)],
            "elevator" => vec![("fin_port_rad", 1.0), ("fin_starboard_rad", -1.0)],
            "gps_x_m" if swapped => vec![("gps_y_m", 1.0)],
            "gps_y_m" if swapped => vec![("gps_x_m", 1.0)],
            one => vec![(one, if frames.is_turned(column, one) { -1.0 } else { 1.0 })],
        };
        if targets.iter().any(|(target, _)| entries.iter().any(|entry| entry.target == *target)) {
            continue;
        }
        entries.extend(targets.into_iter().map(|(target, sign)| {
            let unit = column.unit_for(target, has_degrees);
            let is_its_own = units::factor(target, unit).is_none_or(|factor| factor == 1.0);
            let is_plain = sign > 0.0 && is_its_own && column.against_its_name(unit).is_none();
            let mut entry = Entry {
                target,
                place,
                unit,
                sign,
                scale: 1.0,
                offset: 0.0,
                sure: column.exact().filter(|_| is_plain).map(|_| "its name is that of the vehicle log".to_owned()),
                checks: Vec::new(),
            };
            entry.complete(column, frames);
            entry
        }));
    }
    entries.sort_by_key(|entry| entry.place);
    counts.sort_unstable();
    (entries, counts)
}

impl Entry {
    /// Offsets, and what its name leaves open.
    fn complete(&mut self, column: &Seen, frames: &Frames) {
        if self.sure.is_some() {
            return;
        }
        if self.target == "heading_rad" && self.sign < 0.0 {
            self.offset = -FRAC_PI_2 / units::factor(self.target, self.unit).unwrap_or(1.0);
            self.checks.push("taken as counted from east, counter-clockwise".to_owned());
        }
        if column.is_pressure() {
            let pa = column.pascals();
            self.offset = if column.min * pa > GAUGE_PA { -SURFACE_PA / pa } else { 0.0 };
            self.checks.push("a pressure, as a depth in sea water; the offset is the air's share".to_owned());
        }
        if column.unit.is_none() && !self.unit.is_empty() {
            let stated = match &column.in_brackets {
                Some(text) => format!("its name states {text:?}, which is no unit of a mapping"),
                None => "its name states no unit".to_owned(),
            };
            self.checks.push(format!("{stated}; {} by its values", self.unit));
        }
        self.checks.extend(column.against_its_name(self.unit));
        if column.is_magnetic() {
            self.checks.push(
                "a magnetic heading: add the declination as its offset; backseat info says what it is there and then"
                    .to_owned(),
            );
        }
        if column.says(&["sog", "gps"]) && self.target == "speed_log_mps" {
            self.checks.push("a speed over ground".to_owned());
        }
        let turned = match (self.target, &frames.body) {
            ("pitch_rad" | "q_radps" | "r_radps" | "dvl_v_mps" | "dvl_w_mps", Some((_, name))) => Some(name),
            _ => None,
        };
        if let Some(name) = turned.filter(|name| **name != column.name) {
            self.checks.push(format!("its sign is that of the axes of {name}"));
        }
        if self.target.starts_with("fin_") {
            self.checks.push("the sign of each fin, by docs/guide/log_format.md".to_owned());
        }
    }

    /// (value + offset) · this is a sample of the vehicle log.
    fn factor(&self) -> f64 {
        self.sign * self.scale * units::factor(self.target, self.unit).unwrap_or(1.0)
    }

    /// Becomes (x + offset) · factor of what another entry gave.
    fn change(&mut self, source: &Self, factor: f64, offset: f64, unit: Option<&'static str>) {
        let first = source.factor();
        self.place = source.place;
        self.offset = source.offset + offset / first;
        let whole = first * factor;
        self.unit = unit.unwrap_or(source.unit);
        self.sign = whole.signum();
        let scale = whole.abs() / units::factor(self.target, self.unit).unwrap_or(1.0);
        self.scale = if (scale - 1.0).abs() < 1e-6 { 1.0 } else { scale };
    }
}

/// Changes entries by the mends that the tests of columns name; what was changed, one sentence each.
pub(super) fn mend(entries: &mut [Entry], found: &Examination) -> Vec<String> {
    let before = entries.to_vec();
    let mut changes = Vec::new();
    for finding in found.suspicions() {
        let Some(lines) = finding.mend.as_ref().and_then(|lines| lines.parse::<toml::Table>().ok()) else { continue };
        let Some(lines) = lines.get("columns").and_then(toml::Value::as_table) else { continue };
        let of = |target: &str| before.iter().find(|entry| entry.target == target);
        let number = |line: &toml::Value, key: &str, otherwise: f64| {
            let value = line.get(key);
            value.and_then(|v| v.as_float().or(v.as_integer().map(|whole| whole as f64))).unwrap_or(otherwise)
        };
        let mut is_changed = false;
        for (target, line) in lines {
            let source = line.get("column").and_then(toml::Value::as_str).and_then(of);
            let (Some(source), Some(entry)) = (source, entries.iter_mut().find(|entry| entry.target == *target)) else {
                continue;
            };
            let unit = line.get("unit").and_then(toml::Value::as_str);
            let of_unit = unit.and_then(|unit| units::factor(target, unit)).unwrap_or(1.0);
            let factor = of_unit * number(line, "sign", 1.0) * number(line, "scale", 1.0);
            // the unit itself, where the draft had none of its own
            let is_plain = units::factor(target, source.unit) == Some(1.0) && source.scale == 1.0;
            let known = super::names::unit_names().map(|(_, known)| known).find(|known| unit == Some(*known));
            entry.change(source, factor, number(line, "offset", 0.0), known.filter(|_| is_plain));
            entry.sure = None;
            entry.checks.push(format!("changed: {}{}", finding.what, evidence(finding)));
            if let Some(other) = finding.alternatives.first() {
                entry.checks.push(format!("or instead, of what the draft had: {}", other.replace('\n', " and ")));
            }
            is_changed = true;
        }
        if is_changed {
            changes.push(finding.what.clone());
        }
    }
    changes
}

/// Marks what a test has shown.
pub(super) fn confirm(entries: &mut [Entry], found: &Examination) {
    let has_fixes = entries.iter().any(|entry| ["gps_x_m", "latitude_deg"].contains(&entry.target));
    let is_turned = |column: Column| OF_BODY.contains(&column);
    for entry in entries.iter_mut().filter(|entry| entry.sure.is_none()) {
        let Some(column) = column_of(entry.target) else { continue };
        let shows = |test: &str, columns: &[Column]| {
            let is_of_course =
                test.starts_with("course") || test.contains("speed") || test.starts_with("range against the way");
            // what is summed up beside the main thing may have either sign; fixes are preferred to a reference velocity
            let is_aside = is_of_course
                && (matches!(column, Column::DvlV | Column::Depth | Column::PropRpm)
                    || (has_fixes && matches!(column, Column::RefNorth | Column::RefEast)));
            // axes that were taken for all together do not show each other's signs
            let is_mutual = entry.sign < 0.0 && is_turned(column) && columns.iter().all(|other| is_turned(*other));
            columns.contains(&column) && !test.ends_with("against the time") && !is_aside && !is_mutual
        };
        // of a fin its sign is shown, not its unit
        let is_whole = !(is_actuator(entry.target) && entry.checks.iter().any(|check| check.contains("no unit")));
        let test = found.holding.iter().find(|(test, columns)| shows(test, columns)).map(|(test, _)| *test);
        entry.sure = test.filter(|_| is_whole).map(|test| format!("{test}: holds"));
    }
}

/// Columns whose signs depend on the axes of the body.
const OF_BODY: [Column; 7] = [Column::Roll, Column::Pitch, Column::P, Column::Q, Column::R, Column::DvlV, Column::DvlW];

/// The column of the vehicle log that an entry fills.
fn column_of(target: &str) -> Option<Column> {
    match target {
        "latitude_deg" => Some(Column::GpsX),
        "longitude_deg" => Some(Column::GpsY),
        name => Column::from_name(name),
    }
}

fn evidence(finding: &Finding) -> String {
    if finding.evidence.is_empty() { String::new() } else { format!(", for {}", finding.evidence) }
}
