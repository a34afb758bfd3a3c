//! Signs and unit of the DVL's velocities: carried along the attitude they must change depth and fixes as these do.
//!
//! No model of the vehicle is asked. The change of depth over some seconds is regressed on what surge and what heave
//! make of it, the way between fixes on what surge and what sway make of it; each factor is 1 where all signs are right,
//! −1 where one is wrong, and the size of the unit in m/s where it is another. Without a DVL the logged speed is taken
//! for the surge; a steady current is fitted beside it.

use super::Finding;
use crate::log::{Column, Log, LogRow, M_PER_FOOT, MPS_PER_KNOT};
use nalgebra::{DMatrix, DVector};

/// Change of depth is compared over so long, s: a noisy depth needs long ones, a heave that swings short ones.
const DIVES_S: [f64; 4] = [1.0, 2.0, 5.0, 10.0];
/// Fixes nearer to each other in time say nothing beside their own noise, s; further apart, the DVL's errors rule.
const BETWEEN_FIXES_S: [f64; 2] = [20.0, 1200.0];
/// A gap in velocity or attitude that is carried across, s.
const LONGEST_GAP_S: f64 = 2.5;
/// Fewest equations.
const ENOUGH: usize = 24;
/// A factor has the wrong sign below minus this, and so many standard errors from zero.
const CLEAR: (f64, f64) = (0.5, 6.0);

/// Factors of surge that betray another unit, and which.
const UNITS: [(f64, &str); 3] = [
    (MPS_PER_KNOT, "is it in knots?"),
    (1.0 / MPS_PER_KNOT, "was it converted from knots though it was in m/s?"),
    (M_PER_FOOT, "is it in feet per second?"),
];
/// A factor is one of these within this share of it.
const UNIT_WITHIN: f64 = 0.08;

/// What each velocity axis adds to depth and way, from some time on.
#[derive(Clone, Copy, Default)]
struct Carried {
    seconds: f64,
    /// Depth by surge; by sway and heave together, m.
    down_m: [f64; 2],
    /// North and east by surge, and by sway, m.
    ahead_m: [f64; 2],
    aside_m: [f64; 2],
    /// The longest time without velocity or attitude, s.
    gap_s: f64,
}

/// All that can be said; columns that are doubted already are the caller's to leave out.
pub(super) fn check(log: &Log) -> Vec<Finding> {
    let speed = if log.has(Column::DvlU) { Column::DvlU } else { Column::SpeedLog };
    let (dives, track) = equations(log, speed);
    let mut findings = Vec::new();
    let fitted = dives.iter().filter_map(|dive| Some((dive, dive.factors()?)));
    if let Some((dive, [surge, heave])) = fitted.min_by(|a, b| a.1[1].sigma.total_cmp(&b.1[1].sigma)) {
        let message = match (surge.is_negative(), heave.is_negative()) {
            (false, true) => Some((
                Column::DvlW,
                "dvl_w_mps is positive where depth_m and pitch_rad show that the vehicle rises: it has the wrong sign \
                 (expected: positive down)",
            )),
            (true, true) => Some((
                Column::Depth,
                "depth_m falls where pitch_rad, dvl_u_mps and dvl_w_mps show that the vehicle sinks: it has the wrong \
                 sign (expected: positive down)",
            )),
            // A pitch of the wrong sign is found without the DVL; what remains is the surge.
            (true, false) if dive.mean_surge_mps < 0.0 => Some((
                Column::DvlU,
                "dvl_u_mps is negative where the vehicle dives nose down: it has the wrong sign (expected: positive \
                 ahead)",
            )),
            _ => None,
        };
        findings.extend(message.map(|(column, message)| Finding::suspicious(column, message)));
    }
    let shown = [(track.factors(), "fixes and heading_rad")]
        .into_iter()
        .chain(dives.iter().map(|dive| (dive.factors(), "depth_m and pitch_rad")));
    let unit = shown.filter_map(|(factors, others)| Some((factors?[0], factors?[0].unit()?, others))).next();
    if let Some((surge, guess, others)) = unit {
        let (name, times) = (speed.name(), 1.0 / surge.value);
        let message = format!("{name} is {times:.2} times the speed that {others} show: {guess}");
        findings.push(Finding::suspicious(speed, message));
    }
    if let Some([surge, sway]) = track.factors()
        && sway.is_negative()
        && surge.value > CLEAR.0
    {
        let message = "dvl_v_mps is positive where the fixes and heading_rad show that the vehicle moves to port: it has \
                       the wrong sign (expected: positive to starboard)";
        findings.push(Finding::suspicious(Column::DvlV, message));
    }
    findings
}

