//! `backseat export`: a log as tables for anybody, and for Foxglove.

mod foxglove;
mod tables;

use crate::decode::{self, Decoding};
use anyhow::bail;
use backseat_logs::session::{Axis, Clock, Damage, Entry, Event, Reader};
use backseat_report::console::{self, Progress};
use backseat_wire::hostlink::Port;
use clap::ArgGroup;
use foxglove::Written;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use tables::Tables;

/// Times of a PC after this are since 1970, not since a simulation began, µs.
const CALENDAR_US: u64 = 1_000_000_000_000_000;

const EXAMPLES: &str = "\
Examples:
  backseat export dive.mcap --csv dive
  backseat export LOG00012.BSL --csv dive --foxglove dive_foxglove.mcap

LOG is a session (backseat record, backseat sim run) or the log of a board's memory card. It is decoded with the parameters
that stand in it. In the folder of --csv:
  vehicle_log.csv  raw samples and commands, as backseat navigate, identify and diagnose read them: they apply
                   the [installation] of the vehicle file (arms, turns, delays), once
  telemetry.csv    the board's estimate at every step    fusion.csv  each of its innovations    events.csv  modes, notes
t_s counts from the board's start; in a session of backseat record from the first byte. After a reset it goes on: where
UTC has it, or a step behind what was before. The file of --foxglove opens in
Foxglove with the layout that is written beside it (Import layout from file): map, 3D, plots.";

