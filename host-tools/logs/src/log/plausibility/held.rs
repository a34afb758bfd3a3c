//! Readings that stand still where the vehicle moves, and readings in no order.

use super::recording::Mend;
use super::{ColumnSummary, Finding, Severity};
use crate::log::{Column, Log, units};
use crate::stats::percentile;
use std::f64::consts::TAU;

/// Fewest samples that say something about how a sensor behaves.
const ENOUGH: usize = 100;
/// Pitch changes by more than this only in dives, rad: waves at the surface and trim are below.
const PITCH_OF_DIVES_RAD: f64 = 0.2;
/// Of sensors that never stand still.
const RESTLESS: [Column; 8] =
    [Column::Roll, Column::Pitch, Column::Heading, Column::P, Column::Q, Column::R, Column::DvlU, Column::DvlV];
/// One reading for so long, s, with so many samples, is a sensor that froze.
const FROZEN: (f64, usize) = (60.0, 30);
/// Steps of a sensor so coarse, rad or m/s, that it may stand still on a straight line.
const COARSE: f64 = 0.01;
/// Fixes at so many samples in one place are held; the vehicle moves faster than this, m/s.
const HELD_FIXES: usize = 8;
const MOVING_MPS: f64 = 0.3;
/// Water over the antenna through which no receiver has a fix, m: beyond waves and the depth of the hull.
const SUBMERGED_M: f64 = 3.0;
/// So many fixes within so little depth, m, are all at the surface, or of an acoustic positioning system.
const FEW_FIXES: usize = 5;
const ONE_DEPTH_M: f64 = 1.5;
/// A vehicle that is slower than this, m/s, within so many metres for so long, s, lies still: its fixes scatter by less.
const AT_REST_MPS: f64 = 0.1;
const AT_REST_M: f64 = 5.0;
const AT_REST_S: f64 = 10.0;
/// Samples further apart need not be alike, s.
const NEAR_S: f64 = 5.0;
/// Mean square of steps over variance: 2 in random order (von Neumann 1941), far below 1 of anything that moves.
const RANDOM: f64 = 1.3;

pub(super) fn check(log: &Log, columns: &[ColumnSummary]) -> Vec<Finding> {
    let mut findings: Vec<Finding> = columns.iter().filter_map(|summary| stillness(columns, summary)).collect();
    findings.extend(frozen_depth(columns));
    findings.extend(RESTLESS.into_iter().filter_map(|column| frozen(log, columns, column)));
    findings.extend(fixes(log));
    findings.extend(at_rest(log, columns));
    findings.extend(order(log, columns));
    findings
}

/// Readings that are held on, and sensors that give one value.
fn stillness(columns: &[ColumnSummary], summary: &ColumnSummary) -> Option<Finding> {
    if summary.samples < ENOUGH || !RESTLESS.contains(&summary.column) {
        return None;
    }
    let name = summary.column.name();
    if summary.min == summary.max {
        let message = format!("{name} is {} in all {} samples: is the sensor connected?", summary.min, summary.samples);
        let others_move = columns.iter().any(|other| RESTLESS.contains(&other.column) && other.min < other.max);
        // zero is what stands in a column that nothing fills
        return Some(if summary.min != 0.0 && others_move {
            Finding::suspicious(summary.column, message)
        } else {
            Finding::remark(summary.column, message)
        });
    }
    (summary.repeated > 0.6).then(|| {
        let message = format!(
            "{name} repeats the value before in {:.0} % of its samples: a slow sensor held on in a faster table? Leave \
             the held cells empty, or they count as measurements",
            100.0 * summary.repeated
        );
        Finding::remark(summary.column, message)
    })
}

/// A depth that is one number to the last digit: below the surface no sensor gives that, and at zero not in a dive.
fn frozen_depth(columns: &[ColumnSummary]) -> Option<Finding> {
    let of = |column| columns.iter().find(|summary| summary.column == column);
    let depth = of(Column::Depth).filter(|depth| depth.samples >= ENOUGH && depth.min == depth.max)?;
    let [low, high] = of(Column::Pitch).map_or([0.0; 2], |pitch| pitch.percentile_1_99);
    let is_diving = high - low > PITCH_OF_DIVES_RAD;
    (is_diving || depth.min != 0.0).then(|| {
        let so = if is_diving { format!(" while pitch_rad goes from {low:.2} to {high:.2}") } else { String::new() };
        let message = format!("depth_m is {} in all {} samples{so}: is the sensor frozen?", depth.min, depth.samples);
        Finding::suspicious(Column::Depth, message)
    })
}

