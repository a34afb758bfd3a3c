//! What a wrong recording does to a log.

use backseat_logs::{Column, Log, LogRow};

/// A mistake in recording.
pub struct Wrong {
    pub name: String,
    pub change: Change,
    /// Lines of mappings that undo it; any one is right, for some mistakes are the same to every column of a log.
    pub mends: Vec<String>,
}

pub type Function = Box<dyn Fn(f64) -> f64>;

pub enum Change {
    /// Of the values of some columns.
    Values(Vec<(Column, Function)>),
    /// Of these columns, from several of the same row.
    Rows(Vec<Column>, fn(&mut LogRow)),
    /// Columns become others: (target, source, factor).
    Places(Vec<(Column, Column, f64)>),
    /// Times become so many times as long.
    Time(f64),
    /// The values of these columns, together, in another order.
    Shuffled(Vec<Column>),
    /// The first value of these columns after so many is held on.
    Held(Vec<Column>, usize),
    /// Rows without samples of these columns get the last ones.
    Filled(Vec<Column>),
    /// The column was not recorded under its name.
    Lost(Column, &'static str),
}

impl Wrong {
    /// The columns that it changes; a wrong time changes none alone.
    pub fn columns(&self) -> Vec<Column> {
        match &self.change {
            Change::Values(changes) => changes.iter().map(|change| change.0).collect(),
            Change::Places(places) => places.iter().map(|place| place.0).collect(),
            Change::Time(_) => Vec::new(),
            Change::Rows(columns, _) => columns.clone(),
            Change::Shuffled(columns) | Change::Held(columns, _) | Change::Filled(columns) => columns.clone(),
            Change::Lost(column, _) => vec![*column],
        }
    }

    /// The log as it would have been recorded; `None` if it lacks one of the columns.
    pub fn apply(&self, log: &Log) -> Option<Log> {
        let needed = match &self.change {
            Change::Places(places) => places.iter().map(|place| place.1).collect(),
            _ => self.columns(),
        };
        if !needed.iter().all(|column| log.has(*column)) {
            return None;
        }
        let with = |column: Column| (0..log.rows.len()).filter(move |&row| log.rows[row].get(column).is_some());
        let mut changed = log.clone();
        let rows = &mut changed.rows;
        match &self.change {
            Change::Values(changes) => {
                for row in rows {
                    for (column, change) in changes {
                        if let Some(value) = row.get(*column) {
                            row.set(*column, change(value));
                        }
                    }
                }
            }
            Change::Rows(_, change) => rows.iter_mut().for_each(change),
            Change::Places(places) => {
                for (row, old) in rows.iter_mut().zip(&log.rows) {
                    for (target, source, factor) in places {
                        row.set(*target, old.get(*source).map_or(f64::NAN, |value| factor * value));
                    }
                }
            }
            Change::Time(factor) => {
                let first = log.rows.first()?.time_us;
                for row in rows {
                    row.time_us = ((row.time_us - first) as f64 * factor) as u64;
                }
            }
            Change::Shuffled(columns) => {
                let mut order: Vec<usize> = with(columns[0]).collect();
                let mut random = 1_u64;
                for k in (1..order.len()).rev() {
                    random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    order.swap(k, (random >> 33) as usize % (k + 1));
                }
                for (to, from) in with(columns[0]).zip(order) {
                    for column in columns {
                        rows[to].set(*column, log.rows[from].get(*column).unwrap_or(f64::NAN));
                    }
                }
            }
            Change::Held(columns, after) => {
                let start = with(columns[0]).count() * after / 100;
                let first = &log.rows[with(columns[0]).nth(start)?];
                for row in with(columns[0]).skip(start) {
                    for column in columns {
                        rows[row].set(*column, first.get(*column)?);
                    }
                }
            }
            Change::Filled(columns) => {
                // where nearly every row has one, nothing is held
                if log.column(columns[0]).count() * 10 > log.rows.len() * 9 {
                    return None;
                }
                for column in columns {
                    let mut last = None;
                    for row in rows.iter_mut() {
                        last = row.get(*column).or(last);
                        row.set(*column, last.unwrap_or(f64::NAN));
                    }
                }
            }
            Change::Lost(column, name) => {
                rows.iter_mut().for_each(|row| {
                    row.set(*column, f64::NAN);
                });
                changed.unused_columns.push((*name).to_owned());
            }
        }
        Some(changed)
    }
}
