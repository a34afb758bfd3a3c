//! The columns of a log side by side at even times, so that relations between them can be computed at all.

use crate::log::{Column, Log};
use crate::stats::median;
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// Cells are not shorter than this, s: noise of a sensor averages within one, no manoeuvre hides in one.
const CELL_S: f64 = 0.5;
/// Sampling of a sensor that moves, s. Outside it the unit of the time is doubted, and cells follow the samples.
const SAMPLING_S: [f64; 2] = [0.02, 10.0];
/// Most cells: 28 hours; what comes after them is not looked at.
const MOST_CELLS: usize = 200_000;
/// A gap that is bridged by a straight line, cells.
const BRIDGED: usize = 6;
/// Positions of the ship are bridged for longer, cells: it is slow.
const BRIDGED_SHIP: usize = 60;

/// Columns that are looked at.
const USED: [&[Column]; 4] = [
    Column::group(Column::PropRpm, Column::SpeedLog),
    Column::group(Column::RefNorth, Column::RefDown),
    &[Column::UsblRange, Column::UsblBearing, Column::UsblElevation, Column::UsblOnVehicle],
    &[Column::Rudder, Column::WaterSpeed, Column::Ballast, Column::Run],
];

/// How a column is carried from sample to sample.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Carry {
    /// A command holds until the next.
    Hold,
    /// By a straight line over so many cells.
    Line(usize),
    /// Where there is no sample there is nothing.
    No,
}

fn carry(column: Column) -> Carry {
    match column {
        Column::PropRpm
        | Column::FinTop
        | Column::FinBottom
        | Column::FinPort
        | Column::FinStarboard
        | Column::Rudder
        | Column::Run => Carry::Hold,
        Column::GpsX | Column::GpsY | Column::Range | Column::RangeRate => Carry::No,
        Column::ShipX | Column::ShipY | Column::Tol | Column::Toa => Carry::No,
        Column::UsblRange | Column::UsblBearing | Column::UsblElevation | Column::UsblOnVehicle => Carry::No,
        Column::ShipGpsX | Column::ShipGpsY => Carry::Line(BRIDGED_SHIP),
        _ => Carry::Line(BRIDGED),
    }
}

/// A log at even times; NaN where a column has nothing.
#[derive(Clone)]
pub struct Grid {
    /// Time of the first row of the log, s.
    pub start_s: f64,
    /// Length of a cell by the log, s.
    pub cell_s: f64,
    /// Length by which windows are counted in cells, s: the same, unless the unit of the time is doubted.
    pace_s: f64,
    /// Number of cells.
    pub len: usize,
    /// The propeller's speed is that of the motor, before a gear that is not known.
    pub is_motor_rpm: bool,
    columns: Vec<Option<Vec<f64>>>,
}

/// Columns of a speed along the vehicle, in the order in which they are preferred.
pub const SPEEDS: &[Column] = &[Column::DvlU, Column::WaterSpeed, Column::SpeedLog];

impl Grid {
    /// Of a log, its heading in a unit of so many rad, without the columns that are doubted already; `None` if nothing is
    /// left to compare.
    pub fn of(log: &Log, heading_rad: f64, is_doubted: impl Fn(Column) -> bool) -> Option<Self> {
        let first_us = log.rows.first()?.time_us;
        let (cell_s, pace_s) = cell_s(log);
        let cell_us = cell_s * 1e6;
        let len = ((log.rows.last()?.time_us - first_us) as f64 / cell_us) as usize + 1;
        let len = len.min(MOST_CELLS);
        let mut columns = vec![None; Column::COUNT];
        for &column in USED.into_iter().flatten().filter(|column| !is_doubted(**column)) {
            let (mut values, mut counts) = (vec![0.0; len], vec![0_u32; len]);
            let mut before: Option<f64> = None;
            for (time_us, value) in log.column(column) {
                let cell = ((time_us - first_us) as f64 / cell_us) as usize;
                if cell >= len {
                    break;
                }
                let value = match column {
                    Column::Heading => unwound(before, value * heading_rad),
                    _ => value,
                };
                before = Some(value);
                values[cell] += value;
                counts[cell] += 1;
            }
            if before.is_none() {
                continue;
            }
            for (value, count) in values.iter_mut().zip(counts) {
                *value = if count == 0 { f64::NAN } else { *value / f64::from(count) };
            }
            match carry(column) {
                Carry::Hold => hold(&mut values),
                Carry::Line(cells) => bridge(&mut values, cells),
                Carry::No => {}
            }
            columns[column as usize] = Some(values);
        }
        Some(Self { start_s: first_us as f64 * 1e-6, cell_s, pace_s, len, is_motor_rpm: log.is_motor_rpm, columns })
    }

