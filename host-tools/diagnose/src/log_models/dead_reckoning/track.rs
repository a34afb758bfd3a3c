//! What dead reckoning is made of: readings of heading and velocity between fixes.

use super::super::held_readings;
use backseat_core::state::wrap_angle;
use backseat_logs::log::Column;
use backseat_logs::{Log, LogRow, Truth};
use std::f64::consts::TAU;

/// A gap in heading or speed longer than this ends a sequence, s.
const LONGEST_GAP_S: f64 = 5.0;
/// Fixes are used at most so often, s.
const APART_S: f64 = 0.95;

/// Surge and sway, m/s, and heading without jumps, rad.
type Reading = [f64; 3];
const AXES: [usize; 3] = [0, 1, 2];

/// Readings without a gap, and what they add up to.
#[derive(Clone, Debug, Default)]
pub(super) struct Readings {
    t_s: Vec<f64>,
    read: Vec<Reading>,
    sums: Vec<Reading>,
}

impl Readings {
    fn push(&mut self, t_s: f64, read: Reading) {
        let sum = match (self.t_s.last(), self.read.last(), self.sums.last()) {
            (Some(before_s), Some(before), Some(sum)) => {
                AXES.map(|axis| sum[axis] + 0.5 * (before[axis] + read[axis]) * (t_s - before_s))
            }
            _ => [0.0; 3],
        };
        self.t_s.push(t_s);
        self.read.push(read);
        self.sums.push(sum);
    }

    /// Value and sum between readings; beyond the first and the last the value stays.
    fn at(&self, t_s: f64) -> (Reading, Reading) {
        let next = self.t_s.partition_point(|reading_s| *reading_s <= t_s);
        let before = next.saturating_sub(1).min(self.t_s.len().saturating_sub(1));
        let (Some(from_s), Some(read), Some(sum)) =
            (self.t_s.get(before), self.read.get(before), self.sums.get(before))
        else {
            return ([0.0; 3], [0.0; 3]);
        };
        let since_s = t_s - from_s;
        let slope = |axis: usize| match (self.t_s.get(next), self.read.get(next)) {
            (Some(to_s), Some(to)) if next > before => (to[axis] - read[axis]) / (to_s - from_s),
            _ => 0.0,
        };
        let value = AXES.map(|axis| read[axis] + slope(axis) * since_s);
        (value, AXES.map(|axis| sum[axis] + 0.5 * (read[axis] + value[axis]) * since_s))
    }

    /// Time of a reading, s.
    pub fn time_s(&self, place: usize) -> f64 {
        self.t_s[place]
    }

    /// Times of a reading and of the next, s.
    pub fn span(&self, place: usize) -> Option<[f64; 2]> {
        Some([*self.t_s.get(place)?, *self.t_s.get(place + 1)?])
    }

    /// Heading, rad.
    pub fn heading_rad(&self, t_s: f64) -> f64 {
        self.at(t_s).0[2]
    }

    /// Mean between two times that are not the same, and by how much it changes.
    pub fn between(&self, [from_s, to_s]: [f64; 2]) -> [Reading; 2] {
        let [(before, sum), (after, next)] = [from_s, to_s].map(|t_s| self.at(t_s));
        [AXES.map(|axis| (next[axis] - sum[axis]) / (to_s - from_s)), AXES.map(|axis| after[axis] - before[axis])]
    }
}

/// A fix with what was read about it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fix {
    pub t_s: f64,
    pub sequence: u32,
    /// Among which readings it lies.
    pub readings: usize,
    pub at_m: [f64; 2],
    pub truth_m: Option<[f64; 2]>,
    pub heading_rad: f64,
    /// Way since the beginning of the log, m.
    pub distance_m: f64,
}

/// A log as readings and fixes.
#[derive(Clone, Debug, Default)]
pub(super) struct Track {
    pub readings: Vec<Readings>,
    pub fixes: Vec<Fix>,
    /// Beginning and end of each run, s.
    pub runs: Vec<[f64; 2]>,
    /// Times between which the velocity is held, s.
    pub held: Vec<[f64; 2]>,
}

/// Sectors in which headings are counted.
const SECTORS: usize = 120;
/// Directions count as different from 36 degrees on, and where at least this share of the fixes lies within half of that;
/// a turn passes the others.
const APART: usize = SECTORS / 10;
const FLOWN_SHARE: f64 = 0.05;

