//! Columns that contradict each other: units, signs and axes that the values alone do not betray.

use super::{Finding, velocity};
use crate::log::{Column, Log};
use crate::stats::median;
use backseat_core::state::wrap_angle;

/// Time over which changes are compared, s: longer than the lag between sensors, shorter than a manoeuvre.
const WINDOW_S: f64 = 3.0;
/// Fewest windows to compare.
const ENOUGH: usize = 40;
/// A column in degrees is 57.3 times one in radians.
const OTHER_UNIT: f64 = 15.0;

/// Compares what columns say of one motion; columns that are found out of range are left out.
pub(super) fn check(log: &Log, before: &[Finding]) -> Vec<Finding> {
    let is_doubted =
        |columns: &[Column]| before.iter().any(|f| f.column.is_none_or(|column| columns.contains(&column)));
    let mut findings = Vec::new();
    if before.iter().any(|f| f.column.is_none()) {
        return findings; // the times are wrong
    }
    let windows = Windows::of(log);
    if !is_doubted(&[Column::Heading, Column::R]) {
        findings.extend(rate_of_angle(&windows, Column::Heading, Column::R));
    }
    if !is_doubted(&[Column::Pitch, Column::Q]) {
        findings.extend(rate_of_angle(&windows, Column::Pitch, Column::Q));
    }
    if !is_doubted(&[Column::Roll, Column::P]) {
        findings.extend(rate_of_angle(&windows, Column::Roll, Column::P));
    }
    if !is_doubted(&[Column::Pitch, Column::Depth]) {
        findings.extend(pitch_of_dive(&windows));
    }
    if !is_doubted(&[Column::GpsX, Column::GpsY, Column::Heading]) {
        findings.extend(course(log));
    }
    let is_named = |column: Column| findings.iter().any(|finding: &Finding| finding.column == Some(column));
    let of_velocity = [Column::Depth, Column::Roll, Column::Pitch, Column::Heading, Column::DvlU, Column::DvlV];
    if !is_doubted(&of_velocity) && !is_doubted(&[Column::DvlW]) && !is_named(Column::GpsX) {
        findings.extend(velocity::check(log));
    }
    findings.extend(path_speed(log, is_doubted(&[Column::GpsX, Column::GpsY])));
    findings.extend(travel_time(log));
    findings
}

/// (window, first time in s, first value, mean).
type Window = (u64, f64, f64, f64);

/// First and mean sample of some columns by window.
struct Windows {
    columns: Vec<(Column, Vec<Window>)>,
}

impl Windows {
    fn of(log: &Log) -> Self {
        let wanted = [Column::Roll, Column::P, Column::Pitch, Column::Q, Column::Heading, Column::R, Column::Depth];
        let windows = |column| {
            let mut found: Vec<Window> = Vec::new();
            let mut count = 0.0;
            for (time_us, value) in log.column(column) {
                let (t_s, window) = (time_us as f64 * 1e-6, (time_us as f64 * 1e-6 / WINDOW_S) as u64);
                match found.last_mut() {
                    Some((last, _, _, mean)) if *last == window => {
                        count += 1.0;
                        *mean += (value - *mean) / count;
                    }
                    _ => {
                        count = 1.0;
                        found.push((window, t_s, value, value));
                    }
                }
            }
            found
        };
        Self { columns: wanted.into_iter().map(|column| (column, windows(column))).collect() }
    }

    fn get(&self, column: Column) -> &[Window] {
        self.columns.iter().find(|(other, _)| *other == column).map_or(&[], |(_, windows)| windows)
    }

    /// (change of `angle` per second, mean of `other`) of each window that both have and the next window follows.
    fn changes(&self, angle: Column, other: Column, wrap: bool) -> Vec<(f64, f64)> {
        let others = self.get(other);
        let mean = |window: u64| others.binary_search_by_key(&window, |w| w.0).ok().map(|place| others[place].3);
        let pairs = self.get(angle).windows(2).filter(|pair| pair[1].0 == pair[0].0 + 1);
        pairs
            .filter_map(|pair| {
                let change = pair[1].2 - pair[0].2;
                let change = if wrap { wrap_angle(change) } else { change };
                Some((change / (pair[1].1 - pair[0].1).max(1e-3), mean(pair[0].0)?))
            })
            .collect()
    }
}