/// Export a session or a board's log as CSV, or for Foxglove
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
#[command(group = ArgGroup::new("what").args(["csv", "foxglove"]).required(true).multiple(true))]
pub struct Args {
    /// Session (.mcap) or board log (.BSL)
    log: PathBuf,
    /// Folder for the tables
    #[arg(long, value_name = "DIR")]
    csv: Option<PathBuf>,
    /// File for Foxglove; its layout is written beside it
    #[arg(long, value_name = "OUT.mcap")]
    foxglove: Option<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Results of an export.
struct ExportSummary {
    tables: Option<[(&'static str, u64); 4]>,
    foxglove: Option<Written>,
    damage: Damage,
    parameters_known: bool,
    board_heard: bool,
    utc_known: bool,
}

/// Exports.
///
/// # Errors
/// A log that cannot be read, a file that exists or cannot be written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    // before any output is made for a file that is not a log
    Reader::open(&args.log)?;
    let utc_offset_us = args.foxglove.as_ref().map(|_| utc_offset_us(&args.log)).transpose()?.flatten();
    let mut tables = args.csv.as_ref().map(|folder| Tables::create(folder, args.force)).transpose()?;
    let mut topics = args
        .foxglove
        .as_ref()
        .map(|path| {
            if is_same(path, &args.log) {
                bail!("{}: is the log itself", path.display());
            }
            foxglove::create(path, args.force, utc_offset_us.map_or(0, |us| i64::try_from(us).unwrap_or(0)))
        })
        .transpose()?;
    let mut board_heard = false;
    let (decoding, damage) = decode_log(&args.log, "export", |entry, decoding| {
        board_heard |= matches!(entry.event, Event::Sent { port: Port::Host, .. });
        let mut outcome = Ok(());
        let frame = decode::frame(&decoding.settings().app);
        decoding.take(entry, &mut |found| {
            if let (Ok(()), Some(tables)) = (&outcome, &mut tables) {
                outcome = tables.take(&found);
            }
            if let (Ok(()), Some(topics)) = (&outcome, &mut topics) {
                outcome = topics.take(&found, frame);
            }
        });
        outcome
    })?;
    let outcome = ExportSummary {
        tables: tables.map(Tables::finish).transpose()?,
        foxglove: topics.map(foxglove::finish).transpose()?,
        damage,
        parameters_known: decoding.parameters_known,
        board_heard,
        utc_known: decoding.utc_offset_us().is_some(),
    };
    if args.json {
        console::print(format!("{}\n", outcome.json(args)).as_bytes())
    } else {
        console::print(outcome.text(args).as_bytes())
    }
}

/// Hands a log over entry by entry, its times from zero on.
pub fn decode_log(
    path: &Path,
    what: &'static str,
    mut take: impl FnMut(&Entry, &mut Decoding) -> anyhow::Result<()>,
) -> anyhow::Result<(Decoding, Damage)> {
    let mut reader = Reader::open(path)?;
    let progress = Progress::new(what, usize::try_from(reader.position().1)?);
    let is_host = reader.meta().clock == Clock::Host;
    let mut base_us = None;
    let mut decoding = Decoding::new(None);
    let mut axis = Axis::of(path)?;
    while let Some(entry) = reader.next() {
        let mut entry = entry?;
        entry.time_us = axis.place(entry.time_us);
        let base_us = *base_us.get_or_insert_with(|| {
            let calendar = is_host && entry.time_us > CALENDAR_US;
            if calendar {
                decoding = Decoding::new(Some(entry.time_us));
            }
            if calendar { entry.time_us } else { 0 }
        });
        entry.time_us = entry.time_us.saturating_sub(base_us);
        take(&entry, &mut decoding)?;
        progress.set(usize::try_from(reader.position().0)?);
    }
    Ok((decoding, reader.damage()))
}

/// UTC at the log's time zero, µs since 1970, as the board knew it at the end.
fn utc_offset_us(path: &Path) -> anyhow::Result<Option<u64>> {
    let (decoding, _) = decode_log(path, "export", |entry, decoding| {
        // known from the board's telemetry alone
        if matches!(entry.event, Event::Sent { port: Port::Host, .. }) {
            decoding.take(entry, &mut |_| {});
        }
        Ok(())
    })?;
    Ok(decoding.utc_offset_us())
}

fn is_same(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

impl ExportSummary {
    fn notes(&self, args: &Args) -> Vec<String> {
        let mut notes = Vec::new();
        let Damage { unfinished, cut_bytes, broken_records } = self.damage;
        if unfinished || cut_bytes > 0 {
            notes.push(format!("{}: cut off; {cut_bytes} bytes behind the last whole record", args.log.display()));
        }
        if broken_records > 0 {
            notes.push(format!("{}: {broken_records} broken records were left out", args.log.display()));
        }
        if !self.parameters_known {
            notes.push("the log does not contain the board's parameters; decoded with the default ones".to_owned());
        }
        if !self.board_heard {
            notes.push("the log contains no telemetry of the board".to_owned());
        } else if !self.utc_known {
            notes.push("UTC is not in the log; times count from the board's start".to_owned());
        }
        notes
    }

    fn json(&self, args: &Args) -> Value {
        let table = |(name, rows): &(&str, u64)| {
            let path = args.csv.as_ref().map(|folder| folder.join(name).display().to_string());
            (name.trim_end_matches(".csv").to_owned(), json!({"file": path, "rows": rows}))
        };
        let foxglove = self.foxglove.as_ref().map(|written| {
            let Written { path, layout, messages } = written;
            json!({"file": path.display().to_string(), "layout": layout.display().to_string(), "messages": messages})
        });
        json!({
            "log": args.log.display().to_string(),
            "csv": self.tables.as_ref().map(|tables| tables.iter().map(table).collect::<Map<_, _>>()),
            "foxglove": foxglove,
            "notes": self.notes(args),
        })
    }

    fn text(&self, args: &Args) -> String {
        let mut text = String::new();
        if let (Some(tables), Some(folder)) = (&self.tables, &args.csv) {
            for (name, rows) in tables {
                text += &format!("{}  {rows} rows\n", folder.join(name).display());
            }
        }
        if let Some(Written { path, layout, messages }) = &self.foxglove {
            text += &format!("{}  {messages} messages\n{}  layout\n", path.display(), layout.display());
        }
        for note in self.notes(args) {
            text += &format!("note: {note}\n");
        }
        text
    }
}
