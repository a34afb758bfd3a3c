//! Logs without fins and propeller: dead reckoning on logged heading and speed against GNSS.
//!
//! The model: between two fixes the vehicle moves along its heading with its logged speed (with a DVL: with its
//! velocity over ground). The difference to the fixes is explained by a current, a compass error, a speed scale and
//! (with a DVL) a misalignment. Fixes some time apart are compared, so that their noise is small against the distance
//! between them. Readings that the log repeats while the sensor is away are left out.

use super::held_readings;
use super::model::{Entry, LogModel, Measures, Nameless, Row};
use super::selection::{self, LogModelDiagnosis};
use crate::prepared_log::BLOCK_S;
use crate::samples::ResidualChannel;
use backseat_logs::log::Column;
use backseat_logs::stats::{Z_95, median};
use backseat_logs::{Log, Truth, VehicleFile};

/// A gap in heading or speed longer than this ends a stretch, s.
const LONGEST_GAP_S: f64 = 5.0;
/// Fewest stretches between two fixes that are worth a fit.
pub const FEWEST: usize = 12;
/// Stretches wanted of a short log, and the shortest.
const STRETCHES: f64 = 60.0;
const SHORTEST_S: f64 = 5.0;
/// Time over which dead reckoning runs on when its position is scored, s.
const RECKONED_S: f64 = 600.0;

/// Columns: current north, east; heading constant, sine, cosine; speed scale; DVL yaw; second harmonic of the heading,
/// sine, cosine; current growing with time, north, east (without a name); delay of the heading; arm of the antenna,
/// ahead, to starboard; arm of the DVL, the same; delay of the DVL.
const COLUMNS: usize = 17;
/// Sway in turns, which is the yaw rate times a length: an antenna ahead of the centre, or a vehicle that slips
/// outwards.
const SIDESLIP: usize = 12;
/// Turns of the log from which on the sideslip is seen, rad.
const LEAST_TURNED_RAD: f64 = 1.5;

/// One stretch between two fixes.
#[derive(Clone)]
struct Stretch {
    t_s: f64,
    dt_s: f64,
    /// What dead reckoning lacks, m.
    missing_m: [f64; 2],
    /// The same against the truth, where it is given.
    missing_of_truth_m: Option<[f64; 2]>,
    /// ∂ way/∂θ, m.
    slopes: [[f64; COLUMNS]; 2],
}

struct DeadReckoning {
    stretches: Vec<Stretch>,
    has_dvl: bool,
    /// Whether the sideslip is fitted in any case.
    fits_sideslip: bool,
    apart_s: f64,
}

impl LogModel for DeadReckoning {
    fn columns(&self) -> usize {
        COLUMNS
    }

    /// What is missing over a stretch, m.
    fn rows(&self, theta: &[f64]) -> Vec<Row> {
        let of = |stretch: &Stretch| {
            [ResidualChannel::GnssX, ResidualChannel::GnssY]
                .into_iter()
                .enumerate()
                .map(|(axis, channel)| {
                    let slopes = &stretch.slopes[axis];
                    let residual = stretch.missing_m[axis] - dot(slopes, theta);
                    Row { t_s: stretch.t_s, channel, residual, slopes: slopes.to_vec() }
                })
                .collect::<Vec<_>>()
        };
        self.stretches.iter().flat_map(of).collect()
    }

    /// Without a measured sway the vehicle's own sideslip in turns is a number that nobody declares.
    fn calibrated(&self) -> Vec<usize> {
        if self.fits_sideslip { vec![SIDESLIP] } else { Vec::new() }
    }

    fn entries(&self) -> Vec<Entry> {
        let mut entries = vec![("water_current", vec![0, 1]), ("heading_bias", vec![2, 3, 4]), ("dvl_scale", vec![5])];
        entries.extend([("soft_iron", vec![7, 8]), ("heading_lag", vec![11])]);
        if !self.fits_sideslip {
            entries.push(("gnss_lever_arm", vec![SIDESLIP, 13]));
        }
        if self.has_dvl {
            entries.extend([("dvl_misalignment", vec![6]), ("dvl_lever_arm", vec![14, 15]), ("dvl_delay", vec![16])]);
        }
        entries
    }

    fn nameless(&self) -> Vec<Nameless> {
        vec![("a current that grows with time", vec![9, 10])]
    }

    fn block_s(&self) -> f64 {
        self.apart_s
    }