/// Slope of y on x through zero and correlation, of those pairs whose x is not small; `None` with too few.
fn slope(pairs: &[(f64, f64)], smallest_x: f64) -> Option<(f64, f64)> {
    let used: Vec<_> = pairs.iter().filter(|(_, x)| x.abs() > smallest_x).collect();
    if used.len() < ENOUGH {
        return None;
    }
    let sum = |of: fn(&(f64, f64)) -> f64| used.iter().map(|pair| of(pair)).sum::<f64>();
    let (xx, xy, yy) = (sum(|p| p.1 * p.1), sum(|p| p.0 * p.1), sum(|p| p.0 * p.0));
    Some((xy / xx, xy / (xx * yy).sqrt().max(f64::MIN_POSITIVE)))
}

/// Whether y falls with x, by at least half of it and beyond chance: few turns tell the sign of a rate, whatever the noise
/// between them.
fn is_reversed(pairs: &[(f64, f64)]) -> bool {
    const STANDARD_ERRORS: f64 = 6.0;
    if pairs.len() < ENOUGH {
        return false;
    }
    let sum = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>();
    let (xx, xy, yy) = (sum(|p| p.1 * p.1), sum(|p| p.0 * p.1), sum(|p| p.0 * p.0));
    let slope = xy / xx;
    let sigma = ((yy - slope * xy).max(0.0) / xx / pairs.len() as f64).sqrt();
    slope < -0.5 && slope + STANDARD_ERRORS * sigma < 0.0
}

/// The angle must change as its rate says.
fn rate_of_angle(windows: &Windows, angle: Column, rate: Column) -> Option<Finding> {
    let pairs = windows.changes(angle, rate, true);
    let (angle_name, rate_name) = (angle.name(), rate.name());
    let turns = slope(&pairs, 0.01);
    if is_reversed(&pairs) || turns.is_some_and(|(_, correlation)| correlation < -0.6) {
        let message = format!("{rate_name} is positive where {angle_name} falls: one of the two has the wrong sign");
        return Some(Finding::suspicious(rate, message));
    }
    let (slope, _) = turns.filter(|(_, correlation)| *correlation >= 0.6)?;
    let message = if slope < 1.0 / OTHER_UNIT {
        format!("{rate_name} is {:.0} times the change of {angle_name}: is it in degrees per second?", 1.0 / slope)
    } else if slope > OTHER_UNIT {
        format!("{angle_name} changes {slope:.0} times as fast as {rate_name} says: is it in degrees?")
    } else {
        return None;
    };
    Some(Finding::suspicious(rate, message))
}

/// A torpedo dives with its nose down: depth grows as −u sin θ.
fn pitch_of_dive(windows: &Windows) -> Option<Finding> {
    let pairs: Vec<(f64, f64)> = windows
        .changes(Column::Depth, Column::Pitch, false)
        .into_iter()
        .filter(|(rate, _)| rate.abs() > 0.05)
        .collect();
    let (slope, correlation) = slope(&pairs, 0.05)?;
    (correlation > 0.7 && slope > 0.2).then(|| {
        let message = "pitch_rad is positive (nose up) where depth_m grows: pitch or depth has the wrong sign";
        Finding::suspicious(Column::Pitch, message)
    })
}

/// Steps between fixes: seconds, north and east, heading in the middle.
fn fix_steps(log: &Log, shortest_m: f64) -> Vec<(f64, [f64; 2], Option<f64>)> {
    let mut steps = Vec::new();
    let (mut last, mut sum): (Option<(u64, [f64; 2])>, [f64; 2]) = (None, [0.0; 2]);
    for row in &log.rows {
        if let Some(heading) = row.get(Column::Heading) {
            let (sin, cos) = heading.sin_cos();
            sum = [sum[0] + cos, sum[1] + sin];
        }
        let Some(fix) = row.gnss_m() else { continue };
        let Some((before_us, before)) = last else {
            (last, sum) = (Some((row.time_us, fix)), [0.0; 2]);
            continue;
        };
        let way = [fix[0] - before[0], fix[1] - before[1]];
        let dt_s = (row.time_us - before_us) as f64 * 1e-6;
        if way[0].hypot(way[1]) < shortest_m && dt_s < 60.0 {
            continue;
        }
        let heading = (sum != [0.0; 2]).then(|| sum[1].atan2(sum[0]));
        steps.push((dt_s, way, heading));
        (last, sum) = (Some((row.time_us, fix)), [0.0; 2]);
    }
    steps
}

