//! A flight against truth: nothing is read but the true vehicle and the board's telemetry.

use super::draw::Drawn;
use crate::fault_table::ship_of;
use anyhow::Context;
use backseat_link::Client;
use backseat_logs::stats::{median, percentile};
use backseat_wire::hostlink::Mode;
use hil_sim::backseat::InProcess;
use hil_sim::flight::{self, Watched};
use serde::{Deserialize, Serialize};
use std::sync::atomic::AtomicBool;

/// The diagram has a point this often, s.
const POINT_S: f64 = 60.0;

/// One direction of a flight: horizontal, or depth.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Bound {
    /// Largest error over its level.
    pub ratio: f64,
    /// Error and level where that was, m.
    pub worst_m: [f64; 2],
    /// When, s.
    pub worst_s: f64,
    /// Time with an error beyond the level, s.
    pub beyond_s: f64,
    /// Median of the level, m.
    pub level_m: f64,
    /// 95th percentile of the error, m.
    pub error_p95_m: f64,
    /// Error and level, one pair a minute, m.
    pub points_m: Vec<[f32; 2]>,
}

/// One flight.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Judged {
    /// Its classes.
    pub classes: Vec<String>,
    /// Length, h.
    pub hours: f64,
    /// Horizontal.
    pub horizontal: Bound,
    /// Depth.
    pub depth: Bound,
    /// Time with an error beyond three of the board's own sigmas, horizontally, s.
    pub beyond_sigmas_s: f64,
    /// Share of the time with a range in the last two minutes in which the level is at most 25 m; 1 without such a
    /// time.
    pub tight: f64,
    /// Deepest true point under way below the mission's depth, m.
    pub too_deep_m: f64,
    /// The digest.
    pub digest: String,
}

#[derive(Default)]
struct Watch {
    errors_m: Vec<f64>,
    levels_m: Vec<f64>,
    bound: Bound,
    last_point_s: f64,
}

impl Watch {
    fn step(&mut self, time_s: f64, dt_s: f64, error_m: f64, level_m: f64) {
        self.errors_m.push(error_m);
        self.levels_m.push(level_m);
        let ratio = error_m / level_m;
        if ratio > self.bound.ratio {
            (self.bound.ratio, self.bound.worst_m, self.bound.worst_s) = (ratio, [error_m, level_m], time_s);
        }
        if error_m.is_nan() || error_m > level_m {
            self.bound.beyond_s += dt_s;
        }
        if time_s >= self.last_point_s + POINT_S {
            self.last_point_s = time_s;
            self.bound.points_m.push([error_m as f32, level_m as f32]);
        }
    }

    fn finish(self) -> Bound {
        Bound {
            level_m: median(&self.levels_m).unwrap_or(0.0),
            error_p95_m: percentile(&self.errors_m, 0.95).unwrap_or(0.0),
            ..self.bound
        }
    }
}

/// Flies it in this process and judges it.
///
/// # Errors
/// A flight that fails.
pub fn judge(drawn: &Drawn) -> anyhow::Result<Judged> {
    let scenario = &drawn.scenario;
    let deepest_m = scenario.settings.waypoints().iter().map(|waypoint| waypoint.depth_m).fold(0.0, f64::max);
    let mut client = Client::new(InProcess::new());
    let mut ship = ship_of(scenario)?;
    let (mut horizontal, mut depth) = (Watch::default(), Watch::default());
    let (mut last_s, mut beyond_sigmas_s, mut too_deep_m) = (0.0, 0.0, f64::NEG_INFINITY);
    let (mut heard_s, mut under_ranges_s, mut tight_s) = (f64::NEG_INFINITY, 0.0, 0.0);
    let flight =
        flight::fly_watched(scenario, &mut client, ship.as_mut(), &AtomicBool::new(false), |step: Watched<'_>| {
            let time_s = step.time_us as f64 * 1e-6;
            let dt_s = time_s - std::mem::replace(&mut last_s, time_s);
            let range =
                |record: &&backseat_link::ReportedFusion| record.sensor == backseat_core::navigation::Sensor::Range;
            if step.fusions.iter().find(range).is_some_and(|record| record.fused) {
                heard_s = time_s;
            }
            let Some(telemetry) = step.telemetry else { return };
            // a level that is not finite bounds nothing, and JSON has no such number
            let [level_m, depth_level_m] = telemetry.level_m.map(|level_m| f64::from(level_m).min(1.0e9));
            if telemetry.mode == Mode::Initialising || level_m <= 0.0 {
                return;
            }
            let (x, truth) = (&telemetry.state, &step.truth.state);
            let [north_m, east_m] = [x[0] - truth[0], x[1] - truth[1]];
            let error_m = north_m.hypot(east_m);
            horizontal.step(time_s, dt_s, error_m, level_m);
            depth.step(time_s, dt_s, (x[2] - truth[2]).abs(), depth_level_m);
            let sigma = &telemetry.sigma;
            let spread = (north_m * sigma[0]).powi(2)
                + 2.0 * north_m * east_m * telemetry.cov_xy_m2
                + (east_m * sigma[1]).powi(2);
            if error_m * error_m > 3.0 * spread.sqrt() {
                beyond_sigmas_s += dt_s;
            }
            if time_s < heard_s + 120.0 {
                under_ranges_s += dt_s;
                tight_s += if level_m <= 25.0 { dt_s } else { 0.0 };
            }
            if telemetry.leg.is_some() {
                too_deep_m = f64::max(too_deep_m, truth[2] - deepest_m);
            }
        });
    let flight = flight.with_context(|| drawn.text.clone())?;
    Ok(Judged {
        classes: drawn.classes.iter().map(|&name| name.to_owned()).collect(),
        hours: last_s / 3600.0,
        horizontal: horizontal.finish(),
        depth: depth.finish(),
        beyond_sigmas_s,
        tight: if under_ranges_s > 0.0 { tight_s / under_ranges_s } else { 1.0 },
        too_deep_m: too_deep_m.max(-100.0),
        digest: format!("{:016x}", flight.digest),
    })
}
