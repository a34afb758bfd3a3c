//! The report of a flight: one HTML file.

use anyhow::Context;
use backseat_analysis::flight_score::{self, Analysis, Configuration};
use backseat_core::navigation::Sensor;
use backseat_logs::output::{self, Existing};
use backseat_logs::stats::ErrorSummary;
use backseat_report::plots::{
    Ellipse, ErrorPlot, Histogram, Innovation, InnovationPlot, Point, Scale, TimePlot, TrackPlot, error_vs_time,
    histogram, innovations, sheet, time_series, track,
};
use backseat_report::{Provenance, Report, Table};
use hil_sim::ending::Ending;
use hil_sim::flight::FlightLog;
use hil_sim::scenario::Scenario;
use std::path::Path;

/// From a 1-sigma radius of two axes to the radius that holds 95 % of a circular normal error.
const R95_OVER_SIGMA: f64 = 2.447_746_830_680_816;

/// Writes the report.
///
/// # Errors
/// If the file cannot be written.
pub fn write(
    path: &Path,
    scenario: &Scenario,
    flight: &FlightLog,
    analysis: &Analysis,
    ending: Ending,
) -> anyhow::Result<()> {
    let title = format!("Mission {}", scenario.settings.name);
    let mut report = Report::new(title, verdict(scenario, flight, analysis, ending));
    if !ending.is_trustworthy() {
        report = report.alarm(&ending.headline());
    }
    report = report.table(errors_table(analysis));
    if let Some(table) = track_table(analysis) {
        report = report.table(table);
    }
    if !scenario.settings.faults.is_empty() {
        report = report.table(faults_table(scenario));
    }
    report = report
        .table(nis_table(analysis))
        .figure(
            "Track: truth, the backseat's estimate, its own 95 % ellipses and the acoustic paths that it used.",
            map(scenario, flight, analysis),
        )
        .figure(
            "Horizontal error of the backseat against time, and the bound it states itself: 95 % of errors should lie inside.",
            error_figure(analysis.configurations.get(..1).unwrap_or_default(), Scale::Linear),
        )
        .figure(
            "The same measurements through other filters (logarithmic).",
            error_figure(&analysis.configurations, Scale::Log),
        )
        .figure("Depth: truth and estimate.", depth_figure(flight));
    for (sensor, label) in [
        (Sensor::Range, "range innovation [m]"),
        (Sensor::RangeRate, "range rate innovation [m/s]"),
        (Sensor::VehicleGnss, "GNSS innovation [m]"),
    ] {
        if !flight.fusions.iter().any(|record| record.sensor == sensor) {
            continue;
        }
        report = report.figure(
            &format!("Innovations of the backseat: {}.", sensor.name()),
            innovation_figure(flight, sensor, label),
        );
    }
    for sensor in
        [Sensor::Range, Sensor::RangeRate].into_iter().filter(|s| flight.fusions.iter().any(|f| f.sensor == *s))
    {
        report = report.figure("A consistent filter's innovations follow the curve.", distribution(flight, sensor));
    }
    let command: Vec<String> = std::env::args().skip(1).collect();
    report
        .provenance(Provenance {
            command: format!("backseat {}", command.join(" ")).trim_end(),
            seed: Some(scenario.settings.seed),
            version: env!("CARGO_PKG_VERSION"),
        })
        .write(path)
        .with_context(|| path.display().to_string())
}

/// Draws the map and the errors as one picture, SVG, in the place of an earlier one.
///
/// # Errors
/// If the file cannot be written.
pub fn picture(path: &Path, scenario: &Scenario, flight: &FlightLog, analysis: &Analysis) -> anyhow::Result<()> {
    let own = error_figure(analysis.configurations.get(..1).unwrap_or_default(), Scale::Linear);
    let all = error_figure(&analysis.configurations, Scale::Log);
    let picture = sheet(&[&[map(scenario, flight, analysis)], &[own, all]]);
    Ok(output::write(path, Existing::Replace, |file| file.write_all(picture.as_bytes()))?)
}