/// The course over ground follows the heading; mirrored, it follows its mirror image about north-east.
fn course(log: &Log) -> Option<Finding> {
    let steps: Vec<(f64, f64)> = fix_steps(log, 8.0)
        .into_iter()
        .filter(|(dt_s, way, _)| *dt_s < 60.0 && way[0].hypot(way[1]) >= 8.0)
        .filter_map(|(_, way, heading)| Some((way[1].atan2(way[0]), heading?)))
        .collect();
    if steps.len() < 20 {
        return None;
    }
    let mean = |of: fn(f64, f64) -> f64| {
        steps.iter().map(|&(course, h)| of(course, h).cos()).sum::<f64>() / steps.len() as f64
    };
    let along = mean(|course, heading| course - heading);
    let mirrored = mean(|course, heading| course + heading - std::f64::consts::FRAC_PI_2);
    let message = if mirrored > 0.8 && along < 0.5 {
        "gps_x_m, gps_y_m move along the mirror image of heading_rad: are latitude and longitude (x and y) swapped, or is \
         the heading counted from east?"
    } else if along < -0.8 {
        "gps_x_m, gps_y_m move against heading_rad: the vehicle drives astern, or the heading is turned by half a turn"
    } else {
        return None;
    };
    Some(Finding::suspicious(Column::GpsX, message))
}

/// Speed between fixes beside the speed that is logged: the units of position and time.
fn path_speed(log: &Log, is_doubted: bool) -> Option<Finding> {
    if is_doubted {
        return None;
    }
    let speeds: Vec<f64> = fix_steps(log, 8.0)
        .into_iter()
        .filter(|(dt_s, ..)| *dt_s > 0.0 && *dt_s < 600.0)
        .map(|(dt_s, way, _)| way[0].hypot(way[1]) / dt_s)
        .collect();
    let typical = median(&speeds).filter(|_| speeds.len() >= 10)?;
    let logged: Vec<f64> = [Column::DvlU, Column::SpeedLog]
        .into_iter()
        .find(|column| log.has(*column))
        .map(|column| log.column(column).map(|(_, speed)| speed.abs()).collect())
        .unwrap_or_default();
    let message = match median(&logged).filter(|speed| *speed > 0.3) {
        Some(logged) if !(logged / 8.0..logged * 8.0).contains(&typical) => format!(
            "gps_x_m, gps_y_m move at {typical:.3} m/s where the log has {logged:.2} m/s: a unit of position, time or speed is wrong"
        ),
        None if typical > 12.0 => {
            format!("gps_x_m, gps_y_m move at {typical:.0} m/s: a unit of position or time is wrong")
        }
        _ => return None,
    };
    Some(Finding::suspicious(Column::GpsX, message))
}

/// Range over travel time is the speed of sound.
fn travel_time(log: &Log) -> Option<Finding> {
    let speeds: Vec<f64> = log
        .rows
        .iter()
        .filter_map(|row| Some((row.get(Column::Range)?, row.get(Column::Toa)? - row.get(Column::Tol)?)))
        .filter(|(range_m, travel_s)| *range_m > 20.0 && *travel_s > 0.0)
        .map(|(range_m, travel_s)| range_m / travel_s)
        .collect();
    let speed = median(&speeds).filter(|_| speeds.len() >= 5)?;
    if (1300.0..1700.0).contains(&speed) {
        return None;
    }
    let message =
        format!("range_m over (toa_s - tol_s) is {speed:.0} m/s, not the speed of sound: units, or two clocks?");
    Some(Finding::suspicious(Column::Range, message))
}
