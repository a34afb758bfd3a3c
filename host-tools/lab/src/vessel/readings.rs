//! The readings of a vessel in a log.

use super::planar::Manoeuvre;
use backseat_core::state::wrap_angle;
use backseat_logs::stats::median;
use backseat_logs::{Column, Log, LogRow, VehicleFile};

/// Propellers and rudders that a log may have.
const PROPELLERS: [Column; 3] = [Column::PropRpm, Column::ThrusterLeft, Column::ThrusterRight];
const RUDDERS: [Column; 5] = [Column::Rudder, Column::FinTop, Column::FinBottom, Column::FinPort, Column::FinStarboard];
const VELOCITY: [Column; 3] = [Column::DvlU, Column::DvlV, Column::R];
/// Slower than this a vessel is held, or moved by whatever there is, m/s.
pub const SLOWEST_MPS: f64 = 0.05;
/// Share of its highest speed at which a propeller drives.
const DRIVING: f64 = 0.2;
/// A longer gap than this many times the usual step ends what belongs together.
const GAP: f64 = 5.0;
/// Wind readings older than this do not count, s.
const WIND_HOLDS_S: f64 = 2.0;
/// A velocity that is not logged is the slope of positions and headings over this to either side, s, and two readings
/// at least.
const SLOPE_S: f64 = 1.0;

/// One reading of a vessel.
#[derive(Clone, Debug, Default)]
pub struct Reading {
    /// Since the start of the log, s.
    pub t_s: f64,
    /// Surge, sway, m/s, and yaw rate, rad/s.
    pub velocity: [f64; 3],
    /// Unwrapped within a run, rad.
    pub heading_rad: f64,
    /// Speed of each propeller, rps, or its command.
    pub propellers: Vec<f64>,
    /// Angle of each rudder, rad.
    pub rudders: Vec<f64>,
    /// GNSS position north, east, m.
    pub position_m: Option<[f64; 2]>,
    /// Measured true wind, towards north and east, m/s.
    pub wind_mps: Option<[f64; 2]>,
}

impl Reading {
    /// What the terms of the model are made of.
    #[must_use]
    pub fn manoeuvre(&self) -> Manoeuvre<'_> {
        Manoeuvre { velocity: self.velocity, propellers: &self.propellers, rudders: &self.rudders }
    }
}

/// Propellers and rudders in a log.
#[must_use]
pub fn actuators(log: &Log) -> [Vec<Column>; 2] {
    [PROPELLERS.to_vec(), RUDDERS.to_vec()].map(|all| all.into_iter().filter(|column| log.has(*column)).collect())
}

/// Which of surge, sway and yaw rate a log measures.
#[must_use]
pub fn measured(log: &Log) -> [bool; 3] {
    VELOCITY.map(|column| log.has(column))
}

/// The vessel's length that a log states, or the declared vehicle's, m; and whether it does.
#[must_use]
pub fn length_m(log: &Log, declared: &VehicleFile) -> (f64, bool) {
    let stated = log.column(Column::Length).next();
    stated.map_or((declared.parameters.length_m, false), |(_, length_m)| (length_m, true))
}

/// Whether a reading of these runs is one under way.
pub fn drives(runs: &[(u32, Vec<Reading>)]) -> impl Fn(&Reading) -> bool + use<> {
    let speeds = runs.iter().flat_map(|(_, run)| run).flat_map(|reading| &reading.propellers);
    let most = speeds.fold(0.0_f64, |most, n| most.max(n.abs()));
    move |reading| reading.velocity[0] > SLOWEST_MPS && reading.propellers.iter().any(|n| n.abs() > DRIVING * most)
}

/// The longest time between two readings of a run that belong together, s.
#[must_use]
pub fn longest_step_s(run: &[Reading]) -> f64 {
    let steps: Vec<f64> = run.windows(2).map(|pair| pair[1].t_s - pair[0].t_s).collect();
    GAP * median(&steps).unwrap_or(0.0)
}

/// The log's readings run by run. A row needs the actuators, the heading, and the velocities that the log measures;
/// the others are the slopes of position and heading.
#[must_use]
pub fn readings(log: &Log) -> Vec<(u32, Vec<Reading>)> {
    let [propellers, rudders] = actuators(log);
    let measured = measured(log);
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
            let mut velocity = [0.0; 3];
            for ((velocity, column), is_measured) in velocity.iter_mut().zip(VELOCITY).zip(measured) {
                if is_measured {
                    *velocity = row.get(column)?;
                }
            }
            Some(Reading {
                t_s,
                velocity,
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
    for (_, run) in &mut runs {
        derive(run, measured);
    }
    runs
}

/// Velocities that are not measured, by the slopes around each reading.
fn derive(run: &mut [Reading], measured: [bool; 3]) {
    if measured == [true; 3] {
        return;
    }
    let steps: Vec<f64> = run.windows(2).map(|pair| pair[1].t_s - pair[0].t_s).collect();
    // a little more, so that rounding does not leave out a reading on one side
    let reach_s = SLOPE_S.max(2.5 * median(&steps).unwrap_or(0.0)) + 1e-6;
    let slope = |of: &dyn Fn(&Reading) -> Option<f64>, at_s: f64| {
        let from = run.partition_point(|reading| reading.t_s < at_s - reach_s);
        let near = run[from..].iter().take_while(|reading| reading.t_s <= at_s + reach_s);
        let points: Vec<[f64; 2]> = near.filter_map(|reading| Some([reading.t_s, of(reading)?])).collect();
        let mean = |i: usize| points.iter().map(|point| point[i]).sum::<f64>() / points.len() as f64;
        let [t, y] = [mean(0), mean(1)];
        let squares: f64 = points.iter().map(|point| (point[0] - t).powi(2)).sum();
        let products: f64 = points.iter().map(|point| (point[0] - t) * (point[1] - y)).sum();
        if squares > 0.0 { products / squares } else { 0.0 }
    };
    let velocities: Vec<[f64; 3]> = run
        .iter()
        .map(|reading| {
            let (sin, cos) = reading.heading_rad.sin_cos();
            let [north, east] = [0, 1].map(|axis| slope(&|reading| Some(reading.position_m?[axis]), reading.t_s));
            let turning = slope(&|reading| Some(reading.heading_rad), reading.t_s);
            let slopes = [north * cos + east * sin, east * cos - north * sin, turning];
            [0, 1, 2].map(|axis| if measured[axis] { reading.velocity[axis] } else { slopes[axis] })
        })
        .collect();
    run.iter_mut().zip(velocities).for_each(|(reading, velocity)| reading.velocity = velocity);
}

/// ∫ of several values over some readings, by the trapezoidal rule.
#[must_use]
pub fn integral(part: &[Reading], of: &dyn Fn(&Reading) -> Vec<f64>) -> Vec<f64> {
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
}
