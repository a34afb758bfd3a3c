//! Ways in which columns are recorded wrongly, and the lines of a column mapping that mend each.

use super::grid::Grid;
use crate::log::Column;
use crate::log::units::{self, Unit};
use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt::Write as _;

/// What a column becomes: (source + offset) · scale.
#[derive(Clone, Copy, Debug)]
pub struct Edit {
    /// The column that changes.
    pub target: Column,
    source: Column,
    scale: f64,
    offset: f64,
    /// Unit of the source, where that is the scale.
    unit: Option<&'static str>,
}

/// One mistake.
#[derive(Clone, Debug)]
pub struct Mend {
    /// What was wrong, in words.
    pub what: String,
    pub edits: Vec<Edit>,
    /// Columns change places: such a mistake may leave no relation at all.
    pub is_exchange: bool,
    /// Factor of the time, and its unit.
    time: Option<(f64, &'static str)>,
}

impl Edit {
    const fn plain(column: Column) -> Self {
        Self { target: column, source: column, scale: 1.0, offset: 0.0, unit: None }
    }

    /// What this does to what another edit of the same column gave.
    fn after(self, first: Self) -> Self {
        let offset = first.offset + self.offset / first.scale;
        // a sign beside a unit stands for itself; another factor does not
        let unit = first.unit.filter(|_| self.scale.abs() == 1.0);
        Self { source: first.source, scale: first.scale * self.scale, offset, unit, ..self }
    }

    /// As an entry of the mapping.
    fn line(&self) -> String {
        let mut line = format!("columns.{} = {{ column = \"{}\"", self.target.name(), self.source.name());
        if let Some(unit) = self.unit {
            let _ = write!(line, ", unit = \"{unit}\"");
        }
        if self.scale < 0.0 {
            line += ", sign = -1";
        }
        if self.unit.is_none() && self.scale.abs() != 1.0 {
            let _ = write!(line, ", scale = {:.7}", self.scale.abs());
        }
        if self.offset != 0.0 {
            let _ = write!(line, ", offset = {:.7}", self.offset);
        }
        line + " }"
    }
}

impl Mend {
    fn of(what: String, edits: Vec<Edit>) -> Self {
        Self { what, edits, is_exchange: false, time: None }
    }

    /// Another unit of one column.
    pub fn unit(column: Column, unit: &'static str, scale: f64) -> Self {
        Self::units(&[column], unit, scale)
    }

    /// Another unit of several columns.
    pub fn units(columns: &[Column], unit: &'static str, scale: f64) -> Self {
        let mut mend = Self::scaled(columns, &format!("in {unit}"), scale);
        mend.edits.iter_mut().for_each(|edit| edit.unit = Some(unit));
        mend
    }

    /// Another factor of several columns.
    pub fn scaled(columns: &[Column], what: &str, scale: f64) -> Self {
        let names: Vec<&str> = columns.iter().map(|column| column.name()).collect();
        let verb = if names.len() == 1 { "is" } else { "are" };
        let edits = columns.iter().map(|column| Edit { scale, ..Edit::plain(*column) }).collect();
        Self::of(format!("{} {verb} {what}", names.join(", ")), edits)
    }

    /// The same, and the wrong sign.
    fn negated(&self) -> Self {
        let mut mend = self.clone();
        mend.what += ", and has the wrong sign";
        mend.edits.iter_mut().for_each(|edit| edit.scale = -edit.scale);
        mend
    }

    /// The wrong sign of some columns.
    pub fn sign(columns: &[Column]) -> Self {
        let names: Vec<&str> = columns.iter().map(|column| column.name()).collect();
        let verb = if names.len() == 1 { "has" } else { "have" };
        let edits = columns.iter().map(|column| Edit { scale: -1.0, ..Edit::plain(*column) }).collect();
        Self::of(format!("{} {verb} the wrong sign", names.join(" and ")), edits)
    }

    /// An angle that is counted from elsewhere.
    pub fn turned(column: Column, offset: f64) -> Self {
        Self::of(format!("{} is turned", column.name()), vec![Edit { offset, ..Edit::plain(column) }])
    }

    /// The roll or pitch that is counted from elsewhere.
    pub fn turns(&self) -> Option<Column> {
        let is_turn = |edit: &&Edit| edit.target != Column::Heading && edit.offset != 0.0;
        self.edits.iter().find(is_turn).map(|edit| edit.target)
    }

    /// Factor of its first column.
    pub fn scale(&self) -> f64 {
        self.edits.first().map_or(1.0, |edit| edit.scale)
    }

