//! What a run gave, as a report.

use super::estimates;
use super::figures;
use super::result::{Estimate, NavigationResult};
use crate::duration::span;
use crate::{level, provenance};
use backseat_core::state::{X, Y};
use backseat_estimation::filter::FilterRun;
use backseat_logs::stats::{ErrorSummary, median, nis_bounds95};
use backseat_report::{Report, Table};
use serde_json::{Map, Value, json};

/// The report of a run; who writes its page or its track adds their paths as `report` and `track`.
pub fn report(result: &NavigationResult<'_>) -> Report {
    let title = result.log.path.file_name().map_or_else(|| "log".into(), |name| name.to_string_lossy());
    let mut report = provenance::of(Report::new(format!("Navigation of {title}"), answer(result)), None)
        .warnings(&result.health.doubts)
        .values(json(result))
        .figure("Track.", figures::track(result));
    if let Some((caption, figure)) = figures::errors(result) {
        report = report.figure(&caption, figure);
    }
    if let Some((against, error)) = result.error_summary() {
        let header = ["estimate", "median [m]", "95 % [m]", "max [m]", "rms [m]", "samples"];
        let mut table = Table::new(format!("Horizontal error against {}", result.words(against)), &header);
        for (name, error) in [("filtered", Some(error)), ("smoothed", result.smoothed_summary())] {
            let Some(error) = error else { continue };
            let cells = [error.median_m, error.p95_m, error.max_m, error.rms_m].map(|value| format!("{value:.2}"));
            table = table.row([name.to_owned()].into_iter().chain(cells).chain([error.count.to_string()]));
        }
        report = report.table(table);
    }
    if let Estimate::Filter(run) = &result.estimate {
        report = estimates::section(report.table(sensors(run)), run);
    }
    let stated = result.stated();
    if let Some(table) = level::table(&stated) {
        report = report.table(table);
    }
    report = facts(report, result).notes(&result.notes).on_page();
    for (caption, figure) in level::figures(&stated) {
        report = report.figure(&caption, figure);
    }
    match &result.estimate {
        Estimate::Filter(run) => figures::innovations(report, run),
        Estimate::DeadReckoning(_) => report,
    }
}

fn answer(result: &NavigationResult<'_>) -> String {
    let found = match (result.error_summary(), result.estimate.last_m()) {
        (Some((against, ErrorSummary { median_m, p95_m, max_m, .. })), _) => format!(
            "Horizontal error: median {median_m:.2} m, 95 % {p95_m:.2} m, max {max_m:.2} m against {}",
            result.words(against)
        ),
        (None, Some(_)) => format!("{}, and ends at {}", against_fixes(result), last(result)),
        (None, None) => "No position".to_owned(),
    };
    // The word first: whether the track may be used.
    let word = if result.health.doubts.is_empty() { "" } else { "Not to be trusted. " };
    format!("{word}{found}. By {}.", result.description)
}

/// What a log without truth says of the track: how far fixes were from it before they were used.
fn against_fixes(result: &NavigationResult<'_>) -> String {
    let Estimate::Filter(run) = &result.estimate else { return "The track has nothing to compare with".to_owned() };
    let distances: Vec<f64> = figures::gnss_distances(run).iter().map(|(_, distance)| *distance).collect();
    match median(&distances) {
        Some(median_m) => format!(
            "The track was {median_m:.2} m (median) from {} {} before their use, without a truth to compare with",
            distances.len(),
            result.fixes()
        ),
        None => "The track has neither truth nor fixes to compare with".to_owned(),
    }
}

/// Where it ends, and how sure the filter is of it.
fn last(result: &NavigationResult<'_>) -> String {
    let [x_m, y_m] = result.estimate.last_m().unwrap_or([f64::NAN; 2]);
    // No number of fixes or ranges averages these out, and the filter's sigma leaves them out.
    let beside = match result.receiver_bias_m {
        0.0 => String::new(),
        bias_m => format!(", beside slow errors of the receivers of {bias_m} m"),
    };
    let sigma = match &result.estimate {
        Estimate::Filter(run) => run
            .track
            .last()
            .map_or_else(String::new, |s| format!(" (one sigma {:.2} m, {:.2} m{beside})", s.sigma[X], s.sigma[Y])),
        Estimate::DeadReckoning(_) => String::new(),
    };
    format!("x {x_m:.2} m, y {y_m:.2} m{sigma}")
}

