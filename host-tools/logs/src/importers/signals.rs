//! Logs of named messages with named numbers: which of them a vehicle log holds, and what a mapping names.
//!
//! A format is a table of its messages and of what their numbers become (`messages.toml`); its reader takes only the
//! bytes apart. Where several messages of the table fill one column, the first that the log has is used; of several
//! sensors that send one message, the one that sends most. An entry of a mapping takes the place of both. Its
//! `column` is a message with its number, `RCOU.C1`, `vehicle_local_position.z`, or the name alone where a message has
//! one number; `SetServoPosition[2].value` is one of several, and without the brackets the one that sends most.

use super::Imported;
use super::engine::euler_rad;
use super::format::Role;
use super::mapping::ColumnMap;
use super::message_tables::{MessageTable, Number, TABLES, Take};
use super::messages::Gathering;
use crate::DataError;
use crate::log::{Column, MAX_SECONDS, Source};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A message type as it comes.
struct Seen {
    count: usize,
    /// Row of the table.
    row: Option<usize>,
    /// Number of the message in order of its first coming.
    number: usize,
    /// Entries of the mapping that take a number of it, and which.
    wanted: Vec<(usize, String)>,
    fields: Vec<String>,
}

/// An entry of the mapping.
struct Mapped<'a> {
    name: &'a str,
    column: Column,
    scale: f64,
    offset: f64,
    is_found: bool,
}

/// What was taken from a message.
enum Taken {
    Numbers(Vec<(Column, f64)>),
    FixDeg([f64; 2]),
}

/// Row of the table (`None`: the mapping), and number of the message.
type Origin = (Option<usize>, usize);

/// Time in µs, and what was taken from where.
type Kept = (i64, Origin, Taken);

/// A log of messages as it is read.
pub(super) struct Signals<'a> {
    path: &'a Path,
    map: Option<&'a ColumnMap>,
    table: &'static MessageTable,
    sources: Vec<Mapped<'a>>,
    seen: BTreeMap<String, Seen>,
    kept: Vec<Kept>,
    /// Rows of the table that are not used, and why.
    refused: BTreeMap<usize, &'static str>,
    /// Why messages of a name are left out.
    pub reasons: BTreeMap<String, String>,
    /// Messages that are left out one by one.
    pub left_out: Gathering,
    /// Added to every time, µs.
    pub shift_us: i64,
    /// What belongs together comes one number at a time.
    pub is_one_by_one: bool,
}

impl<'a> Signals<'a> {
    pub(super) fn new(path: &'a Path, map: Option<&'a ColumnMap>, table: &'static str) -> Result<Self, DataError> {
        let mut sources = Vec::new();
        for known in map.iter().flat_map(|map| map.format().columns.iter()) {
            let name = &*known.name;
            let Role::Sample { column, scale, offset } = known.role else {
                let log = if table == "ros2" { "a ROS 2 bag" } else { "such a log" };
                let message = format!("mapped {name}: {log} has its own times and positions; map numbers alone");
                return Err(DataError::file(path, message));
            };
            sources.push(Mapped { name, column, scale, offset, is_found: false });
        }
        Ok(Self {
            path,
            map,
            table: &TABLES[table],
            sources,
            seen: BTreeMap::new(),
            kept: Vec::new(),
            refused: BTreeMap::new(),
            reasons: BTreeMap::new(),
            left_out: Gathering::default(),
            shift_us: 0,
            is_one_by_one: false,
        })
    }

    /// Whether the mapping or the table takes anything from a message.
    pub(super) fn takes(&self, base: &str) -> bool {
        let is_named = |source: &Mapped| source.name.strip_prefix(base).is_some_and(is_number);
        self.table.messages.iter().any(|row| row.name == base) || self.sources.iter().any(is_named)
    }

    /// The same; counts it if not.
    pub(super) fn wants(&mut self, base: &str) -> bool {
        if self.takes(base) {
            return true;
        }
        match self.seen.get_mut(base) {
            Some(seen) => {
                seen.count += 1;
                false
            }
            // its numbers are shown where a mapping asks for others
            None => true,
        }
    }

    /// One message, its name and which of several of that name (empty, or `[1]`), and its numbers.
    pub(super) fn message(&mut self, time_us: i64, base: &str, which: &str, fields: &[(&str, f64)]) {
        self.named(time_us, base, &format!("{base}{which}"), fields);
    }