/// A regression whose first two unknowns are the factors of two velocity axes.
#[derive(Default)]
struct Regression {
    rows: Vec<Vec<f64>>,
    right: Vec<f64>,
    mean_surge_mps: f64,
}

/// A fitted factor.
#[derive(Clone, Copy)]
struct Factor {
    value: f64,
    sigma: f64,
    /// The other bound: noise of the attitude makes the fitted value smaller than the true one, and this, of the
    /// regression the other way round, larger (Frisch 1934).
    most: f64,
}

impl Factor {
    fn is_negative(&self) -> bool {
        self.value < -CLEAR.0 && self.value + CLEAR.1 * self.sigma < 0.0
    }

    /// Which other unit the velocity seems to have.
    fn unit(&self) -> Option<&'static str> {
        let is_clear = CLEAR.1 * self.sigma < (self.value - 1.0).abs();
        let is_near = |value: f64, ratio: f64| (value / ratio - 1.0).abs() + self.sigma / ratio < UNIT_WITHIN;
        let near = UNITS.iter().find(|(ratio, _)| is_near(self.value, *ratio) && is_near(self.most, *ratio));
        near.filter(|_| is_clear).map(|(_, guess)| *guess)
    }
}

impl Regression {
    /// The first two unknowns; `None` with too few equations, or where these do not determine them.
    fn factors(&self) -> Option<[Factor; 2]> {
        let (count, unknowns) = (self.rows.len(), self.rows.first()?.len());
        if count < ENOUGH {
            return None;
        }
        let rows = DMatrix::from_fn(count, unknowns, |i, j| self.rows[i][j]);
        let right = DVector::from_column_slice(&self.right);
        // An axis that the log does not have: no number, and no certainty.
        let nothing = DMatrix::from_diagonal_element(unknowns, unknowns, 1e-9);
        let inverse = (rows.tr_mul(&rows) + nothing).cholesky()?.inverse();
        let fitted = &inverse * rows.tr_mul(&right);
        let freedom = (count - unknowns) as f64;
        let variance = (right - rows * &fitted).norm_squared() / freedom;
        Some([0, 1].map(|at| {
            let (value, sigma) = (fitted[at], (variance * inverse[(at, at)]).sqrt());
            // The value over the square of the partial correlation, which is t² / (t² + freedom), t = value / sigma.
            Factor { value, sigma, most: value + freedom * sigma * sigma / value }
        }))
    }
}

