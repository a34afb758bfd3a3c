//! A flight that was judged, as a report.

use super::figures;
use super::flown::{Flown, REPORT, SESSION};
use super::named;
use super::topside_score;
use crate::flight_score::{self, Analysis, Configuration};
use crate::track_score::TrackScore;
use crate::{level, provenance};
use backseat_core::navigation::Sensor;
use backseat_logs::stats::ErrorSummary;
use backseat_report::plots::{Scale, sheet};
use backseat_report::{Report, Table};
use hil_sim::ending::Ending;
use hil_sim::scenario::Scenario;
use serde_json::{Map, Value, json};

/// The report of a flight.
pub fn report(flown: &Flown) -> Report {
    let Flown { scenario, flight, analysis, ending, .. } = flown;
    let mut report = Report::new(format!("Mission {}", scenario.settings.name), verdict(flown)).values(json(flown));
    if !ending.is_trustworthy() {
        report = report.alarm(&ending.headline());
    }
    if let Some(late) = late(flown) {
        report = report.alarm(&late);
    }
    report = report.figure(
        "Track: truth, the backseat's estimate, its own 95 % ellipses and the acoustic paths that it used.",
        figures::map(scenario, flight, analysis),
    );
    if *ending != Ending::NotFlown {
        report = report.table(errors_table(flown));
    }
    let stated = figures::stated(flight);
    if let Some(table) = level::table(&stated) {
        report = report.table(table);
    }
    if let Some(table) = named::table(flown) {
        report = report
            .table(table)
            .on_terminal()
            .text("What the log of this flight says of it, some minutes for each hour:")
            .command(&named::command(flown))
            .everywhere();
    }
    if !scenario.settings.faults.is_empty() {
        report = report.table(faults_table(scenario));
    }
    if analysis.configurations.iter().any(|configuration| !configuration.nis.is_empty()) {
        report = report.table(nis_table(analysis));
    }
    report = said_on_a_terminal(report, flown)
        .on_page()
        .figure(
            "Horizontal error of the backseat against time, and the bound it states itself: 95 % of errors should lie inside.",
            figures::errors(analysis.configurations.get(..1).unwrap_or_default(), Scale::Linear),
        )
        .figure(
            "The same measurements through other filters (logarithmic).",
            figures::errors(&analysis.configurations, Scale::Log),
        )
        .figure("Depth: truth and estimate.", figures::depth(flight));
    for (caption, figure) in level::figures(&stated) {
        report = report.figure(&caption, figure);
    }
    let has = |sensor: Sensor| flight.fusions.iter().any(|record| record.sensor == sensor);
    let labels = [
        (Sensor::Range, "range innovation [m]"),
        (Sensor::RangeRate, "range rate innovation [m/s]"),
        (Sensor::VehicleGnss, "GNSS innovation [m]"),
    ];
    for (sensor, label) in labels.into_iter().filter(|(sensor, _)| has(*sensor)) {
        let caption = format!("Innovations of the backseat: {}.", sensor.name());
        report = report.figure(&caption, figures::innovation(flight, sensor, label));
    }
    for sensor in [Sensor::Range, Sensor::RangeRate].into_iter().filter(|sensor| has(*sensor)) {
        let figure = figures::distribution(flight, sensor);
        report = report.figure("A consistent filter's innovations follow the curve.", figure);
    }
    provenance::of(report, Some(scenario.settings.seed))
}

/// Map and errors as one picture, SVG.
pub fn picture(flown: &Flown) -> String {
    let Flown { scenario, flight, analysis, .. } = flown;
    let own = figures::errors(analysis.configurations.get(..1).unwrap_or_default(), Scale::Linear);
    let all = figures::errors(&analysis.configurations, Scale::Log);
    sheet(&[&[figures::map(scenario, flight, analysis)], &[own, all]])
}

/// What is to be said of a backseat that did not keep time.
fn late(flown: &Flown) -> Option<String> {
    let flight = &flown.flight;
    (flight.late_steps > 0).then(|| {
        format!(
            "LATE: {} steps of the backseat came late, the latest by {:.0} ms: this computer is too busy for real time",
            flight.late_steps,
            1e3 * flight.latest_step_s
        )
    })
}

fn verdict(flown: &Flown) -> String {
    let Flown { scenario, flight, analysis, ending, .. } = flown;
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
    let unfinished = if *ending == Ending::Flown { "" } else { " The mission was not flown to its end." };
    format!(
        "With{} a DVL, on its own estimate, the horizontal error of the vehicle's position was {:.2} m (median; 95 % {:.2} m) over {:.1} h{track}.{unfinished}",
        if scenario.settings.backseat.dvl { "" } else { "out" },
        backseat.error.median_m,
        backseat.error.p95_m,
        flight.simulated_s / 3600.0,
    )
}