/// One reading for a long time in a column that otherwise changes, while others go on changing.
fn frozen(log: &Log, columns: &[ColumnSummary], column: Column) -> Option<Finding> {
    let summary = columns.iter().find(|summary| summary.column == column)?;
    if summary.min == summary.max || summary.repeated > 0.95 {
        return None; // said already
    }
    let mut run = (0_u64, 0_usize, f64::NAN);
    let mut longest = (0_u64, 0_u64, 0_usize, 0.0_f64);
    let mut step = f64::INFINITY;
    for (time_us, value) in log.column(column) {
        if value == run.2 {
            run.1 += 1;
            if time_us - run.0 > longest.1 - longest.0 {
                longest = (run.0, time_us, run.1, value);
            }
        } else {
            if (value - run.2).abs() < step {
                step = (value - run.2).abs();
            }
            run = (time_us, 1, value);
        }
    }
    let (from_us, to_us, samples, value) = longest;
    let seconds = (to_us - from_us) as f64 * 1e-6;
    if seconds < FROZEN.0 || samples < FROZEN.1 || step > COARSE || value == 0.0 {
        return None;
    }
    let other = RESTLESS.into_iter().filter(|other| *other != column).find(|other| {
        let inside: Vec<f64> =
            log.column(*other).filter(|(us, _)| (from_us..=to_us).contains(us)).map(|(_, value)| value).collect();
        inside.windows(2).filter(|pair| pair[0] != pair[1]).count() * 2 > inside.len().max(FROZEN.1)
    })?;
    let message = format!(
        "{} is {value} for {seconds:.0} s from {:.0} s on ({samples} samples) while {} changes: was the sensor frozen?",
        column.name(),
        from_us as f64 * 1e-6,
        other.name()
    );
    Some(Finding::suspicious(column, message))
}

/// Fixes that are repeated on the way, or that come from under water.
fn fixes(log: &Log) -> Option<Finding> {
    let (mut speed, mut depth): (f64, f64) = (0.0, 0.0);
    let (mut before, mut same) = (None, 0_usize);
    let (mut all, mut held, mut deep) = (0_usize, 0_usize, 0_usize);
    let mut depths = Vec::new();
    for row in &log.rows {
        let logged = [Column::DvlU, Column::WaterSpeed, Column::SpeedLog].into_iter().find_map(|c| row.get(c));
        speed = logged.map_or(speed, f64::abs);
        depth = row.get(Column::Depth).unwrap_or(depth);
        let Some(fix) = row.gnss_m() else { continue };
        all += 1;
        depths.push(depth);
        same = if before == Some(fix) { same + 1 } else { 0 };
        before = Some(fix);
        held += usize::from(same >= HELD_FIXES && (speed > MOVING_MPS || depth > SUBMERGED_M));
        deep += usize::from(depth > SUBMERGED_M);
    }
    if held > 2 * HELD_FIXES && held * 20 > all {
        let message = format!(
            "gps_x_m, gps_y_m stand still in {held} of {all} fixes while the vehicle moves or is under water: the last fix \
             was held on. Leave these cells empty, or they count as measurements"
        );
        return Some(Finding::suspicious(Column::GpsX, message));
    }
    let [low, high] = [0.1, 0.9].map(|part| percentile(&depths, part).unwrap_or(0.0));
    if low.abs().min(high.abs()) > SUBMERGED_M && high - low < ONE_DEPTH_M && all >= FEW_FIXES {
        let message = format!(
            "depth_m is {:.2} at the fixes (median of {all}), where the antenna is above the water: is it not zeroed at the \
             surface, or of an absolute pressure, or are the fixes acoustic?",
            percentile(&depths, 0.5)?
        );
        return Some(Finding::remark(Column::Depth, message));
    }
    if deep > 2 * HELD_FIXES && deep * 20 > all {
        let message = format!(
            "gps_x_m, gps_y_m have {deep} of {all} fixes at more than {SUBMERGED_M} m of depth, where no receiver has one: \
             are they reckoned, or is depth_m wrong?"
        );
        return Some(Finding::remark(Column::GpsX, message)); // of an acoustic positioning system, maybe
    }
    None
}