fn verdict(scenario: &Scenario, flight: &FlightLog, analysis: &Analysis, ending: Ending) -> String {
    if !ending.is_trustworthy() {
        return "The mission was not flown: no figure here says how the backseat navigates.".to_owned();
    }
    let Some(backseat) = analysis.configurations.first() else {
        return "The backseat never had a position.".to_owned();
    };
    let track = analysis.track.as_ref().map_or(String::new(), |track| {
        format!(
            " and kept within {:.2} m of the lines (median; 95 % {:.2} m)",
            track.cross_track.median_m, track.cross_track.p95_m
        )
    });
    let unfinished = if ending == Ending::Flown { "" } else { " The mission was not flown to its end." };
    format!(
        "With{} a DVL, on its own estimate, the horizontal error of the vehicle's position was {:.2} m (median; 95 % {:.2} m) over {:.1} h{track}.{unfinished}",
        if scenario.settings.backseat.dvl { "" } else { "out" },
        backseat.error.median_m,
        backseat.error.p95_m,
        flight.simulated_s / 3600.0,
    )
}

fn errors_table(analysis: &Analysis) -> Table {
    let header = ["navigation", "median [m]", "95 % [m]", "max [m]", "RMS [m]", "own DRMS [m]", "RMS / DRMS"];
    analysis.configurations.iter().fold(Table::new("Horizontal error of position", &header), |table, configuration| {
        let error = &configuration.error;
        let mut cells = vec![configuration.name.to_owned()];
        cells.extend([error.median_m, error.p95_m, error.max_m, error.rms_m].map(|m| format!("{m:.2}")));
        cells.push(configuration.drms_m.map_or(String::new(), |m| format!("{m:.2}")));
        cells.push(configuration.rms_over_drms().map_or(String::new(), |ratio| format!("{ratio:.2}")));
        table.row(cells)
    })
}

fn faults_table(scenario: &Scenario) -> Table {
    let table = Table::new("Injected faults (not known to the backseat)", &["fault"]);
    scenario.settings.faults.iter().fold(table, |table, fault| table.row(vec![fault.to_string()]))
}

fn track_table(analysis: &Analysis) -> Option<Table> {
    let track = analysis.track.as_ref()?;
    let header = ["true track on the lines", "median [m]", "95 % [m]", "max [m]"];
    let row = |name: &str, error: &ErrorSummary| {
        let cells = [error.median_m, error.p95_m, error.max_m].map(|m| format!("{m:.2}"));
        std::iter::once(name.to_owned()).chain(cells).collect::<Vec<_>>()
    };
    Some(
        Table::new("How well it was steered", &header)
            .row(row("cross-track error", &track.cross_track))
            .row(row("depth error", &track.depth)),
    )
}

fn nis_table(analysis: &Analysis) -> Table {
    let sensors = flight_score::sensor_names(&analysis.configurations);
    let header: Vec<&str> = std::iter::once("navigation").chain(sensors.iter().copied()).collect();
    let table = Table::new("Mean normalised innovation squared (1 is consistent), and rejected scalars", &header);
    analysis.configurations.iter().filter(|c| !c.nis.is_empty()).fold(table, |table, configuration| {
        let cells = sensors.iter().map(|sensor| match configuration.nis.get(sensor) {
            Some(nis) => format!("{:.2} ({})", nis.mean(), nis.rejected),
            None => "-".to_owned(),
        });
        table.row(std::iter::once(configuration.name.to_owned()).chain(cells))
    })
}

fn hours(time_us: u64) -> f64 {
    time_us as f64 / 3.6e9
}

fn map(scenario: &Scenario, flight: &FlightLog, analysis: &Analysis) -> String {
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

fn error_figure(configurations: &[Configuration], scale: Scale) -> String {
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

fn depth_figure(flight: &FlightLog) -> String {
    let line = |depth: fn(&hil_sim::flight::Sample) -> f64| -> Vec<Point> {
        flight.samples.iter().map(|s| (hours(s.truth.time_us), depth(s))).collect()
    };
    let (truth, estimate) = (line(|s| s.truth.state[2]), line(|s| s.telemetry.state[2]));
    time_series(&TimePlot { y_label: "depth [m]", series: &[("truth", &truth), ("estimate", &estimate)], band: None })
}

fn innovation_figure(flight: &FlightLog, sensor: Sensor, y_label: &str) -> String {
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

fn distribution(flight: &FlightLog, sensor: Sensor) -> String {
    let records = flight.fusions.iter().filter(|record| record.sensor == sensor);
    let values: Vec<f64> = records.map(|record| record.innovation / record.variance.sqrt()).collect();
    let x_label = format!("{} innovation / its own sigma", sensor.name());
    histogram(&Histogram { x_label: &x_label, values: &values, normal: Some((0.0, 1.0)) })
}
