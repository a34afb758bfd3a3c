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

/// Readings of the velocity without a gap, and the way in body axes that they add up to.
#[derive(Clone, Debug, Default)]
pub(super) struct Velocities {
    t_s: Vec<f64>,
    mps: Vec<[f64; 2]>,
    sum_m: Vec<[f64; 2]>,
}

impl Velocities {
    fn push(&mut self, t_s: f64, mps: [f64; 2]) {
        let sum_m = match (self.t_s.last(), self.mps.last(), self.sum_m.last()) {
            (Some(before_s), Some(before), Some(sum)) => {
                [0, 1].map(|axis| sum[axis] + 0.5 * (before[axis] + mps[axis]) * (t_s - before_s))
            }
            _ => [0.0; 2],
        };
        self.t_s.push(t_s);
        self.mps.push(mps);
        self.sum_m.push(sum_m);
    }

    /// Velocity, m/s, and sum, m, between readings; beyond the first and the last these stay.
    fn at(&self, t_s: f64) -> ([f64; 2], [f64; 2]) {
        let next = self.t_s.partition_point(|reading_s| *reading_s <= t_s);
        let before = next.saturating_sub(1).min(self.t_s.len().saturating_sub(1));
        let (Some(from_s), Some(mps), Some(sum)) = (self.t_s.get(before), self.mps.get(before), self.sum_m.get(before))
        else {
            return ([0.0; 2], [0.0; 2]);
        };
        let since_s = t_s - from_s;
        let slope = |axis: usize| match (self.t_s.get(next), self.mps.get(next)) {
            (Some(to_s), Some(to)) if next > before => (to[axis] - mps[axis]) / (to_s - from_s),
            _ => 0.0,
        };
        let velocity = [0, 1].map(|axis| mps[axis] + slope(axis) * since_s);
        let way = [0, 1].map(|axis| sum[axis] + 0.5 * (mps[axis] + velocity[axis]) * since_s);
        (velocity, way)
    }

    /// Mean between two times, m/s, and by how much it changes.
    pub fn between(&self, [from_s, to_s]: [f64; 2]) -> [[f64; 2]; 2] {
        let [(before, sum), (after, next)] = [from_s, to_s].map(|t_s| self.at(t_s));
        [[0, 1].map(|axis| (next[axis] - sum[axis]) / (to_s - from_s)), [0, 1].map(|axis| after[axis] - before[axis])]
    }
}

/// From one reading of the velocity to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leg {
    pub t_s: f64,
    pub dt_s: f64,
    /// Among which readings of the velocity it lies.
    pub velocities: usize,
    /// Mean heading, and by how much it changes, rad.
    pub heading_rad: f64,
    pub turned_rad: f64,
}

/// A fix with what was read about it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fix {
    pub t_s: f64,
    pub sequence: u32,
    /// Legs before it.
    pub legs: usize,
    pub at_m: [f64; 2],
    pub truth_m: Option<[f64; 2]>,
    pub heading_rad: f64,
    pub velocity_mps: [f64; 2],
    /// Way since the beginning of the log, m.
    pub distance_m: f64,
}

/// A log as legs and fixes.
#[derive(Clone, Debug, Default)]
pub(super) struct Track {
    pub velocities: Vec<Velocities>,
    pub legs: Vec<Leg>,
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
    // Time, velocity and heading of the reading before.
    let mut last: Option<(f64, [f64; 2], f64)> = None;
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
        if let (Some(body), Some(psi), false) = (body(row, has_dvl), heading_rad, is_held) {
            if let Some((before_s, before, psi_before)) = last {
                let dt_s = t_s - before_s;
                let turned_rad = wrap_angle(psi - psi_before);
                if dt_s > LONGEST_GAP_S {
                    sequence += 1;
                } else if dt_s > 0.0 {
                    let mean_mps = [0, 1].map(|axis| 0.5 * (before[axis] + body[axis]));
                    let heading_rad = psi_before + 0.5 * turned_rad;
                    distance_m += mean_mps[0].hypot(mean_mps[1]) * dt_s;
                    let velocities = track.velocities.len().saturating_sub(1);
                    track.legs.push(Leg { t_s, dt_s, velocities, heading_rad, turned_rad });
                }
            }
            if last.is_none_or(|(before_s, ..)| t_s - before_s > LONGEST_GAP_S) {
                track.velocities.push(Velocities::default());
            }
            if let Some(velocities) = track.velocities.last_mut()
                && last.is_none_or(|(before_s, ..)| t_s > before_s)
            {
                velocities.push(t_s, body);
            }
            last = Some((t_s, body, psi));
        }
        let (Some(at_m), Some((at_s, velocity_mps, heading_rad))) = (row.gnss_m(), last) else { continue };
        let is_soon = track.fixes.last().is_some_and(|fix| fix.sequence == sequence && t_s - fix.t_s < APART_S);
        if t_s - at_s >= LONGEST_GAP_S || is_soon {
            continue;
        }
        let truth_m = truth.and_then(|truth| truth.at(row.time_us)).map(|row| [row.state[0], row.state[1]]);
        let legs = track.legs.len();
        track.fixes.push(Fix { t_s, sequence, legs, at_m, truth_m, heading_rad, velocity_mps, distance_m });
    }
    track
}
