//! The tables as rows of cells.

use super::ensemble::{Cell, ItemRuns, Rows, Verdict, short};
use super::item::{Item, Printed, Reported};

/// How many runs of each there are, with which seeds.
pub fn seeds(runs: u64) -> String {
    if runs == 1 { "1, seed 1".to_owned() } else { format!("{runs}, seeds 1 to {runs}") }
}

/// Header and rows: ours, then what others reported.
pub fn grid(item: &Item, rows: &Rows) -> Vec<Vec<String>> {
    let header = std::iter::once(String::new()).chain(item.columns.iter().map(|column| column.header.to_owned()));
    let mut grid = vec![header.collect::<Vec<_>>()];
    let reported = |name: String, values: &[f64], prefix: &str| -> Vec<String> {
        let text = |value: &f64| if value.is_finite() { format!("{prefix}{value}") } else { "–".to_owned() };
        let missing = item.columns.len().saturating_sub(values.len());
        let values = values.iter().map(text).chain(std::iter::repeat_n("–".to_owned(), missing));
        std::iter::once(name).chain(values).collect()
    };
    let prefix = if matches!(item.printed, Printed::Below(_)) { "below " } else { "" };
    for (name, cells) in rows {
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
        let rows = ensemble.table(item);
        let verdict = Verdict::of(item, &rows);
        let ours = match (verdict.cells, verdict.above.len()) {
            (0, _) => {
                let rows = rows.iter().filter_map(|(name, cells)| {
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
        grid.push(vec![item.id.to_owned(), item.title.to_owned(), ours, ensemble.runs.to_string()]);
    }
    grid
}
