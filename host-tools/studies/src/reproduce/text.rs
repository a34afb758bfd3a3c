//! Tables for the terminal.

use super::ensemble::{Cell, Ensemble, Table, short};
use super::item::{Item, Reported};
use std::fmt::Write as _;

/// Every item in full, or (`brief`) a line each.
pub fn tables(ensemble: &Ensemble<'_>, brief: bool) -> String {
    let mut out = String::new();
    if brief {
        let _ = writeln!(
            out,
            "Median (middle 95 % of the runs); an item's name after `backseat reproduce` shows all of it.\n"
        );
        return out + &aligned(&summary(ensemble));
    }
    for item in ensemble.items {
        let table = ensemble.table(item);
        let _ = writeln!(out, "{}: {}\n", item.id, item.title);
        let _ = writeln!(out, "taken as    {}", item.taken_as);
        let _ = writeln!(out, "conditions  {}", item.conditions);
        let _ = writeln!(out, "runs        {}; median (middle 95 % of the runs)\n", seeds(ensemble, &table));
        out += &aligned(&grid(item, &table));
        if item.printed.is_empty() {
            out += "the thesis' printed figures are not at hand\n";
        }
        let _ = writeln!(out, "{}\n", item.differs);
    }
    out
}

/// How many runs are finished, with which seeds.
pub fn seeds(ensemble: &Ensemble<'_>, table: &Table) -> String {
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
    for (name, cells) in &table.rows {
        let cells = item.columns.iter().zip(cells).map(|(column, cell)| cell.text(column));
        grid.push(std::iter::once((*name).to_owned()).chain(cells).collect());
    }
    let reported = |who: &str, reported: &Reported| -> Vec<String> {
        let values = reported.values.iter().map(|value| format!("{value}"));
        let missing = item.columns.len() - reported.values.len();
        let name = std::iter::once(format!("{who}{}", reported.name));
        name.chain(values).chain(std::iter::repeat_n("–".to_owned(), missing)).collect()
    };
    grid.extend(item.printed.iter().map(|row| reported("", row)));
    grid.extend(item.independent.iter().map(|row| reported("independent: ", row)));
    grid
}

/// The first column of every row of every item.
pub fn summary(ensemble: &Ensemble<'_>) -> Vec<Vec<String>> {
    let header = ["item", "row", "what", "thesis", "ours", "runs"];
    let mut grid = vec![header.map(str::to_owned).to_vec()];
    for item in ensemble.items {
        let table = ensemble.table(item);
        for (name, cells) in &table.rows {
            let (Some(column), Some(cell)): (_, Option<&Cell>) = (item.columns.first(), cells.first()) else {
                continue;
            };
            let first = std::ptr::eq(name, &table.rows[0].0);
            let printed =
                item.printed.first().and_then(|row| row.values.first()).map_or("not at hand".to_owned(), |v| short(*v));
            grid.push(vec![
                if first { item.id.to_owned() } else { String::new() },
                (*name).to_owned(),
                column.header.to_owned(),
                if first { printed } else { String::new() },
                cell.text(column),
                cell.runs.to_string(),
            ]);
        }
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