/// Errors of every way to navigate, of steering, and of what topside knew.
fn errors_table(flown: &Flown) -> Table {
    let Flown { flight, companions, analysis, .. } = flown;
    let cells = |error: &ErrorSummary| [error.median_m, error.p95_m, error.max_m].map(|m| format!("{m:.2}"));
    let header = ["horizontal error [m]", "median", "95 %", "max", "RMS/DRMS"];
    let mut table = Table::new("", &header);
    for configuration in &analysis.configurations {
        let ratio = configuration.rms_over_drms().map_or("-".into(), |ratio| format!("{ratio:.2}"));
        let name = configuration.name.to_owned();
        table = table.row([name].into_iter().chain(cells(&configuration.error)).chain([ratio]));
    }
    if let Some(TrackScore { cross_track, depth, .. }) = &analysis.track {
        let rows = [("true cross-track error on the lines", cross_track), ("true depth error on the lines", depth)];
        for (name, error) in rows {
            table = table.row([name.to_owned()].into_iter().chain(cells(error)));
        }
    }
    topside_score::rows(flight, companions)
        .into_iter()
        .fold(table, |table, (name, error)| table.row([name].into_iter().chain(error.map(|m| format!("{m:.2}")))))
}

fn faults_table(scenario: &Scenario) -> Table {
    let table = Table::new("Injected faults (not known to the backseat)", &["fault"]);
    scenario.settings.faults.iter().fold(table, |table, fault| table.row(vec![fault.to_string()]))
}

fn nis_table(analysis: &Analysis) -> Table {
    let sensors = flight_score::sensor_names(&analysis.configurations);
    let header: Vec<&str> = std::iter::once("navigation").chain(sensors.iter().copied()).collect();
    let table = Table::new("Mean NIS: 1 is consistent (rejected scalars)", &header);
    analysis.configurations.iter().filter(|c| !c.nis.is_empty()).fold(table, |table, configuration| {
        let cells = sensors.iter().map(|sensor| match configuration.nis.get(sensor) {
            Some(nis) => format!("{:.2} ({})", nis.mean(), nis.rejected),
            None => "-".to_owned(),
        });
        table.row(std::iter::once(configuration.name.to_owned()).chain(cells))
    })
}

/// What differs from run to run, and the paths of the files: on a page it would be other bytes each time.
fn said_on_a_terminal(report: Report, flown: &Flown) -> Report {
    let Flown { folder, trial, flight, ending, .. } = flown;
    let ended = if ending.is_trustworthy() { ending.headline() } else { ending.name().to_owned() };
    let report = report.on_terminal().text(&format!(
        "{ended}: {:.0} s in {:.1} s, {:.0} times real time",
        flight.simulated_s,
        flight.wall_s,
        flight.simulated_s / flight.wall_s
    ));
    let report = report
        .fact("digest", format!("{:016x}", flight.digest))
        .fact("log", folder.join("log.csv").display().to_string())
        .fact("session", folder.join(SESSION).display().to_string())
        .fact("report", folder.join(REPORT).display().to_string());
    match trial {
        Some(trial) => {
            report.fact("trial", format!("{}, to be joined by backseat navigate --ship --modem", trial.display()))
        }
        None => report,
    }
}

fn json(flown: &Flown) -> Value {
    let Flown { flight, companions, analysis, ending, .. } = flown;
    let configurations: Vec<Value> = analysis
        .configurations
        .iter()
        .map(|configuration| {
            let error = &configuration.error;
            json!({
                "name": configuration.name,
                "median_m": error.median_m,
                "p95_m": error.p95_m,
                "max_m": error.max_m,
                "rms_m": error.rms_m,
                "drms_m": configuration.drms_m,
                "nis": nis(configuration),
            })
        })
        .collect();
    let track = |pick: fn(&TrackScore) -> &ErrorSummary| {
        analysis.track.as_ref().map(|track| json!({"median": pick(track).median_m, "p95": pick(track).p95_m}))
    };
    json!({
        "configurations": configurations,
        "cross_track_m": track(|track| &track.cross_track),
        "depth_m": track(|track| &track.depth),
        "nis": analysis.configurations.first().map(nis),
        "level": level::json(&figures::stated(flight)),
        "naming": named::json(flown),
        "topside": topside_score::json(flight),
        "companions": companions.iter().map(topside_score::companion_json).collect::<Vec<_>>(),
        "finished": matches!(ending, Ending::Flown),
        "ending": ending.name(),
        "trust": if flown.is_trustworthy() { "ok" } else { "suspicious" },
        "late_steps": flight.late_steps,
        "latest_step_s": flight.latest_step_s,
        "simulated_s": flight.simulated_s,
        "wall_s": flight.wall_s,
        "digest": format!("{:016x}", flight.digest),
    })
}

fn nis(configuration: &Configuration) -> Value {
    let means = configuration.nis.iter().map(|(sensor, nis)| ((*sensor).to_owned(), json!(nis.mean())));
    Value::Object(means.collect::<Map<String, Value>>())
}
