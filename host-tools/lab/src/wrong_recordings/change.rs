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

    /// The log as it would have been recorded; `None` if it has none of the columns.
    pub fn apply(&self, log: &Log) -> Option<Log> {
        let mut log = log.clone();
        let has =
            |log: &Log, mut columns: &mut dyn Iterator<Item = Column>| Iterator::all(&mut columns, |c| log.has(c));
        match &self.change {
            Change::Values(changes) => {
                if !has(&log, &mut changes.iter().map(|change| change.0)) {
                    return None;
                }
                for row in &mut log.rows {
                    for (column, change) in changes {
                        if let Some(value) = row.get(*column) {
                            row.set(*column, change(value));
                        }
                    }
                }
            }
            Change::Rows(columns, change) => {
                if !has(&log, &mut columns.iter().copied()) {
                    return None;
                }
                log.rows.iter_mut().for_each(change);
            }
            Change::Places(places) => {
                if !has(&log, &mut places.iter().map(|place| place.1)) {
                    return None;
                }
                for row in &mut log.rows {
                    let old = row.clone();
                    for (target, source, factor) in places {
                        row.set(*target, old.get(*source).map_or(f64::NAN, |value| factor * value));
                    }
                }
            }
            Change::Time(factor) => {
                let first = log.rows.first()?.time_us;
                for row in &mut log.rows {
                    row.time_us = ((row.time_us - first) as f64 * factor) as u64;
                }
            }
            Change::Shuffled(columns) => {
                if !has(&log, &mut columns.iter().copied()) {
                    return None;
                }
                let places: Vec<usize> =
                    (0..log.rows.len()).filter(|&row| log.rows[row].get(columns[0]).is_some()).collect();
                let mut order: Vec<usize> = places.clone();
                let mut random = 1_u64;
                for k in (1..order.len()).rev() {
                    random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    order.swap(k, (random >> 33) as usize % (k + 1));
                }
                let old = log.rows.clone();
                for (to, from) in places.into_iter().zip(order) {
                    for column in columns {
                        log.rows[to].set(*column, old[from].get(*column).unwrap_or(f64::NAN));
                    }
                }
            }
            Change::Held(columns, after) => {
                if !has(&log, &mut columns.iter().copied()) {
                    return None;
                }
                let with: Vec<usize> =
                    (0..log.rows.len()).filter(|&row| log.rows[row].get(columns[0]).is_some()).collect();
                let start = with.len() * after / 100;
                let first = log.rows[*with.get(start)?].clone();
                for row in with.into_iter().skip(start) {
                    for column in columns {
                        log.rows[row].set(*column, first.get(*column)?);
                    }
                }
            }
            Change::Filled(columns) => {
                if !has(&log, &mut columns.iter().copied()) {
                    return None;
                }
                // where nearly every row has one, nothing is held
                if log.column(columns[0]).count() * 10 > log.rows.len() * 9 {
                    return None;
                }
                for column in columns {
                    let mut last = None;
                    for row in &mut log.rows {
                        last = row.get(*column).or(last);
                        row.set(*column, last.unwrap_or(f64::NAN));
                    }
                }
            }
            Change::Lost(column, name) => {
                if !log.has(*column) {
                    return None;
                }
                log.rows.iter_mut().for_each(|row| {
                    row.set(*column, f64::NAN);
                });
                log.unused_columns.push((*name).to_owned());
            }
        }
        Some(log)
    }
}
