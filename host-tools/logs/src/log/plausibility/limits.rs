//! Values that no vehicle has: wrong units, marks of no reading, times that cannot be.

use super::angles::{self, FASTEST_TURN_RADPS};
use super::recording::Mend;
use super::{ColumnSummary, Finding, Severity};
use crate::log::units::{self, RAD_PER_DEG as DEG, Unit};
use crate::log::{Column, Log};
use crate::stats::percentile;
use backseat_core::navigation::LONGEST_HOLD_S;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Values of some columns that are plausible, in their units.
struct Limit {
    columns: &'static [Column],
    low: f64,
    high: f64,
    /// What values outside could be.
    guess: &'static str,
    /// A size that is usual, where it tells the unit; else zero.
    usual: f64,
}

/// Wide: beyond every AUV, ship and glider that this project knows.
const LIMITS: &[Limit] = &[
    limit(&[Column::Roll], -PI, PI, "is it in degrees?").usually(0.3),
    limit(&[Column::Pitch], -FRAC_PI_2, FRAC_PI_2, "is it in degrees?").usually(0.3),
    limit(&[Column::P, Column::Q, Column::R], -2.0, 2.0, "is it in degrees per second?").usually(0.2),
    limit(
        &[Column::FinTop, Column::FinBottom, Column::FinPort, Column::FinStarboard],
        -FRAC_PI_2,
        FRAC_PI_2,
        "is it in degrees, or in servo counts?",
    )
    .usually(0.2),
    limit(&[Column::Depth], -3.0, 11_000.0, "depth is positive down, in metres: wrong sign, or another unit?"),
    limit(
        &[Column::DvlU, Column::DvlV, Column::DvlW, Column::SpeedLog, Column::WaterSpeed],
        -12.0,
        12.0,
        "is it in cm/s or mm/s, or the instrument's mark of no reading?",
    )
    .usually(1.5),
    limit(&[Column::PropRpm], -6000.0, 6000.0, "is it in rad/s, in degrees per second or in per mille?"),
    limit(&[Column::Range, Column::TwoWayRange, Column::UplinkRange], 0.0, 30_000.0, "is it in mm, or a travel time?"),
    limit(&[Column::UsblElevation], -FRAC_PI_2, FRAC_PI_2, "is it in degrees?").usually(0.5),
    limit(&[Column::UsblBearing], -TAU, TAU, "is it in degrees?").usually(2.0),
    limit(&[Column::UsblRange], 0.0, 30_000.0, "is it in mm, or a travel time?"),
    limit(&[Column::RangeRate], -20.0, 20.0, "is it in cm/s or mm/s?").usually(1.5),
    limit(
        &[Column::GpsX, Column::GpsY, Column::ShipGpsX, Column::ShipGpsY, Column::ShipX, Column::ShipY],
        -200_000.0,
        200_000.0,
        "positions are metres from a local origin: is it a UTM coordinate, or in mm?",
    ),
    limit(&[Column::SoundSpeed], 1350.0, 1650.0, "the speed of sound in water is 1400 to 1600 m/s"),
    limit(&[Column::WaterDensity], 950.0, 1100.0, "water has 995 to 1040 kg/m^3: is it in g/cm^3, or above 1000?"),
];

/// Steps between samples in which noise of an angle is no motion, µs.
const SLOW_STEP_US: (u64, u64) = (50_000, 2_000_000);
/// Values so many times as large or as small as usual are not of that unit.
const UNUSUAL: f64 = 15.0;
/// Median time between samples of a moving sensor from which on the unit of the time is doubted, s.
const SLOWEST_SENSOR_S: f64 = 30.0;
const FASTEST_SENSOR_S: f64 = 2.0e-4;
/// 0.4 s in days, 0.02 s in hours: of shorter intervals days are likelier.
const FASTEST_IN_DAYS_S: f64 = 5.0e-6;
/// The filter refuses longer gaps, s.
const LONGEST_GAP_S: f64 = 600.0;
/// Columns of sensors that are read all the time.
const MOVING: [Column; 5] = [Column::Depth, Column::Heading, Column::DvlU, Column::SpeedLog, Column::PropRpm];

