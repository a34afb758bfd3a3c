//! The figure: normalised errors over time with their band.

use super::ConsistencyRow;
use backseat_report::plots::{Point, TimePlot, time_series};

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
