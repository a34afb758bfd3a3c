//! Medians and intervals of the runs.

use super::item::{Column, Curves, Item};
use super::studies::{Measured, Study};
use crate::store::Key;
use backseat_logs::stats::{median, percentile};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// Items with their runs.
pub struct ItemRuns<'a> {
    pub items: &'a [&'static Item],
    /// Of each, with seeds from 1.
    pub runs: u64,
    /// The program that made them.
    pub build: String,
    pub finished: Vec<((Key, &'static Study), Measured)>,
}

/// One cell over the ensemble.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    pub median: f64,
    /// The middle 95 % of the runs (2.5th to 97.5th percentile): where another single run is to be expected.
    pub interval: (f64, f64),
    /// Runs with a finite value.
    pub finite: usize,
    /// Runs in which a claim holds.
    pub holds: usize,
    pub runs: usize,
}

/// How the medians of an item compare with print.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Verdict {
    /// Cells with a printed number.
    pub cells: usize,
    /// Rows of the cells whose median is above the printed number, a row a cell.
    pub above: Vec<String>,
}

impl Verdict {
    /// Of an item and our table of it; an error that none of the runs has is above print.
    pub fn of(item: &Item, ours: &Rows) -> Self {
        let mut verdict = Self::default();
        for (row, cells) in ours {
            let Some(printed) = item.printed.of(row) else { continue };
            for (cell, printed) in cells.iter().zip(printed) {
                if printed.is_finite() && cell.runs > 0 {
                    verdict.cells += 1;
                    if cell.median.is_nan() || cell.median > printed {
                        verdict.above.push((*row).to_owned());
                    }
                }
            }
        }
        verdict
    }

    /// One sentence; empty where nothing is printed.
    pub fn text(&self) -> String {
        match (self.cells, self.above.len()) {
            (0, _) => String::new(),
            (1, 0) => "Our median is at or below print. ".to_owned(),
            (cells, 0) => format!("Our median is at or below print in all {cells} cells. "),
            (cells, above) => {
                let mut rows = self.above.clone();
                rows.dedup();
                format!("Our median is above print in {above} of {cells} cells (rows {}). ", rows.join("; "))
            }
        }
    }
}