/// Medians of so many samples on either side of a step, which is not longer than this, s, differ by more than this, m, and
/// by more than the fastest dive makes, m/s; those of more samples differ as well.
const LEAP_SAMPLES: (usize, usize) = (5, 25);
const LONGEST_LEAP_S: f64 = 2.0;
const LEAP_M: f64 = 1.5;
const FASTEST_DIVE_MPS: f64 = 2.0;

const fn limit(columns: &'static [Column], low: f64, high: f64, guess: &'static str) -> Limit {
    Limit { columns, low, high, guess, usual: 0.0 }
}

impl Limit {
    const fn usually(mut self, size: f64) -> Self {
        self.usual = size;
        self
    }

    /// The units that bring the values within the limits, the one first in which they are most usual.
    fn units(&self, log: &Log, summary: &ColumnSummary) -> Vec<Mend> {
        let extremes = summary.percentile_1_99;
        let size = extremes[0].abs().max(extremes[1].abs());
        let unusual = |scale: f64| (size * scale / self.usual).ln().abs();
        // gon and mil are of courses alone
        let is_possible = |(unit, scale): &&Unit| {
            extremes.iter().all(|value| (self.low..=self.high).contains(&(value * scale)))
                && unusual(*scale) < UNUSUAL.ln()
                && !["gon", "mil"].contains(unit)
        };
        let mut units: Vec<&Unit> = units::of(summary.column.name()).filter(is_possible).collect();
        units.sort_by(|a, b| unusual(a.1).total_cmp(&unusual(b.1)));
        // fins are written by one program
        let columns = if FINS.contains(&summary.column) { &FINS[..] } else { std::slice::from_ref(&summary.column) };
        let columns: Vec<Column> = columns.iter().copied().filter(|column| log.has(*column)).collect();
        units.iter().map(|(unit, scale)| Mend::units(&columns, unit, *scale)).collect()
    }
}

const FINS: [Column; 4] = [Column::FinTop, Column::FinBottom, Column::FinPort, Column::FinStarboard];

pub(super) fn check(log: &Log, columns: &[ColumnSummary]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for summary in columns {
        findings.extend(range(log, summary));
    }
    // one line for all fins
    let mut is_said = false;
    findings.retain(|finding| {
        let is_of_fins = finding.mend.is_some() && finding.column.is_some_and(|column| FINS.contains(&column));
        !is_of_fins || !std::mem::replace(&mut is_said, true)
    });
    findings.extend(angles::check(log, columns));
    // what is counted from elsewhere is beyond a limit for that
    let is_turned = |finding: &Finding| finding.mend.as_ref().is_some_and(|lines| lines.contains("offset"));
    let turned: Vec<Column> = findings.iter().filter(|f| is_turned(f)).filter_map(|f| f.column).collect();
    findings.retain(|f| is_turned(f) || f.column.is_none_or(|column| !turned.contains(&column)));
    for column in [Column::Roll, Column::Pitch] {
        let is_told = findings.iter().any(|f: &Finding| f.column == Some(column) && f.severity == Severity::Suspicious);
        findings.extend(jumps(log, column).filter(|_| !is_told));
    }
    findings.extend(leap(log));
    findings.extend(groups(log));
    findings
}

/// What is plausible of a column; `None` where nobody knows.
pub(super) fn of(log: &Log, column: Column) -> Option<[f64; 2]> {
    // Before its gear a motor turns faster than any propeller.
    if log.is_motor_rpm && column == Column::PropRpm {
        return None;
    }
    LIMITS.iter().find(|limit| limit.columns.contains(&column)).map(|limit| [limit.low, limit.high])
}