    /// Velocity missing over each stretch, and the position lost by dead reckoning of ten minutes.
    fn measures(&self, theta: &[f64]) -> Measures {
        let mut measures = Measures::default();
        let has_truth = self.stretches.iter().any(|stretch| stretch.missing_of_truth_m.is_some());
        let (mut lost_m, mut reckoned_s) = ([0.0; 2], 0.0);
        for stretch in &self.stretches {
            let missing = if has_truth { stretch.missing_of_truth_m } else { Some(stretch.missing_m) };
            let Some(missing) = missing else { continue };
            if reckoned_s > RECKONED_S {
                (lost_m, reckoned_s) = ([0.0; 2], 0.0);
            }
            reckoned_s += stretch.dt_s;
            for axis in 0..2 {
                let error = missing[axis] - dot(&stretch.slopes[axis], theta);
                lost_m[axis] += error;
                measures.velocity.push((stretch.t_s, error / stretch.dt_s));
            }
            measures.position.push((stretch.t_s, lost_m[0].hypot(lost_m[1])));
        }
        measures.against = Some(if has_truth {
            "truth, dead reckoning of ten minutes"
        } else {
            "GNSS fixes, dead reckoning of ten minutes"
        });
        measures
    }
}

fn dot(slopes: &[f64; COLUMNS], theta: &[f64]) -> f64 {
    slopes.iter().zip(theta).map(|(slope, value)| slope * value).sum()
}

/// Whether a log holds heading, speed and fixes under way, enough of them for [`run`].
#[must_use]
pub fn is_for(log: &Log) -> bool {
    let has_dvl = has_dvl(log);
    stretches(log, has_dvl, apart_s(log), &held(log, has_dvl), None).len() >= FEWEST
}

fn has_dvl(log: &Log) -> bool {
    log.has(Column::DvlU) && log.has(Column::DvlV)
}

/// Time between the fixes that are compared, s.
fn apart_s(log: &Log) -> f64 {
    (log.duration_s() / STRETCHES).clamp(SHORTEST_S, BLOCK_S)
}

/// Diagnoses a log on heading and speed alone; `None` if it has too few fixes, headings or speeds.
///
/// `use_dvl` false leaves the DVL's velocity out: its surge then serves as nothing, the logged speed is used.
#[must_use]
pub fn run(log: &Log, vehicle: &VehicleFile, use_dvl: bool, truth: Option<&Truth>) -> Option<LogModelDiagnosis> {
    let (has_dvl, apart_s) = (use_dvl && has_dvl(log), apart_s(log));
    let held = held(log, has_dvl);
    let stretches = stretches(log, has_dvl, apart_s, &held, truth);
    if stretches.len() < FEWEST {
        return None;
    }
    // ∂ way/∂ arm is what the heading turns by.
    let turned_rad: f64 = stretches.iter().map(|s| s.slopes[0][SIDESLIP].hypot(s.slopes[1][SIDESLIP])).sum();
    let fits_sideslip = !has_dvl && turned_rad > LEAST_TURNED_RAD;
    let model = DeadReckoning { stretches, has_dvl, fits_sideslip, apart_s };
    let mut found = selection::run(&model, log, vehicle)?;
    let name = if has_dvl { "the DVL's velocity" } else { "the logged speed" };
    let mut notes = vec![format!(
        "the log has no fin angles and propeller speed: the declared model is dead reckoning on the logged heading and {name}. \
         Only effects on the horizontal position can be tested (current, compass, speed)"
    )];
    if fits_sideslip {
        notes.push(format!(
            "sway in turns of {:.2} (±{:.2}) m times the yaw rate is always fitted: the vehicle's sideslip (negative: outwards) \
             and an antenna ahead of the centre look alike, so that a gnss_lever_arm is not tested",
            found.theta[1][SIDESLIP],
            Z_95 * found.sigmas[SIDESLIP]
        ));
    }
    for [from_s, to_s] in held {
        notes.push(format!(
            "{name} does not change at all from {from_s:.0} s to {to_s:.0} s: these readings are held, not measured, and are \
             left out"
        ));
    }
    if has_dvl {
        notes.push(
            "DVL bottom track includes the current: a water_current found here is a difference between DVL and fixes that is \
             constant in NED"
                .to_owned(),
        );
    } else {
        notes.push("dvl_scale means here the scale of the logged speed".to_owned());
    }
    notes.push(
        "wind and waves move a vehicle at the surface too: a current found there includes their drift".to_owned(),
    );
    notes.append(&mut found.diagnosis.notes);
    found.diagnosis.notes = notes;
    Some(found)
}