/// Equations of the depth over each of [`DIVES_S`], and of the fixes.
fn equations(log: &Log, speed: Column) -> ([Regression; DIVES_S.len()], Regression) {
    let (mut dives, mut track): ([Regression; DIVES_S.len()], Regression) = Default::default();
    let (mut attitude, mut velocity): (Option<[f64; 3]>, Option<[f64; 3]>) = (None, None);
    let (mut since_depth, mut since_fix) = ([Carried::default(); DIVES_S.len()], Carried::default());
    let (mut last_depth, mut last_fix): ([Option<f64>; DIVES_S.len()], Option<[f64; 2]>) = Default::default();
    let (mut before_us, mut fresh_us) = (None, [0_u64; 2]);
    let (mut surge, mut count) = (0.0, 0.0);
    for row in &log.rows {
        let dt_s = before_us.map_or(0.0, |us: u64| row.time_us.saturating_sub(us) as f64 * 1e-6);
        before_us = Some(row.time_us);
        for carried in since_depth.iter_mut().chain([&mut since_fix]) {
            let old_us = row.time_us.saturating_sub(fresh_us[0].min(fresh_us[1]));
            carried.add(dt_s, attitude.zip(velocity), old_us as f64 * 1e-6);
        }
        if let Some(euler) = row.attitude_rad().or_else(|| level(row).filter(|_| speed == Column::SpeedLog)) {
            (attitude, fresh_us[0]) = (Some(euler), row.time_us);
        }
        let nu = if speed == Column::DvlU { row.dvl_mps() } else { row.get(speed).map(|ahead| [ahead, 0.0, 0.0]) };
        if let Some(nu) = nu {
            (velocity, fresh_us[1]) = (Some(nu), row.time_us);
            (surge, count) = (surge + nu[0], count + 1.0);
        }
        if let Some(depth_m) = row.get(Column::Depth) {
            for (place, dive) in dives.iter_mut().enumerate() {
                let Carried { seconds, down_m: [surge_m, heave_m], gap_s, .. } = since_depth[place];
                if last_depth[place].is_some() && seconds < DIVES_S[place] {
                    continue;
                }
                if let Some(before) = last_depth[place].filter(|_| gap_s < LONGEST_GAP_S) {
                    // The third: a pitch sensor with a bias.
                    dive.rows.push(vec![surge_m, heave_m, seconds]);
                    dive.right.push(depth_m - before);
                }
                (last_depth[place], since_depth[place]) = (Some(depth_m), Carried::default());
            }
        }
        let Some(fix) = row.gnss_m() else { continue };
        let is_due = since_fix.seconds >= BETWEEN_FIXES_S[0];
        if last_fix.is_none() || is_due {
            let is_whole = since_fix.gap_s < LONGEST_GAP_S && since_fix.seconds <= BETWEEN_FIXES_S[1];
            if let Some(before) = last_fix.filter(|_| is_whole) {
                let Carried { ahead_m: a, aside_m: b, seconds, .. } = since_fix;
                // The third is a heading that is turned, the others are a current.
                track.rows.push(vec![a[0], b[0], -a[1], seconds, 0.0]);
                track.rows.push(vec![a[1], b[1], a[0], 0.0, seconds]);
                track.right.extend([fix[0] - before[0], fix[1] - before[1]]);
            }
            (last_fix, since_fix) = (Some(fix), Carried::default());
        }
    }
    dives.iter_mut().for_each(|dive| dive.mean_surge_mps = if count > 0.0 { surge / count } else { 0.0 });
    (dives, track)
}

/// The attitude of a vehicle that logs its heading alone, or its pitch besides.
fn level(row: &LogRow) -> Option<[f64; 3]> {
    Some([0.0, row.get(Column::Pitch).unwrap_or(0.0), row.get(Column::Heading)?])
}

impl Carried {
    /// Over some seconds at the attitude and velocity last read.
    fn add(&mut self, dt_s: f64, motion: Option<([f64; 3], [f64; 3])>, old_s: f64) {
        self.seconds += dt_s;
        let Some(([roll, pitch, heading], [u, v, w])) = motion else {
            self.gap_s = f64::INFINITY;
            return;
        };
        self.gap_s = self.gap_s.max(old_s);
        let (sin, cos) = heading.sin_cos();
        let ahead = u * pitch.cos() + (v * roll.sin() + w * roll.cos()) * pitch.sin();
        let aside = v * roll.cos() - w * roll.sin();
        self.down_m[0] -= u * pitch.sin() * dt_s;
        self.down_m[1] += (v * roll.sin() + w * roll.cos()) * pitch.cos() * dt_s;
        self.ahead_m = [self.ahead_m[0] + ahead * cos * dt_s, self.ahead_m[1] + ahead * sin * dt_s];
        self.aside_m = [self.aside_m[0] - aside * sin * dt_s, self.aside_m[1] + aside * cos * dt_s];
    }
}