/// Values outside what is plausible: some are outliers, one in a hundred is another unit.
fn range(log: &Log, summary: &ColumnSummary) -> Option<Finding> {
    of(log, summary.column)?;
    let limit = LIMITS.iter().find(|limit| limit.columns.contains(&summary.column))?;
    let is_outside = |value: f64| !(limit.low..=limit.high).contains(&value);
    if !is_outside(summary.min) && !is_outside(summary.max) {
        return None;
    }
    let extreme = if is_outside(summary.max) { summary.max } else { summary.min };
    let outside = log.column(summary.column).filter(|(_, value)| is_outside(*value)).count();
    let name = summary.column.name();
    let message = format!("{name} reaches {extreme:.4} ({outside} of {} samples): {}", summary.samples, limit.guess);
    if !summary.percentile_1_99.into_iter().any(is_outside) && outside < summary.samples {
        return Some(Finding::remark(summary.column, message));
    }
    let finding = Finding::suspicious(summary.column, message);
    let is_upside_down = summary.column == Column::Depth && summary.percentile_1_99[1] <= limit.low.abs();
    let mends = if is_upside_down { vec![Mend::sign(&[Column::Depth])] } else { limit.units(log, summary) };
    let Some((first, others)) = mends.split_first() else { return Some(finding) };
    let alternatives = others.iter().map(Mend::lines).collect();
    Some(Finding { alternatives, ..finding.mended_by(first.lines()) })
}

/// A roll or pitch that is small in degrees stays below its limit, and leaps by radians from sample to sample.
fn jumps(log: &Log, column: Column) -> Option<Finding> {
    let samples: Vec<(u64, f64)> = log.column(column).collect();
    let rates: Vec<f64> = samples
        .windows(2)
        .filter(|pair| (SLOW_STEP_US.0..SLOW_STEP_US.1).contains(&(pair[1].0 - pair[0].0)))
        .map(|pair| (pair[1].1 - pair[0].1).abs() / ((pair[1].0 - pair[0].0) as f64 * 1e-6))
        .collect();
    let typical = percentile(&rates, 0.8).filter(|rate| rates.len() > 100 && *rate > FASTEST_TURN_RADPS)?;
    let message =
        format!("{} changes by {typical:.1} a second in a fifth of its steps: is it in degrees?", column.name());
    Some(Finding::suspicious(column, message).mended_by(Mend::unit(column, "deg", DEG).lines()))
}

/// A depth that is another from one sample to the next, and stays there.
fn leap(log: &Log) -> Option<Finding> {
    let samples: Vec<(u64, f64)> = log.column(Column::Depth).collect();
    let median = |range: &[(u64, f64)]| percentile(&range.iter().map(|sample| sample.1).collect::<Vec<_>>(), 0.5);
    let (near, far) = LEAP_SAMPLES;
    (far..samples.len().saturating_sub(far)).find_map(|at| {
        let [(before_us, before_m), (at_us, at_m)] = [samples[at - 1], samples[at]];
        let step_s = (at_us - before_us) as f64 * 1e-6;
        if step_s > LONGEST_LEAP_S || (at_m - before_m).abs() < LEAP_M {
            return None;
        }
        let leap_m = |count: usize| Some(median(&samples[at..at + count])? - median(&samples[at - count..at])?);
        let span_s = (samples[at + near / 2].0 - samples[at - near / 2 - 1].0) as f64 * 1e-6;
        let leaps = leap_m(near)?.abs() > LEAP_M + FASTEST_DIVE_MPS * span_s;
        // outliers may crowd, but not for long
        let stays = leap_m(far)? / leap_m(near)? > 0.5;
        (leaps && stays).then(|| {
            let message = format!(
                "depth_m leaps by {:.1} m at {:.0} s, within {step_s:.1} s, and stays there: its unit or its zero was \
                 changed, or two logs were joined",
                at_m - before_m,
                at_us as f64 * 1e-6
            );
            Finding::suspicious(Column::Depth, message)
        })
    })
}

