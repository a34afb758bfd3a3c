//! Tables for the terminal.

use super::ensemble::{Cell, ItemRuns, Table, Verdict, short};
use super::item::{Item, Printed, Reported};
use std::fmt::Write as _;

/// Every item in full, or (`brief`) a line each.
pub fn tables(ensemble: &ItemRuns<'_>, brief: bool) -> String {
    let mut out = String::new();
    if brief {
        let _ = writeln!(
            out,
            "Median (middle 95 % of the runs); an item's name after `cargo lab reproduce` shows all of it.\n"
        );
        return out + &aligned(&summary(ensemble));
    }
    for item in ensemble.items {
        let table = ensemble.table(item);
        let _ = writeln!(out, "{}: {}\n", item.id, item.title);
        let _ = writeln!(out, "thesis      {}", item.thesis);
        let _ = writeln!(out, "conditions  {}", item.conditions);
        let _ = writeln!(out, "runs        {}; median (middle 95 % of the runs)\n", seeds(ensemble, &table));
        out += &aligned(&grid(item, &table));
        let _ = writeln!(out, "{}{}\n", Verdict::of(item, &table).text(), item.differs);
    }
    out
}

/// How many runs are finished, with which seeds.
pub fn seeds(ensemble: &ItemRuns<'_>, table: &Table) -> String {
    match (table.runs as u64, ensemble.runs) {
        (runs, asked) if runs < asked => format!("{runs} finished of seeds 1 to {asked}"),
        (1, _) => "1, seed 1".to_owned(),
        (runs, _) => format!("{runs}, seeds 1 to {runs}"),
    }
}

/// Header and rows: ours, then what others reported.
pub fn grid(item: &Item, table: &Table) -> Vec<Vec<String>> {
    let header = std::iter::once(String::new()).chain(item.columns.iter().map(|column| column.header.to_owned()));
    let mut grid = vec![header.collect::<Vec<_>>()];
    let reported = |name: String, values: &[f64], prefix: &str| -> Vec<String> {
        let text = |value: &f64| if value.is_finite() { format!("{prefix}{value}") } else { "–".to_owned() };
        let missing = item.columns.len().saturating_sub(values.len());
        let values = values.iter().map(text).chain(std::iter::repeat_n("–".to_owned(), missing));
        std::iter::once(name).chain(values).collect()
    };
    let prefix = if matches!(item.printed, Printed::Below(_)) { "below " } else { "" };
    for (name, cells) in &table.rows {
        let cells = item.columns.iter().zip(cells).map(|(column, cell)| cell.text(column));
        grid.push(std::iter::once((*name).to_owned()).chain(cells).collect());
        if let Some(values) = item.printed.of(name) {
            grid.push(reported("– printed".to_owned(), &values, prefix));
        }
    }
    let independent = |row: &Reported| reported(format!("independent: {}", row.name), row.values, "");
    grid.extend(item.independent.iter().map(independent));
    grid
}

/// An item a line: what is printed of it, and how ours compares, or the first column of our rows.
pub fn summary(ensemble: &ItemRuns<'_>) -> Vec<Vec<String>> {
    let header = ["item", "what", "ours against print", "runs"];
    let mut grid = vec![header.map(str::to_owned).to_vec()];
    for item in ensemble.items {
        let table = ensemble.table(item);
        let verdict = Verdict::of(item, &table);
        let ours = match (verdict.cells, verdict.above.len()) {
            (0, _) => {
                let rows = table.rows.iter().filter_map(|(name, cells)| {
                    let (column, cell): (_, &Cell) = (item.columns.first()?, cells.first()?);
                    Some(if column.is_claim {
                        format!("{name} {}", cell.text(column))
                    } else {
                        format!("{name} {}", short(cell.median))
                    })
                });
                let header = item.columns.first().map_or("", |column| column.header);
                format!("no number printed; ours, {header}: {}", rows.collect::<Vec<_>>().join(", "))
            }
            (cells, 0) => format!("at or below print in all {cells} cells"),
            (cells, above) => format!("above print in {above} of {cells} cells"),
        };
        grid.push(vec![item.id.to_owned(), item.title.to_owned(), ours, table.runs.to_string()]);
    }
    grid
}

fn aligned(grid: &[Vec<String>]) -> String {
    let columns = grid.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        grid.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut out = String::new();
    for row in grid {
        let cells = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:width$}"));
        let _ = writeln!(out, "{}", cells.collect::<Vec<_>>().join("  ").trim_end());
    }
    out + "\n"
}
