//! Files that are no logs of columns: sessions, board logs, truth; settings are in `settings`.

use crate::duration::span;
use crate::settings_file::{self as settings, Described};
use backseat_logs::importers;
use backseat_logs::session::{Event, Reader};
use backseat_logs::{DataError, Log, Truth, kinds};
use backseat_report::Report;
use std::io::Read as _;
use std::path::Path;

/// What a file is that is no log of columns; `None` for what may be one.
///
/// # Errors
/// A file that says what it is and is broken.
pub fn describe(path: &Path) -> anyhow::Result<Option<Report>> {
    if let Some((what, next)) = kinds::of(path).filter(|_| path.is_file()) {
        return Err(DataError::file(path, format!("{what}, of no use here: {next}")).into());
    }
    if path.is_dir() {
        return Ok(None);
    }
    let found = if path.extension().is_some_and(|extension| extension == "toml") {
        Some(settings::describe(path)?)
    } else if is_session(path)? {
        Some(session(path)?)
    } else {
        truth(path)
    };
    Ok(found.map(|found| report(path, found)))
}

fn report(path: &Path, (what, facts, next): Described) -> Report {
    let file = path.display().to_string();
    let report = Report::new(file.clone(), format!("{file}: {what}"));
    let report = facts.iter().fold(report, |report, fact| report.text(&format!("  {fact}")));
    let next = next.replace("FILE", &file);
    let report = report.section("Next").text(&next).value("file", file).value("format", what);
    report.value("facts", facts).value("next", next).value("verdict", "usable")
}

/// By the first bytes: MCAP, or no text.
fn is_session(path: &Path) -> Result<bool, DataError> {
    if path.is_dir() {
        return Ok(false);
    }
    let mut head = [0; 64];
    let mut file = kinds::open(path)?;
    let count = file.read(&mut head).map_err(|e| DataError::io(path, &e))?;
    let is_board_log = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("bsl"));
    Ok(importers::is_bag(&head[..count]) == Some(false) || is_board_log)
}

fn session(path: &Path) -> anyhow::Result<Described> {
    let mut reader = Reader::open(path)?;
    let meta = reader.meta().clone();
    let mut facts = vec![format!("written by {}", meta.program)];
    facts.extend(meta.facts.iter().map(|(name, value)| format!("{name}: {value}")));
    let (mut first_us, mut last_us, mut steps) = (None, 0, 0_u64);
    let mut bytes: Vec<(String, usize)> = Vec::new();
    let (mut notes, mut lost) = (Vec::new(), 0_u64);
    for entry in reader.by_ref() {
        let entry = entry?;
        first_us = first_us.or(Some(entry.time_us));
        last_us = last_us.max(entry.time_us);
        match entry.event {
            Event::Received { port, bytes: chunk } => add(&mut bytes, format!("to {}", port.name()), chunk.len()),
            Event::Sent { port, bytes: chunk } => add(&mut bytes, format!("from {}", port.name()), chunk.len()),
            Event::Step { .. } => steps += 1,
            Event::Note(note) => notes.push(note),
            Event::Lost(count) => lost += u64::from(count),
            _ => {}
        }
    }
    let span_s = last_us.saturating_sub(first_us.unwrap_or(0)) as f64 * 1e-6;
    facts.push(format!("{}, {steps} steps of the board", span(span_s)));
    facts.extend(bytes.iter().map(|(way, count)| format!("{way}: {count} bytes")));
    facts.extend(reader.attachments().iter().map(|attached| format!("holds {}", attached.name)));
    facts.extend(notes.into_iter().take(10).map(|note| format!("note: {note}")));
    if lost > 0 {
        facts.push(format!("{lost} records were lost while it was written"));
    }
    let damage = reader.damage();
    if damage.unfinished || damage.cut_bytes > 0 || damage.broken_records > 0 {
        facts.push(format!(
            "damaged: {} bytes behind the last whole record, {} broken records left out",
            damage.cut_bytes, damage.broken_records
        ));
    }
    Ok((
        "session or board log",
        facts,
        "`backseat export FILE --csv DIR` makes DIR/vehicle_log.csv for navigate, identify and diagnose;\n\
               `backseat replay FILE` runs it through the flight code",
    ))
}

fn add(bytes: &mut Vec<(String, usize)>, way: String, count: usize) {
    match bytes.iter_mut().find(|(other, _)| *other == way) {
        Some((_, total)) => *total += count,
        None => bytes.push((way, count)),
    }
}

/// A truth CSV: positions by `x_m` and `y_m`, which no log has.
fn truth(path: &Path) -> Option<Described> {
    if Log::read(path).is_ok_and(|log| !log.notes.iter().any(|note| note.contains("x_m, y_m"))) {
        return None;
    }
    let truth = Truth::read(path).ok()?;
    let (first, last) = (truth.rows.first()?, truth.rows.last()?);
    let span_s = (last.time_us - first.time_us) as f64 * 1e-6;
    let facts = vec![format!("{} rows, {}", truth.rows.len(), span(span_s))];
    let next = "`backseat navigate LOG --truth FILE` compares a log's track with it";
    Some(("truth", facts, next))
}