/// The unit of the time, and gaps.
pub(super) fn time(log: &Log, columns: &[ColumnSummary]) -> Vec<Finding> {
    let of_moving = |summary: &&ColumnSummary| MOVING.contains(&summary.column) && summary.samples > 20;
    if log.duration_s() == 0.0 && columns.iter().any(|summary| of_moving(&summary)) {
        let message = format!("t_s is the same in all {} rows: the log has no time", log.rows.len());
        return vec![Finding::new(Severity::Suspicious, None, message)];
    }
    let mut findings = Vec::new();
    let fastest = columns
        .iter()
        .filter(of_moving)
        .filter(|summary| summary.interval_s > 0.0)
        .min_by(|a, b| a.interval_s.total_cmp(&b.interval_s));
    if let Some(fastest) = fastest {
        let name = fastest.column.name();
        let guess = match fastest.interval_s {
            s if s > 2.0e7 => Some(("is the time in nanoseconds?", "ns", 1e-9)),
            s if s > 2.0e4 => Some(("is the time in microseconds?", "us", 1e-6)),
            s if s > SLOWEST_SENSOR_S => Some(("is the time in milliseconds?", "ms", 1e-3)),
            s if s < FASTEST_IN_DAYS_S => Some(("is the time in days, or in hours?", "d", 86_400.0)),
            s if s < FASTEST_SENSOR_S => Some(("is the time in hours, in minutes or in days?", "h", 3600.0)),
            _ => None,
        };
        if let Some((guess, unit, factor)) = guess {
            let message = format!("t_s: {:.3} s between samples of {name}: {guess}", fastest.interval_s);
            let finding = Finding::new(Severity::Suspicious, None, message);
            return vec![finding.mended_by(Mend::time(unit, factor).lines())];
        }
    }
    for summary in columns.iter().filter(of_moving) {
        let (gap_s, from_s) = summary.longest_gap_s;
        if gap_s > LONGEST_GAP_S {
            let name = summary.column.name();
            let message =
                format!("{name} has a gap of {gap_s:.0} s from {from_s:.0} s on: the filter stops at gaps over 600 s");
            findings.push(Finding::remark(summary.column, message));
        }
    }
    findings.extend(silence(log));
    findings
}

/// The longest time without any row, where rows are usually close.
fn silence(log: &Log) -> Option<Finding> {
    if !log.runs.is_empty() {
        return None; // between runs nobody expects any
    }
    let intervals: Vec<f64> =
        log.rows.windows(2).map(|pair| (pair[1].time_us - pair[0].time_us) as f64 * 1e-6).collect();
    let (at, longest_s) = intervals.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let median_s = percentile(&intervals, 0.5)?;
    if longest_s <= LONGEST_HOLD_S || median_s > LONGEST_HOLD_S {
        return None;
    }
    let from_s = log.rows[at].time_us as f64 * 1e-6;
    let message = format!(
        "no row for {longest_s:.0} s from {from_s:.0} s on: what the vehicle did then is unknown; its track finds it again by \
         fixes and ranges, its diagnosis begins anew at the next fix and judges no position"
    );
    Some(Finding::new(Severity::Remark, None, message))
}

/// Columns that are of use only together in one row.
fn groups(log: &Log) -> Vec<Finding> {
    const GROUPS: [&[Column]; 6] = [
        &[Column::Roll, Column::Pitch, Column::Heading],
        &[Column::P, Column::Q, Column::R],
        &[Column::DvlU, Column::DvlV, Column::DvlW],
        &[Column::GpsX, Column::GpsY],
        &[Column::ShipGpsX, Column::ShipGpsY],
        &[Column::PropRpm, Column::FinTop, Column::FinBottom, Column::FinPort, Column::FinStarboard],
    ];
    let mut findings = Vec::new();
    for group in GROUPS {
        let is_whole = log.rows.iter().any(|row| group.iter().all(|column| row.get(*column).is_some()));
        let has_all = group.iter().all(|column| log.has(*column));
        if is_whole || !has_all {
            continue;
        }
        let names: Vec<&str> = group.iter().map(|column| column.name()).collect();
        let message = format!("{}: no row has all of them, and the filter uses them only together", names.join(", "));
        findings.push(Finding::suspicious(group[0], message));
    }
    findings
}