    /// The same of a message whose name is not that of its kind, which the table has.
    pub(super) fn named(&mut self, time_us: i64, base: &str, name: &str, fields: &[(&str, f64)]) {
        if !self.seen.contains_key(name) {
            let seen = self.first_sight(base, name, fields);
            self.seen.insert(name.to_owned(), seen);
        }
        let Some(seen) = self.seen.get_mut(name) else { return };
        seen.count += 1;
        // what no vehicle log can hold
        if !(0.0..MAX_SECONDS).contains(&(time_us as f64 * 1e-6)) {
            return;
        }
        let get = |field: &str| fields.iter().find(|(name, _)| *name == field).map(|(_, value)| *value);
        let mut samples = Vec::new();
        for (place, field) in &seen.wanted {
            let Some(source) = self.sources.get_mut(*place) else { continue };
            if let Some(value) = get(field) {
                source.is_found = true;
                samples.push((source.column, (value + source.offset) * source.scale));
            }
        }
        if !samples.is_empty() {
            self.kept.push((time_us, (None, seen.number), Taken::Numbers(samples)));
        }
        let Some((place, row)) = seen.row.and_then(|place| Some((place, self.table.messages.get(place)?))) else {
            return;
        };
        let from = (Some(place), seen.number);
        if !row.is_of_use(get) {
            return;
        }
        let mut samples = Vec::new();
        for take in &row.takes {
            match take {
                Take::Number(Number { field, per, column, scale, offset }) => {
                    let over = per.as_ref().map_or(Some(1.0), |per| get(per));
                    let value = get(field).zip(over).map(|(value, over)| (value / over + offset) * scale);
                    samples.extend(value.map(|value| (*column, value)));
                }
                Take::Fix { fix: [latitude, longitude], degrees } => {
                    if let (Some(latitude), Some(longitude)) = (get(latitude), get(longitude)) {
                        let fix_deg = [latitude * degrees, longitude * degrees];
                        self.kept.push((time_us, from, Taken::FixDeg(fix_deg)));
                    }
                }
                Take::Quaternion { quaternion, is_enu_flu } => {
                    if let [Some(w), Some(x), Some(y), Some(z)] = quaternion.each_ref().map(|part| get(part))
                        && let Some(euler_rad) = euler_rad([w, x, y, z], *is_enu_flu)
                    {
                        samples.extend([Column::Roll, Column::Pitch, Column::Heading].into_iter().zip(euler_rad));
                    }
                }
            }
        }
        if !samples.is_empty() {
            self.kept.push((time_us, from, Taken::Numbers(samples)));
        }
    }

    /// Binds a message that comes for the first time.
    fn first_sight(&self, base: &str, name: &str, fields: &[(&str, f64)]) -> Seen {
        let wanted = |(place, source): (usize, &Mapped)| {
            // of one sensor, or of whichever sends most
            let rest = source.name.strip_prefix(name).or_else(|| source.name.strip_prefix(base))?;
            let field = match rest {
                "" if fields.len() == 1 => fields[0].0,
                // a message may be an array
                rest if !name.starts_with(base) && is_number(rest) => rest.strip_prefix('.').unwrap_or(rest),
                rest => rest.strip_prefix('.')?,
            };
            Some((place, field.to_owned()))
        };
        Seen {
            count: 0,
            row: self.table.messages.iter().position(|row| row.name == base),
            number: self.seen.len(),
            wanted: self.sources.iter().enumerate().filter_map(wanted).collect(),
            fields: fields.iter().map(|(field, _)| (*field).to_owned()).collect(),
        }
    }

    /// Leaves out what a row of the table gave.
    pub(super) fn refuse(&mut self, name: &str, reason: &'static str) {
        if let Some(place) = self.table.messages.iter().position(|row| row.name == name) {
            self.refused.insert(place, reason);
        }
    }

    /// Adds to what a row of the table gave for a column.
    pub(super) fn add(&mut self, name: &str, column: Column, more: f64) {
        let place = self.table.messages.iter().position(|row| row.name == name);
        for (_, (of, _), taken) in &mut self.kept {
            if let (true, Taken::Numbers(samples)) = (*of == place, taken) {
                samples.iter_mut().filter(|(of, _)| *of == column).for_each(|(_, value)| *value += more);
            }
        }
    }

    /// Whether a message has come, from any sensor.
    pub(super) fn has(&self, base: &str) -> bool {
        self.seen
            .keys()
            .any(|name| name.strip_prefix(base).is_some_and(|rest| rest.is_empty() || rest.starts_with('[')))
    }

