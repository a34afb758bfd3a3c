//! Figures of a flight.

use crate::flight_score::{Analysis, Configuration};
use crate::level::Stated;
use backseat_core::navigation::Sensor;
use backseat_report::plots::{
    Ellipse, ErrorPlot, Histogram, Innovation, InnovationPlot, Point, Scale, TimePlot, TrackPlot, error_vs_time,
    histogram, innovations, time_series, track,
};
use hil_sim::flight::FlightLog;
use hil_sim::scenario::Scenario;

/// From a 1-sigma radius of two axes to the radius that holds 95 % of a circular normal error.
const R95_OVER_SIGMA: f64 = 2.447_746_830_680_816;

fn hours(time_us: u64) -> f64 {
    time_us as f64 / 3.6e9
}

pub fn map(scenario: &Scenario, flight: &FlightLog, analysis: &Analysis) -> String {
    let truth: Vec<Point> = flight.samples.iter().map(|s| (s.truth.state[0], s.truth.state[1])).collect();
    let ship: Vec<Point> = flight.samples.iter().map(|s| (s.ship.position_m[0], s.ship.position_m[1])).collect();
    let waypoints: Vec<Point> = scenario.settings.waypoints().iter().map(|w| (w.x_m, w.y_m)).collect();
    let paths: Vec<(Point, Point)> = flight.packets.iter().map(|([a, b], [c, d])| ((*a, *b), (*c, *d))).collect();
    let (mut estimate, mut ellipses) = (Vec::new(), Vec::new());
    for sample in analysis.configurations.first().map_or(&[][..], |c| &c.track) {
        let [x_m, y_m] = sample.position_m;
        estimate.push((x_m, y_m));
        if let Some([xx_m2, xy_m2, yy_m2]) = sample.covariance_m2 {
            ellipses.push(Ellipse { x_m, y_m, xx_m2, xy_m2, yy_m2 });
        }
    }
    track(&TrackPlot {
        truth: Some(&truth),
        estimates: &[("backseat's estimate", &estimate)],
        ellipses: &ellipses,
        acoustic_paths: &paths,
        ship: Some(&ship),
        waypoints: &waypoints,
    })
}

pub fn errors(configurations: &[Configuration], scale: Scale) -> String {
    let lines: Vec<(&str, Vec<Point>)> = configurations
        .iter()
        .map(|c| (c.name, c.track.iter().map(|sample| (hours(sample.time_us), sample.error_m)).collect()))
        .collect();
    let series: Vec<(&str, &[Point])> = lines.iter().map(|(name, points)| (*name, points.as_slice())).collect();
    let bound: Vec<Point> = configurations.first().map_or(Vec::new(), |c| {
        let with_covariance = c.track.iter().filter_map(|sample| Some((sample.time_us, sample.covariance_m2?)));
        with_covariance
            .map(|(time_us, [xx, _, yy])| (hours(time_us), R95_OVER_SIGMA * (0.5 * (xx + yy)).sqrt()))
            .collect()
    });
    error_vs_time(&ErrorPlot {
        y_label: "horizontal error [m]",
        series: &series,
        bound: Some(("the backseat's own 95 % bound", &bound)),
        scale,
    })
}

/// What the backseat stated, beside its errors.
pub fn stated(flight: &FlightLog) -> Vec<Stated> {
    let known = flight.samples.iter().filter(|sample| sample.telemetry.level_m[0] > 0.0);
    known
        .map(|sample| {
            let ([x, y, z, ..], [true_x, true_y, true_z, ..]) = (sample.telemetry.state, sample.truth.state);
            Stated {
                time_us: sample.telemetry.time_us,
                level_m: sample.telemetry.level_m.map(f64::from),
                error_m: [(x - true_x).hypot(y - true_y), (z - true_z).abs()],
            }
        })
        .collect()
}

pub fn depth(flight: &FlightLog) -> String {
    let line = |depth: fn(&hil_sim::flight::FlightSample) -> f64| -> Vec<Point> {
        flight.samples.iter().map(|s| (hours(s.truth.time_us), depth(s))).collect()
    };
    let (truth, estimate) = (line(|s| s.truth.state[2]), line(|s| s.telemetry.state[2]));
    time_series(&TimePlot { y_label: "depth [m]", series: &[("truth", &truth), ("estimate", &estimate)], band: None })
}

pub fn innovation(flight: &FlightLog, sensor: Sensor, y_label: &str) -> String {
    let points: Vec<Innovation> = flight
        .fusions
        .iter()
        .filter(|record| record.sensor == sensor)
        .map(|record| Innovation {
            t_h: hours(record.time_us),
            value: record.innovation,
            sigma: record.variance.sqrt(),
            fused: record.fused,
        })
        .collect();
    innovations(&InnovationPlot { y_label, innovations: &points })
}

pub fn distribution(flight: &FlightLog, sensor: Sensor) -> String {
    let records = flight.fusions.iter().filter(|record| record.sensor == sensor);
    let values: Vec<f64> = records.map(|record| record.innovation / record.variance.sqrt()).collect();
    let x_label = format!("{} innovation / its own sigma", sensor.name());
    histogram(&Histogram { x_label: &x_label, values: &values, normal: Some((0.0, 1.0)) })
}
