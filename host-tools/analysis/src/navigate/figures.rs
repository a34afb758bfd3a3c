//! Figures of a run.

use super::result::{Against, Estimate, NavigationResult};
use backseat_core::navigation::{FusionOutcome, Sensor};
use backseat_core::state::{X, Y};
use backseat_estimation::filter::FilterRun;
use backseat_report::Report;
use backseat_report::plots::{
    self, Ellipse, ErrorPlot, Histogram, Innovation, InnovationPlot, Point, Scale, TrackPlot,
};

/// Ellipses offered to the map, which thins them out itself.
const ELLIPSES: usize = 200;

/// Time without samples across which no line is drawn, µs.
const MISSING_US: u64 = 60_000_000;

/// Innovations shown, with their names and units.
const SHOWN: [(Sensor, &[&str]); 9] = [
    (Sensor::Range, &["range innovation [m]"]),
    (Sensor::RangeRate, &["range rate innovation [m/s]"]),
    (Sensor::BottomTrack, &["DVL u innovation [m/s]", "DVL v innovation [m/s]", "DVL w innovation [m/s]"]),
    (Sensor::Attitude, &["roll innovation [rad]", "pitch innovation [rad]", "heading innovation [rad]"]),
    (Sensor::Rates, &["p innovation [rad/s]", "q innovation [rad/s]", "r innovation [rad/s]"]),
    (Sensor::Depth, &["depth innovation [m]"]),
    (Sensor::VehicleGnss, &["GNSS north innovation [m]", "GNSS east innovation [m]"]),
    (Sensor::ShipGnss, &["ship GNSS north innovation [m]", "ship GNSS east innovation [m]"]),
    (Sensor::WaterTrack, &["water track u innovation [m/s]", "water track v innovation [m/s]"]),
];

/// Estimate, truth, fixes and ship on a map.
pub fn track(outcome: &NavigationResult<'_>) -> String {
    let estimate: Vec<Point> =
        outcome.estimate.positions().iter().map(|p| (p.position_m[0], p.position_m[1])).collect();
    let truth: Option<Vec<Point>> =
        outcome.truth.map(|truth| truth.rows.iter().map(|row| (row.state[X], row.state[Y])).collect());
    let fixes: Vec<Point> = outcome.log.rows.iter().filter_map(|row| row.gnss_m()).map(|[x, y]| (x, y)).collect();
    let ship: Vec<Point> = outcome.log.rows.iter().filter_map(|row| row.ship_gnss_m()).map(|[x, y]| (x, y)).collect();
    let ellipses: Vec<Ellipse> = match &outcome.estimate {
        Estimate::Filter(run) => run
            .track
            .iter()
            .step_by((run.track.len() / ELLIPSES).max(1))
            .map(|s| Ellipse {
                x_m: s.state[X],
                y_m: s.state[Y],
                xx_m2: s.sigma[X] * s.sigma[X],
                xy_m2: s.cov_xy_m2,
                yy_m2: s.sigma[Y] * s.sigma[Y],
            })
            .collect(),
        Estimate::DeadReckoning(_) => Vec::new(),
    };
    let mut lines: Vec<plots::Series<'_>> = vec![("estimate", &estimate)];
    let smoothed: Vec<Point> =
        outcome.estimate.smoothed().unwrap_or_default().iter().map(|s| (s.state[X], s.state[Y])).collect();
    if !smoothed.is_empty() {
        lines.push(("smoothed", &smoothed));
    }
    if matches!(outcome.estimate, Estimate::DeadReckoning(_)) {
        lines.push(("GNSS", &fixes));
    }
    plots::track(&TrackPlot {
        truth: truth.as_deref(),
        estimates: &lines,
        ellipses: &ellipses,
        ship: (!ship.is_empty()).then_some(&ship),
        ..TrackPlot::default()
    })
}