    /// The log.
    pub(super) fn finish(mut self, format: &'static str, more: Vec<String>) -> Result<Imported, DataError> {
        if let Some(source) = self.sources.iter().find(|source| !source.is_found) {
            return Err(DataError::file(self.path, self.not_found(source.name)));
        }
        // of several sensors with one message the one that sends most
        let mut used: BTreeMap<usize, (&Seen, &str)> = BTreeMap::new();
        for (name, seen) in &self.seen {
            if let Some(row) = seen.row.filter(|row| !self.refused.contains_key(row)) {
                let most = used.entry(row).or_insert((seen, name));
                if seen.count > most.0.count {
                    *most = (seen, name);
                }
            }
        }
        let mut named: BTreeMap<Column, &Seen> = BTreeMap::new();
        for seen in self.seen.values() {
            for source in seen.wanted.iter().filter_map(|(place, _)| self.sources.get(*place)) {
                let most = named.entry(source.column).or_insert(seen);
                if seen.count > most.count {
                    *most = seen;
                }
            }
        }
        let is_used = |(row, number): Origin, column: Column| match row {
            Some(row) => used.get(&row).is_some_and(|(seen, _)| seen.number == number),
            None => named.get(&column).is_some_and(|seen| seen.number == number),
        };
        let owners = owners(&self.kept, is_used);
        let is_owned = |from: Origin, column: Column| is_used(from, column) && owners.get(&column) == Some(&from.0);
        let mut gathering = std::mem::take(&mut self.left_out);
        gathering.is_exact = !self.is_one_by_one;
        for (time_us, from, taken) in std::mem::take(&mut self.kept) {
            let time_us = time_us + self.shift_us;
            match taken {
                Taken::Numbers(mut samples) => {
                    samples.retain(|(column, _)| is_owned(from, *column));
                    gathering.add(time_us, &samples);
                }
                Taken::FixDeg([latitude, longitude]) if is_owned(from, Column::GpsX) => {
                    gathering.add_fix(time_us, latitude, longitude);
                }
                Taken::FixDeg(_) => {}
            }
        }
        let mut read: BTreeMap<usize, Vec<&str>> = BTreeMap::new();
        for (column, row) in &owners {
            if let Some(row) = row {
                read.entry(*row).or_default().push(column.name());
            }
        }
        let read: Vec<String> = read
            .into_iter()
            .filter_map(|(row, columns)| Some(format!("{} ({})", self.shown(used.get(&row)?.1), columns.join(", "))))
            .collect();
        let recognised = if read.is_empty() { "nothing by itself".to_owned() } else { read.join(", ") };
        let mut notes = vec![format!("{format}; recognised: {recognised}")];
        if !self.sources.is_empty() {
            let texts = self.sources.iter().map(|source| format!("{} is {}", source.name, source.column.name()));
            notes.push(format!("by the mapping: {}", texts.collect::<Vec<_>>().join(", ")));
        }
        notes.extend(more);
        for (name, seen) in &self.seen {
            let is_this =
                seen.row.is_some_and(|row| used.get(&row).is_some_and(|(used, _)| used.number == seen.number));
            let is_read = is_this && owners.values().any(|owner| *owner == seen.row && owner.is_some());
            if is_read || named.values().any(|named| named.number == seen.number) {
                continue;
            }
            let base = name.split('[').next().unwrap_or(name);
            let refused = seen.row.and_then(|row| self.refused.get(&row).copied());
            let hint = self.table.hints.iter().find(|(hinted, _)| *hinted == base).map(|(_, reason)| reason.as_str());
            let reason = refused.or(hint).unwrap_or(match (seen.row, is_this) {
                (Some(_), true) => "other messages have the same, or none of it is valid",
                (Some(_), false) => "another sensor with the same message is used",
                (None, _) if !seen.wanted.is_empty() => "another sensor with the same message is used",
                (None, _) => "not part of a vehicle log",
            });
            let reason = self.reasons.get(name).map_or(Cow::from(reason), |own| own.clone().into());
            gathering.leave_out_so_many(self.shown(name), seen.count, reason);
        }
        let mut log = gathering.finish(self.path, notes)?;
        let numbers = |row: &usize| used.get(row).map(|(_, name)| (*row, self.shown(name)));
        log.sources =
            Some(owners.iter().filter_map(|(column, row)| self.source(*column, row.as_ref().map(numbers))).collect());
        log.unread_numbers = self.unread();
        let of_fixes: BTreeSet<usize> =
            [Column::GpsX, Column::GpsY].iter().filter_map(|column| *owners.get(column)?).collect();
        let estimates = of_fixes.iter().filter(|row| self.table.messages.get(**row).is_some_and(|row| row.is_estimate));
        let estimates: Vec<&str> = estimates.filter_map(|row| Some(self.shown(used.get(row)?.1))).collect();
        log.estimated_fixes = (!estimates.is_empty()).then(|| estimates.join(", "));
        for row in &mut log.rows {
            for &(column, value) in self.map.iter().flat_map(|map| map.format().constants.iter()) {
                if row.get(column).is_none() {
                    row.set(column, value);
                }
            }
        }
        Ok(Imported { format, log })
    }