/// Horizontal velocity of a row in body axes.
fn body(row: &backseat_logs::LogRow, has_dvl: bool) -> Option<[f64; 2]> {
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

/// Walks over the log and closes a stretch at the first fix that is far enough in time.
fn stretches(log: &Log, has_dvl: bool, apart_s: f64, held: &[[f64; 2]], truth: Option<&Truth>) -> Vec<Stretch> {
    let start_us = log.rows.first().map_or(0, |row| row.time_us);
    let middle_s = 0.5 * log.duration_s();
    let mut heading: Option<(f64, f64)> = None;
    let mut turn_radps = 0.0;
    let mut fix: Option<(f64, u64, [f64; 2])> = None;
    // Time, velocity and heading of the reading before.
    let mut last: Option<(f64, [f64; 2], f64)> = None;
    let (mut moved, mut slopes) = ([0.0; 2], [[0.0; COLUMNS]; 2]);
    let mut found = Vec::new();
    for row in &log.rows {
        let t_s = (row.time_us - start_us) as f64 * 1e-6;
        if let Some(psi) = row.get(Column::Heading) {
            if let Some((before_s, before)) = heading.filter(|(before_s, _)| t_s > *before_s) {
                turn_radps = backseat_core::state::wrap_angle(psi - before) / (t_s - before_s);
            }
            heading = Some((t_s, psi));
        }
        let is_held = held.iter().any(|[from_s, to_s]| (*from_s..=*to_s).contains(&t_s));
        if let (Some(body), Some((_, psi)), false) = (body(row, has_dvl), heading, is_held) {
            if let Some((before_s, before, psi_before)) = last {
                let dt = t_s - before_s;
                if dt > LONGEST_GAP_S {
                    fix = None;
                } else {
                    let mean = [0, 1].map(|axis| 0.5 * (before[axis] + body[axis]));
                    let change = [0, 1].map(|axis| body[axis] - before[axis]);
                    let psi = psi_before + 0.5 * backseat_core::state::wrap_angle(psi - psi_before);
                    let along =
                        add(&mut slopes, [mean, change], psi, turn_radps, dt, (t_s - middle_s) / (2.0 * middle_s));
                    for axis in 0..2 {
                        moved[axis] += along[axis] * dt;
                    }
                }
            }
            last = Some((t_s, body, psi));
        }
        let Some(now) = row.gnss_m().filter(|_| last.is_some_and(|(at_s, ..)| t_s - at_s < LONGEST_GAP_S)) else {
            continue;
        };
        match fix {
            Some((fix_s, ..)) if t_s - fix_s < apart_s => continue,
            Some((fix_s, fix_us, before)) => {
                let missing_m = [0, 1].map(|axis| now[axis] - before[axis] - moved[axis]);
                let at = |time_us| truth.and_then(|truth| truth.at(time_us)).map(|row| [row.state[0], row.state[1]]);
                let missing_of_truth_m = at(row.time_us)
                    .zip(at(fix_us))
                    .map(|(now, before)| [0, 1].map(|axis| now[axis] - before[axis] - moved[axis]));
                found.push(Stretch { t_s, dt_s: t_s - fix_s, missing_m, missing_of_truth_m, slopes });
            }
            None => {}
        }
        fix = Some((t_s, row.time_us, now));
        (moved, slopes) = ([0.0; 2], [[0.0; COLUMNS]; 2]);
    }
    without_jumps(found)
}

/// Adds ∂ way/∂θ of a step with this velocity in body axes, which changes by that much; returns the velocity over ground, north and east.
fn add(
    slopes: &mut [[f64; COLUMNS]; 2],
    [[u, v], [du, dv]]: [[f64; 2]; 2],
    psi: f64,
    turn_radps: f64,
    dt: f64,
    since_middle: f64,
) -> [f64; 2] {
    let (sin, cos) = psi.sin_cos();
    let along = [u * cos - v * sin, u * sin + v * cos];
    let across = [-along[1], along[0]];
    let (ahead, starboard) = ([cos, sin], [-sin, cos]);
    for axis in 0..2 {
        let by = &mut slopes[axis];
        by[axis] += dt;
        by[9 + axis] += since_middle * dt;
        // True heading is measured less bias: the way turns back by it.
        let harmonics = [(2, 1.0), (3, sin), (4, cos), (7, (2.0 * psi).sin()), (8, (2.0 * psi).cos())];
        for (column, factor) in harmonics {
            by[column] -= factor * across[axis] * dt;
        }
        by[5] -= along[axis] * dt;
        // v_measured = Rz(yaw)ᵀ v: the true velocity is turned by yaw.
        by[6] += across[axis] * dt;
        // Late by τ, the reading is behind by τ times the turn.
        by[11] += turn_radps * across[axis] * dt;
        // An antenna off the point that is reckoned moves around it: ω × arm. Of a DVL's arm the reckoning has too
        // much.
        let around = [turn_radps * starboard[axis] * dt, -turn_radps * ahead[axis] * dt];
        for (place, way) in around.into_iter().enumerate() {
            by[12 + place] += way;
            by[14 + place] -= way;
        }
        // The velocity of now is read a delay later: what it changes by in that time is missing.
        by[16] += du * ahead[axis] + dv * starboard[axis];
    }
    along
}

/// Leaves out stretches whose fixes jump: more than anything that is missing elsewhere by far.
fn without_jumps(stretches: Vec<Stretch>) -> Vec<Stretch> {
    const FAR: f64 = 20.0;
    let size = |stretch: &Stretch| stretch.missing_m[0].hypot(stretch.missing_m[1]);
    let typical = median(&stretches.iter().map(size).collect::<Vec<_>>()).unwrap_or(0.0).max(0.1);
    stretches.into_iter().filter(|stretch| size(stretch) < FAR * typical).collect()
}

#[cfg(test)]
mod tests;