    /// Columns that stand in each other's place, some with the other sign.
    fn exchange(pairs: &[(Column, Column, f64)]) -> Self {
        let names: Vec<&str> = pairs.iter().map(|(target, ..)| target.name()).collect();
        let turned = if pairs.iter().any(|pair| pair.2 < 0.0) { ", and turned" } else { "" };
        let edits = pairs.iter().map(|&(target, source, scale)| Edit { source, scale, ..Edit::plain(target) });
        let what = format!("{} are exchanged{turned}", names.join(" and "));
        Self { is_exchange: true, ..Self::of(what, edits.collect()) }
    }

    /// Another unit of the time.
    pub fn time(unit: &'static str, factor: f64) -> Self {
        Self { time: Some((factor, unit)), ..Self::of(format!("t_s is in {unit}"), Vec::new()) }
    }

    /// The same, of a log as it is before these mends.
    pub fn after(mut self, done: &[Self]) -> Self {
        for edit in &mut self.edits {
            let first = done.iter().rev().flat_map(|mend| &mend.edits).find(|first| first.target == edit.source);
            *edit = first.map_or(*edit, |first| edit.after(*first));
        }
        self
    }

    /// The lines of the mapping, one for each column.
    pub fn lines(&self) -> String {
        match self.time {
            Some((_, unit)) => format!("time = {{ column = \"t_s\", unit = \"{unit}\" }}"),
            None => self.edits.iter().map(Edit::line).collect::<Vec<_>>().join("\n"),
        }
    }

    /// Whether each column of other lines has a line of its own here.
    pub fn replaces(&self, lines: &str) -> bool {
        let has =
            |line: &str| self.edits.iter().any(|edit| line.starts_with(&format!("columns.{} =", edit.target.name())));
        lines.lines().all(has)
    }

    /// Whether these are two mistakes, another unit and the wrong sign.
    pub fn is_double(&self) -> bool {
        self.edits.iter().any(|edit| edit.scale < 0.0 && edit.scale != -1.0)
    }

    /// Whether it is another unit of the time.
    pub fn is_time(&self) -> bool {
        self.time.is_some()
    }

    /// Whether it changes any of these columns.
    pub fn touches(&self, columns: &[Column]) -> bool {
        self.time.is_some() || self.edits.iter().any(|edit| columns.contains(&edit.target))
    }

    /// Whether a log has what it changes.
    pub fn fits(&self, grid: &Grid) -> bool {
        // the axes of a DVL share their unit
        let is_part = matches!(self.edits[..], [Edit { target: Column::DvlU, unit: Some(_), .. }]);
        self.edits.iter().all(|edit| grid.has(edit.source)) && !(is_part && grid.has(Column::DvlV))
    }