    /// The number that a column is of: of the mapping, or of a message with this row of the table and name; `None` of
    /// what is not one number.
    fn source(&self, column: Column, of: Option<Option<(usize, &str)>>) -> Option<(Column, Source)> {
        let Some(of) = of else {
            let Mapped { name, scale, offset, .. } = self.sources.iter().find(|mapped| mapped.column == column)?;
            return Some((column, Source { name: (*name).to_owned(), scale: *scale, offset: *offset }));
        };
        let (row, name) = of?;
        let number = self.table.messages.get(row)?.takes.iter().find_map(|take| match take {
            Take::Number(number) if number.column == column && number.per.is_none() => Some(number),
            _ => None,
        })?;
        Some((column, Source { name: number_of(name, &number.field), scale: number.scale, offset: number.offset }))
    }

    /// Numbers of messages that neither the table nor the mapping takes.
    fn unread(&self) -> Vec<String> {
        let is_free = |(_, seen): &(&String, &Seen)| seen.row.is_none() && seen.wanted.is_empty();
        let numbers = self.seen.iter().filter(is_free);
        numbers.flat_map(|(name, seen)| seen.fields.iter().map(|field| number_of(name, field))).collect()
    }

    /// The name of a message; of one whose lines name its source, without that where there is no other.
    fn shown<'b>(&self, name: &'b str) -> &'b str {
        let base = name.split('[').next().unwrap_or(name);
        let of_base = |other: &&String| other.split('[').next() == Some(base);
        if self.is_one_by_one && self.seen.keys().filter(of_base).count() == 1 { base } else { name }
    }

    /// What the log has instead of a number that the mapping names.
    fn not_found(&self, name: &str) -> String {
        let beginning = |list: Vec<&str>| {
            let text = list.join(", ");
            if text.chars().count() <= 300 { text } else { text.chars().take(300).collect::<String>() + " ..." }
        };
        let message = self.seen.iter().filter(|(seen, _)| name.strip_prefix(seen.as_str()).is_some_and(is_number));
        match message.max_by_key(|(seen, _)| seen.len()) {
            Some((seen, Seen { fields, .. })) => {
                let fields = beginning(fields.iter().map(String::as_str).filter(|field| !field.is_empty()).collect());
                format!("mapped {name}: no such number; {seen} has {fields}")
            }
            None => {
                let seen = beginning(self.seen.keys().map(String::as_str).collect());
                format!("mapped {name}: no such message; expected MESSAGE.number; the log has {seen}")
            }
        }
    }
}

/// The row of the table, or the mapping, that each column is filled from.
fn owners(kept: &[Kept], is_used: impl Fn(Origin, Column) -> bool) -> BTreeMap<Column, Option<usize>> {
    let mut present: BTreeSet<(Column, Option<usize>)> = BTreeSet::new();
    for (_, from, taken) in kept {
        let columns: Vec<Column> = match taken {
            Taken::Numbers(samples) => samples.iter().map(|(column, _)| *column).collect(),
            Taken::FixDeg(_) => vec![Column::GpsX, Column::GpsY],
        };
        let of_use = columns.into_iter().filter(|column| is_used(*from, *column));
        present.extend(of_use.map(|column| (column, from.0)));
    }
    let mut owners = BTreeMap::new();
    // the mapping is first, then the rows in their order
    for (column, row) in present {
        owners.entry(column).or_insert(row);
    }
    owners
}

/// A number of a message as a mapping names it.
fn number_of(message: &str, field: &str) -> String {
    if field.is_empty() { message.to_owned() } else { format!("{message}.{field}") }
}

/// Whether what follows the name of a message in a mapping names a number of it.
fn is_number(rest: &str) -> bool {
    rest.is_empty() || rest.starts_with(['.', '['])
}