/// Errors against time with the filter's own statement of them, and the caption; nothing without a reference.
pub fn errors(outcome: &NavigationResult<'_>) -> Option<(String, String)> {
    let (name, caption, errors) = match (&outcome.errors, &outcome.estimate) {
        (Some((Against::Truth, errors)), _) => ("against the truth", "Error against time.", errors.clone()),
        (Some((Against::Gnss, errors)), _) => {
            ("against withheld fixes", "Distance to the fixes against time.", errors.clone())
        }
        (None, Estimate::Filter(run)) => (
            "to each fix before its use",
            "Distance to the fixes against time; it has their noise in it, the band has not.",
            gnss_distances(run),
        ),
        (None, Estimate::DeadReckoning(_)) => return None,
    };
    let bound: Vec<Point> = match &outcome.estimate {
        Estimate::Filter(run) => run.track.iter().map(|s| (hours(s.time_us), 2.0 * s.drms_m())).collect(),
        Estimate::DeadReckoning(_) => Vec::new(),
    };
    let has_bound = !bound.is_empty();
    let error = broken_line(&errors);
    let mut series: Vec<plots::Series<'_>> = vec![(name, &error)];
    let smoothed = outcome.smoothed_errors.as_deref().map(broken_line);
    if let Some(smoothed) = &smoothed {
        series.push(("smoothed", smoothed));
    }
    let plot = ErrorPlot {
        y_label: "horizontal error [m]",
        series: &series,
        bound: has_bound.then_some(("the filter's own 2 DRMS", &bound)),
        scale: Scale::Linear,
    };
    let about = if has_bound { " 2 DRMS holds 95 to 98 % of the errors of a consistent filter." } else { "" };
    Some((format!("{caption}{about}"), plots::error_vs_time(&plot)))
}

/// Points in hours; the line breaks where samples are missing.
fn broken_line(errors: &[(u64, f64)]) -> Vec<Point> {
    let mut points = Vec::with_capacity(errors.len());
    let mut previous_us = None;
    for &(time_us, error) in errors {
        if previous_us.is_some_and(|previous_us| time_us - previous_us > MISSING_US) {
            points.push((hours(time_us), f64::NAN));
        }
        points.push((hours(time_us), error));
        previous_us = Some(time_us);
    }
    points
}

/// Innovations of every sensor against time, and their distributions.
pub fn innovations(report: Report, run: &FilterRun) -> Report {
    let mut report = report.section("Innovations");
    for (sensor, labels) in SHOWN {
        for (axis, y_label) in labels.iter().enumerate() {
            let innovations: Vec<Innovation> = run
                .fusions
                .iter()
                .filter(|record| record.sensor == sensor && usize::from(record.axis) == axis)
                .map(|record| Innovation {
                    t_h: hours(record.time_us),
                    value: record.innovation,
                    sigma: record.variance.sqrt(),
                    fused: record.outcome == FusionOutcome::Fused,
                })
                .collect();
            if !innovations.is_empty() {
                let svg = plots::innovations(&InnovationPlot { y_label, innovations: &innovations });
                report = report.figure("With the band of two of its own sigmas.", svg);
            }
        }
    }
    for (sensor, _) in SHOWN {
        let ratios: Vec<f64> = run
            .fusions
            .iter()
            .filter(|record| record.sensor == sensor)
            .map(|record| record.innovation / record.variance.sqrt())
            .collect();
        if !ratios.is_empty() {
            let x_label = format!("{} innovation / its own sigma", sensor.name());
            let svg = plots::histogram(&Histogram { x_label: &x_label, values: &ratios, normal: Some((0.0, 1.0)) });
            report = report.figure("A consistent filter's innovations follow the curve.", svg);
        }
    }
    report
}

/// (time µs, m) of every fix of the vehicle from the estimate before its use, from both innovations.
pub fn gnss_distances(run: &FilterRun) -> Vec<(u64, f64)> {
    let of_gnss = || run.fusions.iter().filter(|record| record.sensor == Sensor::VehicleGnss);
    of_gnss()
        .zip(of_gnss().skip(1))
        .filter(|(x, y)| (x.axis, y.axis) == (0, 1) && x.time_us == y.time_us)
        .map(|(x, y)| (x.time_us, x.innovation.hypot(y.innovation)))
        .collect()
}

fn hours(time_us: u64) -> f64 {
    time_us as f64 / 3.6e9
}