fn sensors(run: &FilterRun) -> Table {
    let header = ["sensor", "fused", "rejected", "mean NIS", "95 % if consistent"];
    let mut table = Table::new("Normalised innovations squared (1 if the filter is consistent)", &header);
    for sensor in &run.sensors {
        let nis = sensor.nis.map_or_else(|| "-".to_owned(), |nis| format!("{nis:.3}"));
        let bounds = nis_bounds95(sensor.fused).map_or_else(String::new, |(lo, hi)| format!("{lo:.3} to {hi:.3}"));
        let name = sensor.sensor.name().to_owned();
        table = table.row([name, sensor.fused.to_string(), sensor.rejected.to_string(), nis, bounds]);
    }
    table
}

fn facts(report: Report, result: &NavigationResult<'_>) -> Report {
    let log = &result.log;
    let mut report = report
        .fact(
            "log",
            format!("{} ({}), {} rows, {}", log.path.display(), result.format, log.rows.len(), span(log.duration_s())),
        )
        .fact("final position", last(result));
    if let Estimate::Filter(run) = &result.estimate {
        let distances: Vec<f64> = figures::gnss_distances(run).iter().map(|(_, distance)| *distance).collect();
        if let Some(median_m) = median(&distances) {
            let count = distances.len();
            report = report.fact(
                if log.estimated_fixes.is_some() { "fixes" } else { "GNSS fixes" },
                format!("median {median_m:.2} m from the estimate before their use ({count})"),
            );
        }
        report = report.fact("digest", format!("{:016x}", run.digest));
    }
    // not on the page: the same input gives the same page
    report
        .on_terminal()
        .fact(
            "time",
            format!("{:.3} s ({:.3} s of it reading), {:.0} x real time", result.wall_s, result.read_s, result.rate()),
        )
        .everywhere()
}

/// The JSON object but for what was written.
fn json(result: &NavigationResult<'_>) -> Value {
    let summary = |error: ErrorSummary| {
        json!({"median_m": error.median_m, "p95_m": error.p95_m, "max_m": error.max_m, "rms_m": error.rms_m,
            "samples": error.count})
    };
    let error = result.error_summary().map(|(_, error)| summary(error));
    let smoothed_error = result.smoothed_summary().map(summary);
    let (mut nis, mut fused, mut rejected) = (Map::new(), Map::new(), Map::new());
    let (mut digest, mut estimates) = (Value::Null, Value::Null);
    if let Estimate::Filter(run) = &result.estimate {
        for sensor in &run.sensors {
            nis.insert(sensor.sensor.name().to_owned(), json!(sensor.nis));
            fused.insert(sensor.sensor.name().to_owned(), json!(sensor.fused));
            rejected.insert(sensor.sensor.name().to_owned(), json!(sensor.rejected));
        }
        estimates = estimates::json(run);
        // As text: JSON's numbers are doubles and lose the last bits.
        digest = json!(format!("{:016x}", run.digest));
    }
    let sensors: Map<String, Value> = result
        .health
        .sensors
        .iter()
        .map(|sensor| {
            let value = json!({"refused_share": sensor.refused, "lag_one_correlation": sensor.lag_one});
            (sensor.sensor.name().to_owned(), value)
        })
        .collect();
    let [x_m, y_m] = result.estimate.last_m().unwrap_or([f64::NAN; 2]);
    json!({
        "configuration": result.description,
        "error": error,
        "smoothed_error": smoothed_error,
        "error_against": result.errors.as_ref().map(|(against, _)| against.name()),
        "final": {"x_m": x_m, "y_m": y_m},
        "nis": nis,
        "fused": fused,
        "rejected": rejected,
        "trust": if result.health.doubts.is_empty() { "ok" } else { "suspicious" },
        "doubts": result.health.doubts,
        "health": {"sensors": sensors, "rms_over_drms": result.health.rms_over_drms},
        "estimates": estimates,
        "level": level::json(&result.stated()),
        "simulated_s": result.log.duration_s(),
        "wall_s": result.wall_s,
        "digest": digest,
        "notes": result.notes,
        "report": null,
        "track": null,
    })
}