impl Track {
    /// In how many different directions the vehicle went.
    pub fn directions(&self) -> usize {
        let mut counts = [0_usize; SECTORS];
        for fix in &self.fixes {
            let share = fix.heading_rad.rem_euclid(TAU) / TAU;
            counts[((share * SECTORS as f64) as usize).min(SECTORS - 1)] += 1;
        }
        let about = |sector: usize| -> usize {
            (0..=APART).map(|k| counts[(sector + SECTORS + k - APART / 2) % SECTORS]).sum()
        };
        let mut apart: Vec<usize> = Vec::new();
        for sector in (0..SECTORS).filter(|sector| counts[*sector] > 0) {
            let is_apart = |other: &usize| (sector - other).min(SECTORS + other - sector) >= APART;
            if apart.iter().all(is_apart) && about(sector) as f64 >= FLOWN_SHARE * self.fixes.len() as f64 {
                apart.push(sector);
            }
        }
        apart.len()
    }
}

/// Horizontal velocity of a row in body axes.
fn body(row: &LogRow, has_dvl: bool) -> Option<[f64; 2]> {
    if has_dvl {
        row.get(Column::DvlU).zip(row.get(Column::DvlV)).map(|(u, v)| [u, v])
    } else {
        row.get(Column::SpeedLog).map(|speed| [speed, 0.0])
    }
}

/// Times between which the velocity repeats itself though it elsewhere always changes, s.
fn held(log: &Log, has_dvl: bool) -> Vec<[f64; 2]> {
    let start_us = log.rows.first().map_or(0, |row| row.time_us);
    let series: Vec<(f64, Vec<f64>)> = log
        .rows
        .iter()
        .filter_map(|row| {
            let [u, v] = body(row, has_dvl)?;
            let heave = row.get(Column::DvlW).filter(|_| has_dvl).unwrap_or(0.0);
            Some(((row.time_us - start_us) as f64 * 1e-6, vec![u, v, heave]))
        })
        .collect();
    held_readings::held_readings(&series)
}

/// Walks over the log.
pub(super) fn of(log: &Log, has_dvl: bool, truth: Option<&Truth>) -> Track {
    let start_us = log.rows.first().map_or(0, |row| row.time_us);
    let mut track = Track { held: held(log, has_dvl), ..Track::default() };
    let mut heading_rad: Option<f64> = None;
    // Time and values of the reading before.
    let mut last: Option<(f64, Reading)> = None;
    let (mut sequence, mut run, mut distance_m) = (0, None, 0.0);
    for row in &log.rows {
        let t_s = (row.time_us - start_us) as f64 * 1e-6;
        let number = row.get(Column::Run);
        if number.is_some() && number != run {
            run = number;
            (last, heading_rad) = (None, None);
            sequence += 1;
            track.runs.push([t_s, t_s]);
        }
        if let Some(current) = track.runs.last_mut() {
            current[1] = t_s;
        }
        heading_rad = row.get(Column::Heading).or(heading_rad);
        let is_held = track.held.iter().any(|[from_s, to_s]| (*from_s..=*to_s).contains(&t_s));
        if let (Some([u, v]), Some(psi), false) = (body(row, has_dvl), heading_rad, is_held) {
            let turned_rad = last.map_or(0.0, |(_, [.., before])| wrap_angle(psi - before));
            let read = [u, v, last.map_or(psi, |(_, [.., before])| before + turned_rad)];
            let since_s = last.map(|(before_s, _)| t_s - before_s);
            if since_s.is_some_and(|dt_s| dt_s > LONGEST_GAP_S) {
                sequence += 1;
            }
            if since_s.is_none_or(|dt_s| dt_s > LONGEST_GAP_S) {
                track.readings.push(Readings::default());
            } else if let (Some((_, before)), Some(dt_s)) = (last, since_s) {
                let mean_mps = [0, 1].map(|axis| 0.5 * (before[axis] + read[axis]));
                distance_m += mean_mps[0].hypot(mean_mps[1]) * dt_s;
            }
            if let Some(readings) = track.readings.last_mut()
                && since_s.is_none_or(|dt_s| dt_s > 0.0)
            {
                readings.push(t_s, read);
            }
            last = Some((t_s, read));
        }
        let (Some(at_m), Some((at_s, [.., heading_rad]))) = (row.gnss_m(), last) else { continue };
        let is_soon = track.fixes.last().is_some_and(|fix| fix.sequence == sequence && t_s - fix.t_s < APART_S);
        if t_s - at_s >= LONGEST_GAP_S || is_soon {
            continue;
        }
        let truth_m = truth.and_then(|truth| truth.at(row.time_us)).map(|row| [row.state[0], row.state[1]]);
        let readings = track.readings.len().saturating_sub(1);
        track.fixes.push(Fix { t_s, sequence, readings, at_m, truth_m, heading_rad, distance_m });
    }
    track
}
