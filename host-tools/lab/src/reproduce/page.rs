//! The tables and plots as a page.

use super::ensemble::{ItemRuns, Verdict};
use super::grid::{grid, seeds, summary};
use super::item::Item;
use backseat_report::plots::{self, Bar, BarPlot, ErrorPlot, Scale, Series};
use backseat_report::{Provenance, Report, Table};

pub fn html(ensemble: &ItemRuns<'_>) -> String {
    let items = ensemble.items.len();
    let verdict = format!(
        "{items} tables and figures of the thesis, each as the median and the middle 95 % of {} simulated runs.",
        ensemble.runs
    );
    let mut report = Report::new("The thesis' tables and figures, reproduced", verdict).text(
        "Each item is simulated under its printed conditions; what the thesis does not say stands in brackets. Independent rows \
         are of another implementation of the thesis' corrected equations.",
    );
    if items > 1 {
        report = report.table(table("Summary", &summary(ensemble)));
    }
    for item in ensemble.items {
        let ours = ensemble.table(item);
        report =
            report.section(&format!("{}: {}", item.id, item.title)).text(&format!("Thesis: {}", item.thesis)).table(
                table(&format!("Median (middle 95 % of the runs); runs: {}", seeds(ensemble.runs)), &grid(item, &ours)),
            );
        report = plots(report, ensemble, item);
        let verdict = Verdict::of(item, &ours).text();
        report = report.text(&format!("{verdict}{}", item.differs)).text(&format!("Conditions: {}", item.conditions));
    }
    let command: Vec<String> = std::env::args_os().skip(1).map(|arg| arg.to_string_lossy().into_owned()).collect();
    let version = format!("{}, build {}", env!("CARGO_PKG_VERSION"), ensemble.build);
    let command = format!("cargo lab {}", command.join(" "));
    report.provenance(Provenance { command: &command, seed: None, version: &version }).html()
}

fn table(caption: &str, grid: &[Vec<String>]) -> Table {
    let mut rows = grid.iter();
    let header: Vec<&str> = rows.next().map(|row| row.iter().map(String::as_str).collect()).unwrap_or_default();
    rows.fold(Table::new(caption, &header), |table, row| table.row(row.iter().map(String::as_str)))
}

/// Bars of the first column, then the curves.
fn plots(mut report: Report, ensemble: &ItemRuns<'_>, item: &Item) -> Report {
    let ours = ensemble.table(item);
    if let Some(column) = item.columns.first().filter(|column| !column.is_claim) {
        let bars: Vec<Bar<'_>> = ours
            .iter()
            .filter_map(|(name, cells)| Some((name, cells.first()?)))
            .map(|(name, cell)| Bar { name, value: cell.median, interval: Some(cell.interval) })
            .collect();
        let first = item.rows.first().and_then(|row| Some((*row, *item.printed.of(row)?.first()?)));
        let printed = first.filter(|(_, value)| value.is_finite());
        let figure = plots::bars(&BarPlot { x_label: column.header, bars: &bars, reference: printed });
        report = report.figure(&format!("{}: median and middle 95 % of the runs.", column.header), figure);
    }
    for curves in item.curves {
        let lines = ensemble.curves(item, curves);
        if lines.is_empty() {
            continue;
        }
        let series: Vec<Series<'_>> = lines.iter().map(|(name, points)| (*name, points.as_slice())).collect();
        let scale = if curves.is_log { Scale::Log } else { Scale::Linear };
        let figure = plots::error_vs_time(&ErrorPlot { y_label: curves.y_label, series: &series, bound: None, scale });
        report = report.figure(&format!("{}.", curves.y_label), figure);
    }
    report
}