/// An item's cells, row by row.
pub type Rows = Vec<(&'static str, Vec<Cell>)>;

/// A curve's name and points.
pub type Curve = (&'static str, Vec<(f64, f64)>);

impl ItemRuns<'_> {
    fn finished(&self, item: &Item) -> impl Iterator<Item = &Measured> {
        self.finished.iter().filter(|((_, study), _)| study.name == item.study.name).map(|(_, measured)| measured)
    }

    /// The table of an item.
    pub fn table(&self, item: &Item) -> Rows {
        let cell = |row: &str, column: &Column| {
            let value = |run: &Measured| run.rows.get(row).and_then(|row| row.get(column.key)).copied();
            Cell::of(&self.finished(item).filter_map(value).collect::<Vec<_>>())
        };
        item.rows.iter().map(|row| (*row, item.columns.iter().map(|column| cell(row, column)).collect())).collect()
    }

    /// Median curves of an item's rows.
    pub fn curves(&self, item: &Item, curves: &Curves) -> Vec<Curve> {
        let lines = item.rows.iter().map(|row| {
            let key = format!("{}/{row}", curves.prefix);
            // Runs sample the same times; times are keyed in whole seconds.
            let mut at: BTreeMap<i64, Vec<f64>> = BTreeMap::new();
            for (t_h, value) in self.finished(item).filter_map(|run| run.curves.get(&key)).flatten() {
                at.entry((t_h * 3600.0).round() as i64).or_default().push(*value);
            }
            // Where few runs still go on, their median is of others than before.
            let most = at.values().map(Vec::len).max().unwrap_or(0);
            let points = at.iter().filter(|(_, values)| 2 * values.len() >= most);
            (*row, points.filter_map(|(t, values)| Some((*t as f64 / 3600.0, median(values)?))).collect())
        });
        lines.filter(|(_, points): &Curve| !points.is_empty()).collect()
    }

    /// One JSON object.
    pub fn json(&self) -> String {
        let items: Vec<Value> = self.items.iter().map(|item| self.item_json(item)).collect();
        let text = json!({
            "version": env!("CARGO_PKG_VERSION"), "build": self.build, "seeds": [1, self.runs],
            "first_tuning_seed": super::FIRST_TUNING_SEED, "items": items,
        });
        format!("{text}\n")
    }

    fn item_json(&self, item: &Item) -> Value {
        fn row<T>(item: &Item, name: &str, cells: &[T], value: impl Fn(&Column, &T) -> Value) -> Value {
            let columns = item.columns.iter().zip(cells);
            let columns: Map<String, Value> =
                columns.map(|(column, cell)| (column.key.to_owned(), value(column, cell))).collect();
            json!({"name": name, "columns": columns})
        }
        let number = |_: &Column, value: &f64| json!(value);
        let rows = self.table(item);
        let rows = rows.iter().map(|(name, cells)| row(item, name, cells, |column, cell| cell.json(column)));
        let printed = item.rows.iter().filter_map(|name| Some(row(item, name, &item.printed.of(name)?, number)));
        let independent = item.independent.iter().map(|reported| row(item, reported.name, reported.values, number));
        json!({
            "id": item.id, "title": item.title, "thesis": item.thesis, "conditions": item.conditions,
            "printed": printed.collect::<Vec<_>>(), "independent": independent.collect::<Vec<_>>(),
            "runs": self.runs, "rows": rows.collect::<Vec<_>>(), "differs": item.differs,
        })
    }
}

impl Cell {
    fn of(values: &[f64]) -> Self {
        let finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
        let at = |q| percentile(&finite, q).unwrap_or(f64::NAN);
        Self {
            median: median(&finite).unwrap_or(f64::NAN),
            interval: (at(0.025), at(0.975)),
            finite: finite.len(),
            holds: finite.iter().filter(|value| **value > 0.5).count(),
            runs: values.len(),
        }
    }

    fn json(&self, column: &Column) -> Value {
        if column.is_claim {
            return json!({"holds": self.holds, "runs": self.runs});
        }
        json!({"median": self.median, "interval95": [self.interval.0, self.interval.1], "runs": self.finite})
    }

    /// As it stands in a table: median and interval, or in how many runs a claim holds.
    pub fn text(&self, column: &Column) -> String {
        if self.runs == 0 {
            return "–".to_owned();
        }
        if column.is_claim {
            return format!("{} of {}", self.holds, self.runs);
        }
        let failed = self.runs - self.finite;
        if self.finite == 0 {
            return format!("none in {failed}");
        }
        let failed = if failed == 0 { String::new() } else { format!("; none in {failed} of {}", self.runs) };
        let (low, high) = self.interval;
        format!("{} ({} to {}{failed})", short(self.median), short(low), short(high))
    }
}

/// Two or three significant digits.
pub fn short(value: f64) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let size = value.abs();
    if size >= 100.0 || size == 0.0 {
        return format!("{value:.0}");
    }
    if size < 1.0e-5 {
        return format!("{value:.1e}");
    }
    let digits = (1.0 - size.log10().floor()).max(0.0) as usize;
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_the_interval_is_of_the_runs() {
        let cell = Cell::of(&(0..=40).map(f64::from).chain([f64::NAN]).collect::<Vec<_>>());
        assert_eq!((cell.median, cell.interval, cell.finite, cell.runs), (20.0, (1.0, 39.0), 41, 42));
        let column = super::super::item::column("x", "x");
        assert_eq!(cell.text(&column), "20 (1.0 to 39; none in 1 of 42)");
    }

    #[test]
    fn numbers_have_two_digits() {
        for (value, text) in
            [(0.0123, "0.012"), (1.25, "1.2"), (12.3, "12"), (-0.5, "-0.50"), (1234.5, "1234"), (3e-6, "3.0e-6")]
        {
            assert_eq!(short(value), text);
        }
    }
}
