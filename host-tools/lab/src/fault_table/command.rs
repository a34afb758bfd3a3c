//! `cargo lab faults`: the fault table.

use super::{JudgedFlight, Row, Summary, drawn, drawn_markdown, fly, markdown, rows, ship_of};
use crate::ensemble::{PageArgs, write};
use crate::wrap::wrapped;
use anyhow::{Context, bail};
use backseat_link::{Client, Ports};
use backseat_report::console::Progress;
use hil_sim::backseat::{InProcess, Qemu, build_image};
use hil_sim::faults::Board;
use hil_sim::flight;
use rayon::prelude::*;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

/// Command line.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Examples:
  cargo lab faults
  cargo lab faults --only dvl_false_lock --runs 1
  cargo lab faults --random 60 --seed 1
  cargo lab faults --random 60 --only heading_trim_flooding --scenarios drawn
  cargo lab faults --backseat qemu --only lost_ --only packet_ --minutes 8
  cargo lab faults --out docs/results/fault_table.md")]
pub struct Args {
    /// Seeded flights per row [default: 5; 1 with --random].
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..))]
    runs: Option<u64>,
    /// Seed of the first; the others follow.
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    /// Only rows whose name contains this. Can be repeated.
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// Instead of the table: so many rows of two or three faults and undeclared effects, with sizes, drawn by --seed,
    /// each flown --runs times (once unless it is given).
    #[arg(long, value_name = "N")]
    random: Option<usize>,
    /// Seed of what is drawn.
    #[arg(long, value_name = "S", default_value_t = 1, requires = "random")]
    seed: u64,
    /// Write the scenarios of the drawn rows to this folder, for `sim run`.
    #[arg(long, value_name = "DIR", requires = "random")]
    scenarios: Option<PathBuf>,
    /// `qemu` flies each row once with the app in this process and once with the ARM image in QEMU, and compares
    /// digests.
    #[arg(long, value_enum, default_value = "host", conflicts_with_all = ["random", "out", "runs"])]
    backseat: Backseat,
    /// Ends the flights of --backseat qemu after so many minutes.
    #[arg(long, value_name = "M", value_parser = minutes)]
    minutes: Option<f64>,
    #[command(flatten)]
    page: PageArgs,
}

/// Where the app runs.
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Backseat {
    /// In this process.
    Host,
    /// In QEMU.
    Qemu,
}

fn minutes(text: &str) -> Result<f64, String> {
    let minutes: f64 = text.parse().map_err(|_| "not a number")?;
    if (0.1..=1e4).contains(&minutes) { Ok(minutes) } else { Err("expected 0.1 to 10000".to_owned()) }
}

/// Flies and prints the table.
///
/// # Errors
/// A row that fails; a file that cannot be written.
pub fn run(arguments: &Args) -> anyhow::Result<()> {
    if arguments.backseat == Backseat::Qemu {
        return in_qemu(arguments);
    }
    if let Some(count) = arguments.random {
        let runs = arguments.runs.unwrap_or(1);
        let summaries = flown(&drawn_rows(count, arguments)?, runs, arguments)?;
        let made_by = format!("cargo lab faults --random {count} --seed {} --runs {runs}", arguments.seed);
        // a drawn row has no limits of its own to fail
        return arguments.page.show(&wrapped(&drawn_markdown(&summaries, &made_by)));
    }
    let runs = arguments.runs.unwrap_or(5);
    let summaries = flown(&chosen(&arguments.only)?, runs, arguments)?;
    let mut made_by = format!("cargo lab faults --runs {runs} --first-seed {}", arguments.first_seed);
    for name in &arguments.only {
        made_by += &format!(" --only {name}");
    }
    arguments.page.show(&wrapped(&markdown(&summaries, &made_by)))?;
    let failed: Vec<&str> = summaries.iter().filter(|s| !s.passes()).map(|s| s.row.name.as_str()).collect();
    if !failed.is_empty() {
        bail!("{} of {} rows fail: {}", failed.len(), summaries.len(), failed.join(", "));
    }
    Ok(())
}