/// A vehicle that lies still: nothing can be told of how it moves.
fn at_rest(log: &Log, columns: &[ColumnSummary]) -> Option<Finding> {
    let of = |column: &Column| columns.iter().find(|summary| summary.column == *column);
    let speeds: Vec<_> =
        [Column::DvlU, Column::DvlV, Column::SpeedLog, Column::WaterSpeed].iter().filter_map(of).collect();
    let places: Vec<_> = [Column::GpsX, Column::GpsY, Column::Depth].iter().filter_map(of).collect();
    let is_slow = |summary: &&ColumnSummary| summary.percentile_1_99.iter().all(|speed| speed.abs() < AT_REST_MPS);
    let is_in_place = |summary: &&ColumnSummary| summary.percentile_1_99[1] - summary.percentile_1_99[0] < AT_REST_M;
    let is_known = !speeds.is_empty() && of(&Column::GpsX).is_some() && log.duration_s() > AT_REST_S;
    (is_known && speeds.iter().all(is_slow) && places.iter().all(is_in_place)).then(|| {
        let message = "the vehicle does not move in this log: of speed, course and steering it says nothing";
        Finding::new(Severity::Remark, None, message)
    })
}

/// Columns whose samples follow each other as if drawn by lot.
fn order(log: &Log, columns: &[ColumnSummary]) -> Vec<Finding> {
    /// Columns with the spread from which on motion, not noise, makes it.
    const SPREAD: [(Column, f64); 7] = [
        (Column::Heading, 0.3),
        (Column::Depth, 1.0),
        (Column::Pitch, 0.12),
        (Column::GpsX, 30.0),
        (Column::GpsY, 30.0),
        (Column::ShipGpsX, 30.0),
        (Column::ShipGpsY, 30.0),
    ];
    let mut findings = Vec::new();
    for (column, spread) in SPREAD {
        // degrees, or what else: steps of radians are not steps of it
        let is_angle = column == Column::Heading || column == Column::Pitch;
        let is_other = |summary: &ColumnSummary| summary.column == column && is_angle && summary.max > TAU;
        if columns.iter().any(is_other) {
            continue;
        }
        let samples: Vec<(u64, f64)> = log.column(column).collect();
        let near: Vec<(f64, f64)> = samples
            .windows(2)
            .filter(|pair| pair[1].0 > pair[0].0 && (pair[1].0 - pair[0].0) as f64 * 1e-6 < NEAR_S)
            .map(|pair| (pair[0].1, pair[1].1))
            .collect();
        if near.len() < ENOUGH {
            continue;
        }
        let n = near.len() as f64;
        let (steps, variance) = if column == Column::Heading {
            let steps = near.iter().map(|(a, b)| 2.0 - 2.0 * (b - a).cos()).sum::<f64>() / n;
            let (cos, sin) = near.iter().fold((0.0, 0.0), |(cos, sin), (a, _)| (cos + a.cos(), sin + a.sin()));
            (steps, 1.0 - (cos * cos + sin * sin) / (n * n))
        } else {
            let mean = near.iter().map(|(a, _)| a).sum::<f64>() / n;
            let steps = near.iter().map(|(a, b)| (b - a) * (b - a)).sum::<f64>() / n;
            (steps, near.iter().map(|(a, _)| (a - mean) * (a - mean)).sum::<f64>() / n)
        };
        if variance.sqrt() > spread && steps > RANDOM * variance {
            let message = format!(
                "{} follows itself in random order: the mean square of its steps is {:.2} times its variance (2 of numbers \
                 drawn by lot, near 0 of what moves), over {} samples",
                column.name(),
                steps / variance,
                near.len()
            );
            findings.push(noise_of_another_unit(column, variance.sqrt(), spread, Finding::suspicious(column, message)));
        }
    }
    findings
}

/// A depth in no order is either none, or a sensor's noise at one depth in a unit that makes it large.
fn noise_of_another_unit(column: Column, deviation: f64, spread: f64, finding: Finding) -> Finding {
    if column != Column::Depth {
        return finding;
    }
    let small = units::of(column.name()).filter(|(_, metres)| deviation * metres < spread);
    let (names, mends): (Vec<&str>, Vec<String>) =
        small.map(|(unit, metres)| (*unit, Mend::unit(column, unit, *metres).lines())).unzip();
    if names.is_empty() {
        return finding;
    }
    let message = format!("{}; or it is the noise at one depth in {}", finding.message, names.join(", "));
    Finding { message, alternatives: mends, ..finding }
}
