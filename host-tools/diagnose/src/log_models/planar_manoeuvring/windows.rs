//! A log cut into windows: how the velocity changes over each, and the integrals of all terms.
//!
//! A change of velocity over some seconds needs no derivative of noisy readings. A window lasts half the time in which
//! the vessel moves by its own length: shorter ones are noise, longer ones average the manoeuvre away.

use super::terms::{self, Reading, Windage};
use backseat_core::state::wrap_angle;
use backseat_data::log::Column;
use backseat_data::stats::median;
use backseat_data::{Log, LogRow};

/// Propellers and rudders that a log may have.
const PROPELLERS: [Column; 3] = [Column::PropRpm, Column::ThrusterLeft, Column::ThrusterRight];
const RUDDERS: [Column; 5] = [Column::Rudder, Column::FinTop, Column::FinBottom, Column::FinPort, Column::FinStarboard];
/// Wind readings older than this do not count, s.
const WIND_HOLDS_S: f64 = 2.0;
/// A longer gap than this many times the usual step ends a window.
const GAP: f64 = 5.0;
/// Slower than this a vessel is held, or moved by whatever there is, m/s.
const SLOWEST_MPS: f64 = 0.05;
/// Share of its highest speed at which a propeller drives.
const DRIVING: f64 = 0.2;
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

/// Propellers and rudders in a log.
pub(super) fn actuators(log: &Log) -> [Vec<Column>; 2] {
    [PROPELLERS.to_vec(), RUDDERS.to_vec()].map(|all| all.into_iter().filter(|column| log.has(*column)).collect())
}

/// All windows under way.
pub(super) fn cut(log: &Log, length_m: f64, windage: Option<Windage>) -> Vec<Window> {
    let runs = readings(log);
    let driven: Vec<f64> =
        runs.iter().flat_map(|(_, run)| run).flat_map(|reading| &reading.propellers).map(|n| n.abs()).collect();
    let most = driven.iter().fold(0.0_f64, |most, n| most.max(*n));
    let drives = |reading: &Reading| {
        reading.velocity[0] > SLOWEST_MPS && reading.propellers.iter().any(|n| n.abs() > DRIVING * most)
    };
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
        let steps: Vec<f64> = run.windows(2).map(|pair| pair[1].t_s - pair[0].t_s).collect();
        let longest_s = GAP * median(&steps).unwrap_or(0.0);
        let mut from = 0;
        while from + 1 < run.len() {
            let to = run.partition_point(|reading| reading.t_s < run[from].t_s + length_s);
            if to >= run.len() {
                break;
            }
            let part = &run[from..=to];
            let is_whole = steps[from..to].iter().all(|step| *step <= longest_s);
            if is_whole && part.iter().all(drives) {
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
    let integral = |of: &dyn Fn(&Reading) -> Vec<f64>| {
        let mut sum: Vec<f64> = Vec::new();
        for pair in part.windows(2) {
            let half_s = 0.5 * (pair[1].t_s - pair[0].t_s);
            let (a, b) = (of(&pair[0]), of(&pair[1]));
            sum.resize(a.len(), 0.0);
            for (sum, (a, b)) in sum.iter_mut().zip(a.iter().zip(&b)) {
                *sum += half_s * (a + b);
            }
        }
        sum
    };
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
        terms: [0, 1, 2].map(|axis| integral(&|reading| terms::of_axis(axis, reading))),
        cross: [cross[0], cross[1]],
        heading_rad: part[part.len() / 2].heading_rad,
        velocity: [0, 1, 2].map(|axis| mean[axis] / length_s),
        wind: <[f64; 4]>::try_from(wind).ok(),
        way,
        measured_mps: first.wind_mps,
    }
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

/// The log's readings run by run; a row needs everything but position and wind.
fn readings(log: &Log) -> Vec<(u32, Vec<Reading>)> {
    let [propellers, rudders] = actuators(log);
    let start_us = log.rows.first().map_or(0, |row| row.time_us);
    let seconds = |row: &LogRow| (row.time_us - start_us) as f64 * 1e-6;
    let winds: Vec<(f64, [f64; 2])> = log
        .rows
        .iter()
        .filter_map(|row| {
            let (speed, from) = (row.get(Column::WindSpeed)?, row.get(Column::WindFrom)?);
            Some((seconds(row), [-speed * from.cos(), -speed * from.sin()]))
        })
        .collect();
    let wind_at = |t_s: f64| {
        let (at_s, wind) = *winds.get(winds.partition_point(|(at_s, _)| *at_s <= t_s).checked_sub(1)?)?;
        (t_s - at_s < WIND_HOLDS_S).then_some(wind)
    };
    let mut runs: Vec<(u32, Vec<Reading>)> = Vec::new();
    for row in &log.rows {
        let reading = || -> Option<Reading> {
            let all = |columns: &[Column]| columns.iter().map(|column| row.get(*column)).collect::<Option<Vec<f64>>>();
            let t_s = seconds(row);
            // rpm as rps, so that terms are of like size for propellers and commands.
            let propellers = all(&propellers)?.into_iter().zip(&propellers);
            let speed = |(value, column): (f64, &Column)| if *column == Column::PropRpm { value / 60.0 } else { value };
            Some(Reading {
                t_s,
                velocity: [row.get(Column::DvlU)?, row.get(Column::DvlV)?, row.get(Column::R)?],
                heading_rad: row.get(Column::Heading)?,
                propellers: propellers.map(speed).collect(),
                rudders: all(&rudders)?,
                position_m: row.gnss_m(),
                wind_mps: wind_at(t_s),
            })
        };
        let Some(mut reading) = reading() else { continue };
        let number = row.get(Column::Run).map_or(1, |number| number as u32);
        if runs.last().is_none_or(|(last, _)| *last != number) {
            runs.push((number, Vec::new()));
        }
        let Some((_, run)) = runs.last_mut() else { continue };
        if let Some(last) = run.last() {
            if reading.t_s <= last.t_s {
                continue;
            }
            reading.heading_rad = last.heading_rad + wrap_angle(reading.heading_rad - last.heading_rad);
        }
        run.push(reading);
    }
    runs
}
