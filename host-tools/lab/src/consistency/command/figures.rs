//! Figures: normalised errors over time with their band, errors beside their bounds.

use super::{Args, ConsistencyRow, QUANTITIES};
use anyhow::Context;
use backseat_report::plots::{ErrorPlot, Point, Scale, TimePlot, error_vs_time, time_series};
use backseat_report::{Provenance, Report};
use std::path::Path;

/// Averages over so many seconds are drawn as one point.
const AVERAGED_S: usize = 10;

fn hours(time_s: f64) -> f64 {
    time_s / 3600.0
}

/// ANEES of the vehicle's twelve states of all rows, and its band.
pub(super) fn normalised(rows: &[ConsistencyRow]) -> String {
    let lines: Vec<(&str, Vec<Point>)> = rows
        .iter()
        .filter_map(|row| {
            let vehicle = row.blocks.iter().find(|block| block.degrees == 12)?;
            let mean = |chunk: &[Point]| {
                let count = chunk.len() as f64;
                let (t, value) = chunk.iter().fold((0.0, 0.0), |sum, point| (sum.0 + point.0, sum.1 + point.1));
                (hours(t / count), value / count)
            };
            Some((row.name.as_str(), vehicle.averages.chunks(AVERAGED_S).map(mean).collect()))
        })
        .collect();
    let series: Vec<(&str, &[Point])> = lines.iter().map(|(name, line)| (*name, line.as_slice())).collect();
    let widest = rows.iter().flat_map(|row| &row.blocks).find(|block| block.degrees == 12);
    let band: Vec<(f64, f64, f64)> = widest.map_or(Vec::new(), |block| {
        block.averages.iter().step_by(AVERAGED_S).map(|(t, _)| (hours(*t), block.band.low, block.band.high)).collect()
    });
    time_series(&TimePlot {
        y_label: "normalised error squared / degrees of freedom",
        series: &series,
        band: Some(("95 % of a consistent filter", &band)),
    })
}

/// Errors and both bounds of one quantity.
fn bounded(row: &ConsistencyRow, quantity: usize) -> Option<String> {
    let compared = row.bound.as_ref()?;
    let line = |values: &[[f64; 3]]| -> Vec<Point> {
        values.iter().enumerate().map(|(second, value)| (hours(second as f64), value[quantity])).collect()
    };
    let (errors, track, ensemble) = (line(&compared.errors), line(&compared.bounds[0]), line(&compared.bounds[1]));
    let (name, unit) = QUANTITIES[quantity];
    Some(error_vs_time(&ErrorPlot {
        y_label: &format!("{name} [{unit}]"),
        series: &[
            ("RMSE over the runs", &errors),
            ("bound along each track", &track),
            ("bound of the ensemble", &ensemble),
        ],
        bound: None,
        scale: Scale::Log,
    }))
}

/// The page.
pub(super) fn page(
    path: &Path,
    arguments: &Args,
    declared: &[ConsistencyRow],
    flights: &[ConsistencyRow],
) -> anyhow::Result<()> {
    let verdict = format!("{} flights of each model against the filter's own covariance.", arguments.runs);
    let mut report = Report::new("Does the filter know how wrong it is?", verdict)
        .figure("Worlds that behave as declared: ANEES of the vehicle's twelve states.", normalised(declared))
        .figure("Real flights: the same.", normalised(flights));
    for row in declared {
        for quantity in 0..QUANTITIES.len() {
            if let Some(figure) = bounded(row, quantity) {
                report = report.figure(&format!("{}: error and posterior Cramér-Rao bound.", row.name), figure);
            }
        }
    }
    let command: Vec<String> = std::env::args().skip(1).collect();
    report
        .provenance(Provenance {
            command: &format!("cargo lab {}", command.join(" ")),
            seed: Some(arguments.first_seed),
            version: env!("CARGO_PKG_VERSION"),
        })
        .write(path)
        .with_context(|| path.display().to_string())
}