    /// The log as it is after the mend.
    pub fn apply(&self, grid: &Grid) -> Grid {
        let mut mended = grid.clone();
        if let Some((factor, _)) = self.time {
            mended.cell_s *= factor;
        }
        for edit in &self.edits {
            if edit.source != edit.target {
                mended.put(edit.target, grid.get(edit.source).map(<[f64]>::to_vec));
            }
            mended.change(edit.target, edit.scale, edit.offset);
        }
        mended
    }
}

const DVL: [Column; 3] = [Column::DvlU, Column::DvlV, Column::DvlW];
const RATES: [Column; 3] = [Column::P, Column::Q, Column::R];
const SHIP: [Column; 4] = [Column::ShipX, Column::ShipY, Column::ShipGpsX, Column::ShipGpsY];
const FINS: [Column; 4] = [Column::FinTop, Column::FinBottom, Column::FinPort, Column::FinStarboard];

/// Every mistake that is looked for, frequent ones first: of two that explain the same, the first is named first.
pub fn all() -> Vec<Mend> {
    let mut mends = Vec::new();
    mends.extend(headings());
    for column in [
        Column::R,
        Column::Q,
        Column::P,
        Column::Pitch,
        Column::Roll,
        Column::Depth,
        Column::DvlU,
        Column::DvlV,
        Column::DvlW,
        Column::SpeedLog,
        Column::PropRpm,
        Column::Rudder,
        Column::RangeRate,
        Column::UsblElevation,
        Column::UsblBearing,
        Column::GpsX,
        Column::GpsY,
        Column::ShipX,
        Column::ShipY,
        Column::ShipGpsX,
        Column::ShipGpsY,
    ] {
        mends.push(Mend::sign(&[column]));
    }
    mends.extend(FINS.map(|fin| Mend::sign(&[fin])));
    mends.push(Mend::sign(&[Column::FinTop, Column::FinBottom]));
    mends.push(Mend::sign(&[Column::FinPort, Column::FinStarboard]));
    mends.push(Mend::sign(&FINS));
    mends.push(Mend::sign(&RATES));
    mends.push(Mend::sign(&[Column::Q, Column::R]));
    mends.push(Mend::sign(&[Column::Roll, Column::P]));
    mends.push(Mend::sign(&[Column::Pitch, Column::Q]));
    // an AHRS that looks astern, and a heading that was turned
    mends.push(Mend::sign(&[Column::Roll, Column::Pitch]));
    mends.push(Mend::sign(&[Column::Roll, Column::Pitch, Column::P, Column::Q]));
    mends.push(Mend::sign(&[Column::Pitch, Column::Q, Column::R]));
    mends.push(Mend::sign(&[Column::Pitch, Column::Q, Column::R, Column::DvlV, Column::DvlW]));
    mends.push(Mend::sign(&[Column::DvlV, Column::DvlW]));
    mends.push(Mend::sign(&DVL));
    mends.push(Mend::sign(&[Column::DvlU, Column::DvlV]));
    mends.push(Mend::sign(&[Column::DvlU, Column::DvlW]));
    mends.push(Mend::sign(&[Column::GpsX, Column::GpsY]));
    mends.push(Mend::sign(&[Column::ShipX, Column::ShipY]));
    mends.push(Mend::sign(&[Column::ShipGpsX, Column::ShipGpsY]));
    mends.push(Mend::sign(&SHIP));
    // mirrored: what turns left is said to turn right
    mends.push(Mend::sign(&[Column::Heading, Column::R]));
    // an inverted sensor, and a pitch from the vertical
    mends.push(Mend::turned(Column::Roll, PI));
    mends.push(Mend::turned(Column::Pitch, -FRAC_PI_2));
    mends.extend(exchanges());
    mends.extend(units());
    mends.extend(
        units::TIME.iter().filter(|(_, factor)| *factor != 1.0).map(|&(unit, factor)| Mend::time(unit, factor)),
    );
    mends
}

fn headings() -> Vec<Mend> {
    let heading = |what: &str, scale: f64, offset: f64| {
        let edit = Edit { scale, offset, ..Edit::plain(Column::Heading) };
        let mend = Mend::of(format!("heading_rad is {what}"), vec![edit]);
        // by a quarter turn north and east change places
        Mend { is_exchange: offset.abs() == FRAC_PI_2, ..mend }
    };
    vec![
        heading("counted counter-clockwise (negated)", -1.0, 0.0),
        heading("counted from east, counter-clockwise", -1.0, -FRAC_PI_2),
        heading("counted from east, clockwise", 1.0, FRAC_PI_2),
        heading("that of the stern (turned by half a turn)", 1.0, PI),
        heading("counted from west, clockwise", 1.0, -FRAC_PI_2),
        heading("counted from south, counter-clockwise", -1.0, -PI),
        heading("counted from west, counter-clockwise", -1.0, FRAC_PI_2),
        heading("converted from degrees twice", 180.0 / PI, 0.0),
        heading("in half turns", PI, 0.0),
        heading("in turns", 2.0 * PI, 0.0),
    ]
}

fn exchanges() -> Vec<Mend> {
    let pair = |a, b| Mend::exchange(&[(a, b, 1.0), (b, a, 1.0)]);
    let quarter = |a, b| [Mend::exchange(&[(a, b, 1.0), (b, a, -1.0)]), Mend::exchange(&[(a, b, -1.0), (b, a, 1.0)])];
    let mut mends = vec![
        pair(Column::GpsX, Column::GpsY),
        pair(Column::P, Column::Q),
        pair(Column::Q, Column::R),
        pair(Column::P, Column::R),
        pair(Column::Roll, Column::Pitch),
        pair(Column::DvlU, Column::DvlV),
        pair(Column::DvlV, Column::DvlW),
        pair(Column::DvlU, Column::DvlW),
        pair(Column::ShipX, Column::ShipY),
        pair(Column::ShipGpsX, Column::ShipGpsY),
        Mend::exchange(&[
            (Column::ShipX, Column::ShipY, 1.0),
            (Column::ShipY, Column::ShipX, 1.0),
            (Column::ShipGpsX, Column::ShipGpsY, 1.0),
            (Column::ShipGpsY, Column::ShipGpsX, 1.0),
        ]),
        Mend::exchange(&[
            (Column::FinTop, Column::FinPort, 1.0),
            (Column::FinBottom, Column::FinStarboard, 1.0),
            (Column::FinPort, Column::FinTop, 1.0),
            (Column::FinStarboard, Column::FinBottom, 1.0),
        ]),
        pair(Column::FinTop, Column::FinBottom),
        pair(Column::FinPort, Column::FinStarboard),
    ];
    mends.push(Mend::exchange(&[
        (Column::GpsX, Column::ShipGpsX, 1.0),
        (Column::GpsY, Column::ShipGpsY, 1.0),
        (Column::ShipGpsX, Column::GpsX, 1.0),
        (Column::ShipGpsY, Column::GpsY, 1.0),
    ]));
    mends.extend(OF_TWO_SENSORS.iter().flat_map(|(a, others)| others.iter().map(|b| pair(*a, *b))));
    for [a, b, c] in [DVL, RATES] {
        mends.push(Mend::exchange(&[(a, b, 1.0), (b, c, 1.0), (c, a, 1.0)]));
        mends.push(Mend::exchange(&[(a, c, 1.0), (b, a, 1.0), (c, b, 1.0)]));
    }
    mends.extend(quarter(Column::ShipX, Column::ShipY));
    mends.extend(quarter(Column::GpsX, Column::GpsY));
    mends.extend(quarter(Column::DvlU, Column::DvlV));
    mends.extend(quarter(Column::Roll, Column::Pitch));
    mends.extend(quarter(Column::P, Column::Q));
    mends
}

/// Columns of two sensors, or of an angle and its rate, that stand beside each other in tables.
const OF_TWO_SENSORS: [(Column, &[Column]); 5] = [
    (Column::Heading, &[Column::R, Column::Pitch, Column::Roll]),
    (Column::Pitch, &[Column::Q]),
    (Column::Roll, &[Column::P]),
    (Column::Depth, &[Column::Pitch, Column::DvlU, Column::SpeedLog]),
    (Column::PropRpm, &FINS),
];

/// Columns that one program writes in one unit, and each that it may write alone.
const WRITTEN: [&[Column]; 23] = [
    &RATES,
    &[Column::P],
    &[Column::Q],
    &[Column::R],
    &[Column::Roll],
    &[Column::Pitch],
    &[Column::Depth],
    &DVL,
    &[Column::DvlU],
    &[Column::DvlV],
    &[Column::DvlW],
    &[Column::SpeedLog],
    &[Column::PropRpm],
    &[Column::GpsX, Column::GpsY],
    &[Column::ShipX, Column::ShipY],
    &[Column::ShipGpsX, Column::ShipGpsY],
    &SHIP,
    &[Column::Range],
    &[Column::RangeRate],
    &[Column::UsblRange],
    &[Column::UsblBearing],
    &[Column::UsblElevation],
    &[Column::UsblBearing, Column::UsblElevation],
];

/// Factors that relations leave open.
const ALIKE: std::ops::Range<f64> = 0.6..1.6;

/// Units that are converted from, twice by mistake.
const TWICE: [&str; 4] = ["deg", "deg/s", "kn", "ft"];

/// Every unit that a mapping takes, once with the right sign and once with the other.
fn units() -> Vec<Mend> {
    let mut mends = Vec::new();
    for columns in WRITTEN {
        // what is nearly the column's own no relation tells; gon and mil are of courses, told by what they wrap at
        let is_told = |(unit, scale): &&Unit| !ALIKE.contains(scale) && !["gon", "mil"].contains(unit);
        let known = units::of(columns[0].name()).filter(is_told);
        let mut last = 1.0;
        for &(unit, scale) in known {
            if scale == last {
                continue; // another name of the same
            }
            last = scale;
            mends.push(Mend::units(columns, unit, scale));
            if TWICE.contains(&unit) {
                mends.push(Mend::scaled(columns, &format!("converted from {unit} twice"), 1.0 / scale));
            }
        }
    }
    let negated: Vec<Mend> = mends.iter().filter(|mend| mend.edits.len() == 1).map(Mend::negated).collect();
    mends.extend(negated);
    // an interrogation goes there and back; 1,500 m/s are the sound's
    for column in [Column::Range, Column::RangeRate, Column::UsblRange] {
        mends.push(Mend::scaled(&[column], "two-way", 0.5));
        mends.push(Mend::scaled(&[column], "half of one-way", 2.0));
    }
    for column in [Column::Range, Column::UsblRange] {
        mends.push(Mend::scaled(&[column], "a travel time in s", 1500.0));
        mends.push(Mend::scaled(&[column], "a travel time in ms", 1.5));
    }
    mends
}