    /// Some of its cells.
    pub fn part(&self, cells: Range<usize>) -> Self {
        let of = |values: &Vec<f64>| values[cells.clone()].to_vec();
        let columns = self.columns.iter().map(|values| values.as_ref().map(of)).collect();
        Self { len: cells.len(), columns, ..*self }
    }

    /// A column; `None` where the log has none.
    pub fn get(&self, column: Column) -> Option<&[f64]> {
        self.columns[column as usize].as_deref()
    }

    /// All of some columns.
    pub fn all<const N: usize>(&self, wanted: [Column; N]) -> Option<[&[f64]; N]> {
        let mut found: [&[f64]; N] = [&[]; N];
        for (place, column) in found.iter_mut().zip(wanted) {
            *place = self.get(column)?;
        }
        Some(found)
    }

    /// The speed that the log has, that of the DVL before others.
    pub fn speed(&self) -> Option<(Column, &[f64])> {
        SPEEDS.iter().find_map(|column| Some((*column, self.get(*column)?)))
    }

    /// Whether the log has a column.
    pub fn has(&self, column: Column) -> bool {
        self.get(column).is_some()
    }

    /// (x + offset) · scale of a column.
    pub fn change(&mut self, column: Column, scale: f64, offset: f64) {
        let Some(values) = &mut self.columns[column as usize] else { return };
        let mut before = None;
        for value in values.iter_mut().filter(|value| !value.is_nan()) {
            *value = (*value + offset) * scale;
            if column == Column::Heading {
                *value = unwound(before, *value);
                before = Some(*value);
            }
        }
    }

    /// Puts one column in the place of another.
    pub fn put(&mut self, column: Column, values: Option<Vec<f64>>) {
        self.columns[column as usize] = values;
    }

    /// Cells of so many seconds, at least `least`.
    pub fn cells(&self, seconds: f64, least: usize) -> usize {
        ((seconds / self.pace_s).round() as usize).max(least)
    }
}

/// The cell that suits the sampling of what moves, and what it is taken for, s.
fn cell_s(log: &Log) -> (f64, f64) {
    let moving = [Column::Heading, Column::Pitch, Column::Depth, Column::DvlU, Column::SpeedLog];
    let interval = |column| {
        let times: Vec<u64> = log.column(column).map(|(time_us, _)| time_us).collect();
        let steps: Vec<f64> = times.windows(2).map(|pair| (pair[1] - pair[0]) as f64 * 1e-6).collect();
        median(&steps).filter(|step| *step > 0.0 && steps.len() > 20)
    };
    match moving.into_iter().filter_map(interval).min_by(f64::total_cmp) {
        Some(step) if !(SAMPLING_S[0]..=SAMPLING_S[1]).contains(&step) => (2.0 * step, CELL_S),
        Some(step) => (step.max(CELL_S), step.max(CELL_S)),
        None => (CELL_S, CELL_S),
    }
}

/// The angle of the same direction that is nearest to the one before.
fn unwound(before: Option<f64>, angle: f64) -> f64 {
    before.map_or(angle, |before| before + (angle - before + PI).rem_euclid(TAU) - PI)
}

fn hold(values: &mut [f64]) {
    let mut last = f64::NAN;
    for value in values {
        if value.is_nan() {
            *value = last;
        }
        last = *value;
    }
}

fn bridge(values: &mut [f64], most: usize) {
    let mut last: Option<usize> = None;
    for place in 0..values.len() {
        if values[place].is_nan() {
            continue;
        }
        if let Some(before) = last.filter(|before| place - before > 1 && place - before <= most) {
            let (from, step) = (values[before], (values[place] - values[before]) / (place - before) as f64);
            for between in before + 1..place {
                values[between] = from + step * (between - before) as f64;
            }
        }
        last = Some(place);
    }
}