/// The chosen ones of so many drawn rows; writes their scenarios where --scenarios asks for them.
fn drawn_rows(count: usize, arguments: &Args) -> anyhow::Result<Vec<Row>> {
    let mut drawn = drawn(count, arguments.seed)?;
    choose(&mut drawn, &arguments.only, |(row, _)| &row.name)?;
    if let Some(folder) = &arguments.scenarios {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        for (row, text) in &drawn {
            let text = text.replace("\"../iver3.toml\"", "\"iver3.toml\"");
            write(&folder.join(format!("{}.toml", row.name)), &text)?;
        }
        write(&folder.join("iver3.toml"), include_str!("../../../../hil-sim/scenarios/iver3.toml"))?;
    }
    Ok(drawn.into_iter().map(|(row, _)| row).collect())
}

/// Flies rows with so many seeds each, the first seed twice, for determinism.
fn flown(rows: &[Row], runs: u64, arguments: &Args) -> anyhow::Result<Vec<Summary>> {
    let seeds = arguments.first_seed..arguments.first_seed + runs;
    let again = std::iter::once(arguments.first_seed);
    let plan: Vec<(&Row, u64)> =
        rows.iter().flat_map(|row| seeds.clone().chain(again.clone()).map(move |seed| (row, seed))).collect();
    let progress = Progress::new("flights", plan.len());
    let finished = plan.par_iter().map(|(row, seed)| fly(row, *seed)).inspect(|_| progress.advance());
    let outcomes: Vec<JudgedFlight> = finished.collect();
    let summary = |(row, flights): (&Row, &[JudgedFlight])| {
        let (again, first) = flights.split_last().expect("one flight at least");
        let mut outcomes = first.to_vec();
        if outcomes[0].digest != again.digest || outcomes[0].spells != again.spells {
            outcomes[0].violations.push("another digest when flown again".to_owned());
        }
        Summary { row: row.clone(), outcomes }
    };
    Ok(rows.iter().zip(outcomes.chunks(runs as usize + 1)).map(summary).collect())
}

/// Each row once by the app in this process and once by the ARM image in QEMU: the digests have to be the same.
fn in_qemu(arguments: &Args) -> anyhow::Result<()> {
    let mut rows = chosen(&arguments.only)?;
    // QEMU's board cannot be reset from here, and has no memory for parameters
    rows.retain(|row| !Board::is_touched(&row.scenario.settings.faults));
    let image = build_image()?;
    let mut other = Vec::new();
    for row in &mut rows {
        let settings = &mut row.scenario.settings;
        settings.duration_s = settings.duration_s.min(arguments.minutes.map_or(f64::INFINITY, |m| 60.0 * m));
        let host = digest(row, arguments.first_seed, InProcess::new())?;
        let qemu = digest(row, arguments.first_seed, Qemu::start(&image)?)?;
        let same = if host == qemu { "the same" } else { "ANOTHER" };
        println!("{}: host {host:016x}, QEMU {qemu:016x}: {same}", row.name);
        if host != qemu {
            other.push(row.name.clone());
        }
    }
    if !other.is_empty() {
        bail!("{} of {} rows have another digest in QEMU: {}", other.len(), rows.len(), other.join(", "));
    }
    println!("{} rows have the host's digest in QEMU", rows.len());
    Ok(())
}

/// The digest of a row flown on this board.
fn digest(row: &Row, seed: u64, ports: impl Ports) -> anyhow::Result<u64> {
    let mut scenario = row.scenario.clone();
    scenario.settings.seed = seed;
    let (mut client, mut ship) = (Client::new(ports), ship_of(&scenario)?);
    Ok(flight::fly_with_ship(&scenario, &mut client, ship.as_mut(), None, &AtomicBool::new(false), |_| ())?.digest)
}

fn chosen(only: &[String]) -> anyhow::Result<Vec<Row>> {
    let mut rows = rows()?;
    choose(&mut rows, only, |row| &row.name)?;
    Ok(rows)
}

/// Keeps what has one of these in its name; all of it without any.
fn choose<T>(rows: &mut Vec<T>, only: &[String], name: fn(&T) -> &str) -> anyhow::Result<()> {
    let names: Vec<&str> = rows.iter().map(name).collect();
    if let Some(unknown) = only.iter().find(|part| !names.iter().any(|name| name.contains(part.as_str()))) {
        bail!("--only {unknown}: no such row; there are {}", names.join(", "));
    }
    rows.retain(|row| only.is_empty() || only.iter().any(|part| name(row).contains(part.as_str())));
    Ok(())
}
