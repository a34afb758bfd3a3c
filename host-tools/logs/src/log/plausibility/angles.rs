//! Angles that are in another unit, or counted from elsewhere: headings by what they wrap at, roll and pitch by where they
//! rest.

use super::recording::Mend;
use super::{ColumnSummary, Finding};
use crate::log::units::{self, RAD_PER_DEG, Unit};
use crate::log::{Column, Log};
use crate::stats::{mean, percentile};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A fast vehicle turns at 1 rad/s; a heading in degrees seems to turn faster.
pub(super) const FASTEST_TURN_RADPS: f64 = 2.0;
/// A turn, rad, as digits round it: 6.2832 is none in degrees.
const ROUNDED_TURN: f64 = 1.001 * TAU;
/// Longest time between samples of which one wraps, µs.
const NEAR_US: u64 = 2_000_000;
/// A step of a heading that is a wrap, in degrees or a smaller unit.
const WRAP: f64 = 100.0;
/// A step that wraps is shorter than a turn by what the vehicle turns meanwhile.
const OF_A_TURN: f64 = 0.8;
/// Of counts of a compass, 2 to some power in a turn, which any number is not far below.
const OF_COUNTS: f64 = 0.94;
/// Of compasses of one byte, of 12 and of 16 bits.
const COUNTS: [f64; 3] = [256.0, 4096.0, 65_536.0];
/// Mean cosine of a roll that rests upside down: waves of 0.4 rad about it give -0.92.
const UPSIDE_DOWN: f64 = -0.9;
/// No torpedo climbs so steeply all the time, rad: 34 degrees.
const STEEPEST_CLIMB_RAD: f64 = 0.6;

/// What the unit of a heading may be that is not in radians, usual ones first. One in radians may be unwound, turn after
/// turn; one in degrees starts beyond a turn or seems to spin, and by what it wraps is a turn in its unit.
pub(super) fn heading_units(log: &Log) -> Vec<Mend> {
    let samples: Vec<(u64, f64)> = log.column(Column::Heading).collect();
    if samples.iter().all(|(_, value)| value.abs() <= ROUNDED_TURN) {
        return Vec::new();
    }
    let (mut fast, mut all, mut steps) = (0_usize, 0_usize, Vec::new());
    for pair in samples.windows(2).filter(|pair| pair[1].0 > pair[0].0) {
        let (step, dt_us) = ((pair[1].1 - pair[0].1).abs(), pair[1].0 - pair[0].0);
        all += 1;
        fast += usize::from(step > FASTEST_TURN_RADPS * (dt_us as f64 * 1e-6).max(0.5));
        // from 360 to 0 in one step; an unwound heading has no such step, one in radians none of this size
        steps.extend((step > WRAP && dt_us < NEAR_US).then_some(step));
    }
    let starts_beyond = samples.first().is_some_and(|(_, first)| first.abs() > TAU);
    if !starts_beyond && steps.is_empty() && fast * 1000 <= all {
        return Vec::new();
    }
    // a wrap is as long as all values that there are; steps of a small unit are not
    let (low, high) = samples.iter().fold((f64::MAX, f64::MIN), |(low, high), (_, x)| (x.min(low), x.max(high)));
    steps.retain(|step| *step > OF_A_TURN * (high - low));
    let named = |(unit, rad): &Unit| Mend::unit(Column::Heading, unit, *rad);
    let of_counts =
        |counts: f64| Mend::scaled(&[Column::Heading], &format!("in {counts} counts of a turn"), TAU / counts);
    // degrees first
    let known = units::of(Column::Heading.name()).skip(1);
    if let Some(wrap) = percentile(&steps, 0.5) {
        let turns = known.clone().filter(|(_, rad)| (OF_A_TURN..1.001).contains(&(wrap * rad / TAU)));
        let counts = f64::exp2(wrap.log2().ceil());
        let found = turns.max_by(|a, b| a.1.total_cmp(&b.1)).map(named);
        if let Some(found) = found.or_else(|| (wrap > OF_COUNTS * counts).then(|| of_counts(counts))) {
            return vec![found];
        }
    }
    let largest = high.abs().max(low.abs());
    let is_possible = |mend: &Mend| mend.scale() == RAD_PER_DEG || largest * mend.scale() < TAU;
    known.map(named).chain(COUNTS.map(of_counts)).filter(is_possible).collect()
}

pub(super) fn check(log: &Log, columns: &[ColumnSummary]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let summary = |column| columns.iter().find(|summary| summary.column == column);
    if let Some(roll) = summary(Column::Roll) {
        let cosines: Vec<f64> = log.column(Column::Roll).map(|(_, roll)| roll.cos()).collect();
        if roll.max.abs().max(roll.min.abs()) < TAU && mean(&cosines).is_some_and(|mean| mean < UPSIDE_DOWN) {
            findings.push(counted_from(Column::Roll, "upside down", PI));
        }
    }
    if let Some(pitch) = summary(Column::Pitch) {
        let [low, high] = pitch.percentile_1_99;
        if low > STEEPEST_CLIMB_RAD && high < PI {
            findings.push(counted_from(Column::Pitch, "on its stern", -FRAC_PI_2));
        }
    }
    findings
}

fn counted_from(column: Column, how: &str, offset: f64) -> Finding {
    let message = format!("{} is that of a vehicle that goes {how}: is it counted from elsewhere?", column.name());
    Finding::suspicious(column, message).mended_by(Mend::turned(column, offset).lines())
}

/// A heading in that unit.
pub(super) fn heading(log: &Log, mend: &Mend) -> Finding {
    let largest = log.column(Column::Heading).map(|(_, value)| value.abs()).fold(0.0, f64::max);
    let unit = mend.what.trim_start_matches("heading_rad is in ");
    let unit = if unit == "deg" { "degrees" } else { unit };
    let message = format!("heading_rad reaches {largest:.1}: a turn has 6.28 rad; is it in {unit}?");
    Finding::suspicious(Column::Heading, message).mended_by(mend.lines())
}
