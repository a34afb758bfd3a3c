//! A log cut into windows: how the velocity changes over each, and the integrals of all terms.
//!
//! A change of velocity over some seconds needs no derivative of noisy readings. A window lasts half the time in which
//! the vessel moves by its own length: shorter ones are noise, longer ones average the manoeuvre away.

use super::terms::{self, Windage};
use crate::vessel::planar;
use crate::vessel::readings::{Reading, drives, integral, longest_step_s, readings};
use backseat_logs::Log;
use backseat_logs::stats::median;

/// Bounds of a window, s.
const SHORTEST_S: f64 = 1.0;
const LONGEST_S: f64 = 10.0;
/// Readings are averaged over this share of a window to either side.
const AVERAGED: f64 = 0.05;

/// One window.
#[derive(Clone, Debug)]
pub(super) struct Window {
    pub t_s: f64,
    /// Number of the run in the log.
    pub run: u32,
    pub length_s: f64,
    /// Change of surge, sway, yaw rate.
    pub change: [f64; 3],
    /// ∫ terms dt of each axis.
    pub terms: [Vec<f64>; 3],
    /// ∫ of the cross terms of sway and yaw.
    pub cross: [f64; 2],
    pub heading_rad: f64,
    /// Mean velocity.
    pub velocity: [f64; 3],
    /// ∫ of the wind's four terms with the measured wind.
    pub wind: Option<[f64; 4]>,
    /// The way between the positions less that of the velocity, m, and its derivative by an arm of the antenna.
    pub way: Option<([f64; 2], [[f64; 2]; 2])>,
    /// Measured wind at its start, towards north and east, m/s.
    pub measured_mps: Option<[f64; 2]>,
}

/// All windows under way.
pub(super) fn cut(log: &Log, length_m: f64, windage: Option<Windage>) -> Vec<Window> {
    let runs = readings(log);
    let drives = drives(&runs);
    let speeds: Vec<f64> = runs
        .iter()
        .flat_map(|(_, run)| run)
        .filter(|reading| drives(reading))
        .map(|reading| reading.velocity[0])
        .collect();
    let Some(speed) = median(&speeds) else { return Vec::new() };
    let length_s = (0.5 * length_m / speed).clamp(SHORTEST_S, LONGEST_S);
    let mut windows = Vec::new();
    for (number, run) in runs {
        let run = averaged(&run, AVERAGED * length_s);
        let longest_s = longest_step_s(&run);
        let mut from = 0;
        while from + 1 < run.len() {
            let to = run.partition_point(|reading| reading.t_s < run[from].t_s + length_s);
            if to >= run.len() {
                break;
            }
            let part = &run[from..=to];
            let is_whole = part.windows(2).all(|pair| pair[1].t_s - pair[0].t_s <= longest_s);
            if is_whole && part.iter().all(&drives) {
                windows.push(window(number, part, windage));
            }
            from = to;
        }
    }
    windows
}

/// Integrals over one window.
fn window(run: u32, part: &[Reading], windage: Option<Windage>) -> Window {
    let (first, last) = (&part[0], &part[part.len() - 1]);
    let length_s = last.t_s - first.t_s;
    let integral = |of: &dyn Fn(&Reading) -> Vec<f64>| integral(part, of);
    let mean = integral(&|reading| vec![reading.velocity[0], reading.velocity[1], reading.velocity[2]]);
    let measured = |reading: &Reading| {
        let terms = windage
            .zip(reading.wind_mps)
            .map(|(windage, wind)| windage.terms(wind, reading.heading_rad, reading.velocity));
        terms.map_or_else(Vec::new, |terms| terms.to_vec())
    };
    let has_wind = part.iter().all(|reading| reading.wind_mps.is_some());
    let wind = integral(&|reading| if has_wind { measured(reading) } else { Vec::new() });
    let way = first.position_m.zip(last.position_m).map(|(from, to)| {
        let moved = integral(&|reading| {
            let ((sin, cos), [u, v, _]) = (reading.heading_rad.sin_cos(), reading.velocity);
            vec![u * cos - v * sin, u * sin + v * cos]
        });
        let ((s0, c0), (s1, c1)) = (first.heading_rad.sin_cos(), last.heading_rad.sin_cos());
        let missing = [0, 1].map(|axis| to[axis] - from[axis] - moved[axis]);
        (missing, [[c1 - c0, s0 - s1], [s1 - s0, c1 - c0]])
    });
    let cross = integral(&|reading| terms::cross(reading).to_vec());
    Window {
        t_s: first.t_s,
        run,
        length_s,
        change: [0, 1, 2].map(|axis| last.velocity[axis] - first.velocity[axis]),
        terms: [0, 1, 2].map(|axis| integral(&|reading| terms_of(axis, reading))),
        cross: [cross[0], cross[1]],
        heading_rad: part[part.len() / 2].heading_rad,
        velocity: [0, 1, 2].map(|axis| mean[axis] / length_s),
        wind: <[f64; 4]>::try_from(wind).ok(),
        way,
        measured_mps: first.wind_mps,
    }
}

/// The model's terms of an axis.
fn terms_of(axis: usize, reading: &Reading) -> Vec<f64> {
    let counts = [reading.propellers.len(), reading.rudders.len()];
    planar::terms(axis, counts).map(|term| term.value(&reading.manoeuvre())).collect()
}

/// Velocities averaged over a short time to either side.
fn averaged(run: &[Reading], half_s: f64) -> Vec<Reading> {
    let mean = |of: &Reading| {
        let from = run.partition_point(|reading| reading.t_s < of.t_s - half_s - 1e-6);
        let to = run.partition_point(|reading| reading.t_s <= of.t_s + half_s + 1e-6);
        let near = &run[from..to];
        let velocity =
            [0, 1, 2].map(|axis| near.iter().map(|reading| reading.velocity[axis]).sum::<f64>() / near.len() as f64);
        Reading { velocity, ..of.clone() }
    };
    run.iter().map(mean).collect()
}
