//! `backseat sim faults`: the fault table.

use super::{JudgedFlight, Row, Summary, drawn, fly, markdown, rows, share, to_json};
use crate::ensemble::run_all;
use crate::table::wrapped;
use anyhow::{Context, bail};
use rayon::ThreadPoolBuilder;
use std::path::PathBuf;

/// Command line.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Examples:
  backseat sim faults
  backseat sim faults --only dvl_false_lock --runs 1 --json
  backseat sim faults --random 60 --seed 1
  backseat sim faults --out docs/results/fault_table.md")]
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
    /// Instead of the table: so many rows of two or three faults and undeclared effects, with sizes, drawn by --seed, each
    /// flown --runs times (once unless it is given).
    #[arg(long, value_name = "N", conflicts_with_all = ["only", "out"])]
    random: Option<usize>,
    /// Seed of what is drawn.
    #[arg(long, value_name = "S", default_value_t = 1, requires = "random")]
    seed: u64,
    /// Write the table to this file as well (Markdown).
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    json: bool,
    /// Flights at a time [default: one a processor].
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    jobs: usize,
}

/// Flies and prints the table.
///
/// # Errors
/// A row that fails; a file that cannot be written.
pub fn run(arguments: &Args) -> anyhow::Result<()> {
    let rows = match arguments.random {
        Some(count) => drawn(count, arguments.seed)?,
        None => chosen(&arguments.only)?,
    };
    let runs = arguments.runs.unwrap_or(if arguments.random.is_some() { 1 } else { 5 });
    let seeds = arguments.first_seed..arguments.first_seed + runs;
    // The first seed twice, for determinism.
    let again = std::iter::once(arguments.first_seed);
    let plan: Vec<(&Row, u64)> =
        rows.iter().flat_map(|row| seeds.clone().chain(again.clone()).map(move |seed| (row, seed))).collect();
    let pool = ThreadPoolBuilder::new().num_threads(arguments.jobs).build().context("threads")?;
    let outcomes: Vec<JudgedFlight> = pool.install(|| run_all("flights", &plan, |(row, seed)| Ok(fly(row, *seed))))?;
    let flights = outcomes.chunks(runs as usize + 1);
    let summaries: Vec<Summary> = rows
        .iter()
        .zip(flights)
        .map(|(row, flights)| {
            let (again, first) = flights.split_last().expect("one flight at least");
            let mut outcomes = first.to_vec();
            if outcomes[0].digest != again.digest || outcomes[0].spells != again.spells {
                outcomes[0].violations.push("another digest when flown again".to_owned());
            }
            Summary { row: row.clone(), outcomes }
        })
        .collect();

    let mut made_by = format!("backseat sim faults --runs {runs} --first-seed {}", arguments.first_seed);
    for name in &arguments.only {
        made_by += &format!(" --only {name}");
    }
    if arguments.random.is_some() {
        return print_drawn(&summaries, arguments.json);
    }
    let text = markdown(&summaries, &made_by);
    if let Some(path) = &arguments.out {
        std::fs::write(path, wrapped(&text)).with_context(|| path.display().to_string())?;
    }
    if arguments.json {
        println!("{}", to_json(&summaries));
    } else {
        print!("{text}");
    }
    let failed: Vec<&str> = summaries.iter().filter(|s| !s.passes()).map(|s| s.row.name.as_str()).collect();
    if !failed.is_empty() {
        bail!("{} of {} rows fail: {}", failed.len(), summaries.len(), failed.join(", "));
    }
    Ok(())
}

/// A line a drawn row, and the share of silent flights. A drawn row has no limits of its own to fail.
fn print_drawn(summaries: &[Summary], json: bool) -> anyhow::Result<()> {
    if json {
        println!("{}", to_json(summaries));
        return Ok(());
    }
    for Summary { row, outcomes } in summaries {
        let faults: Vec<String> = row.scenario.settings.faults.iter().map(ToString::to_string).collect();
        for flight in outcomes {
            let [silent_s, deep_s] = flight.silent_s;
            println!(
                "{}: silent {silent_s:.0} s, in depth {deep_s:.0} s; error {:.1} m at most, {:.1} m deep, navigating {:.0} %; {}{}",
                row.name,
                flight.error_m[1],
                flight.deepest_m,
                100.0 * flight.navigating,
                if flight.violations.is_empty() { "kept" } else { "BROKEN " },
                flight.violations.join("; "),
            );
        }
        if !faults.is_empty() {
            println!("    {}", faults.join(", "));
        }
    }
    println!("{}", share(summaries));
    Ok(())
}

fn chosen(only: &[String]) -> anyhow::Result<Vec<Row>> {
    let mut rows = rows()?;
    let names: Vec<&str> = rows.iter().map(|row| row.name.as_str()).collect();
    if let Some(unknown) = only.iter().find(|part| !names.iter().any(|name| name.contains(part.as_str()))) {
        bail!("--only {unknown}: no such row; there are {}", names.join(", "));
    }
    rows.retain(|row| only.is_empty() || only.iter().any(|part| row.name.contains(part.as_str())));
    Ok(rows)
}
