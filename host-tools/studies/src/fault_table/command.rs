//! `backseat sim faults`: the fault table.

use super::{JudgedFlight, Row, Summary, fly, markdown, rows, to_json};
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
  backseat sim faults --out docs/results/fault_table.md")]
pub struct Args {
    /// Seeded flights per row.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,
    /// Seed of the first; the others follow.
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    /// Only rows whose name contains this. Can be repeated.
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
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
    let rows = chosen(&arguments.only)?;
    let seeds = arguments.first_seed..arguments.first_seed + arguments.runs;
    // The first seed twice, for determinism.
    let again = std::iter::once(arguments.first_seed);
    let plan: Vec<(&Row, u64)> =
        rows.iter().flat_map(|row| seeds.clone().chain(again.clone()).map(move |seed| (row, seed))).collect();
    let pool = ThreadPoolBuilder::new().num_threads(arguments.jobs).build().context("threads")?;
    let outcomes: Vec<JudgedFlight> = pool.install(|| run_all("flights", &plan, |(row, seed)| Ok(fly(row, *seed))))?;
    let flights = outcomes.chunks(arguments.runs as usize + 1);
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

    let mut made_by = format!("backseat sim faults --runs {} --first-seed {}", arguments.runs, arguments.first_seed);
    for name in &arguments.only {
        made_by += &format!(" --only {name}");
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
    let failed: Vec<&str> = summaries.iter().filter(|s| !s.passes()).map(|s| s.row.name).collect();
    if !failed.is_empty() {
        bail!("{} of {} rows fail: {}", failed.len(), summaries.len(), failed.join(", "));
    }
    Ok(())
}

fn chosen(only: &[String]) -> anyhow::Result<Vec<Row>> {
    let mut rows = rows()?;
    let names: Vec<&str> = rows.iter().map(|row| row.name).collect();
    if let Some(unknown) = only.iter().find(|part| !names.iter().any(|name| name.contains(part.as_str()))) {
        bail!("--only {unknown}: no such row; there are {}", names.join(", "));
    }
    rows.retain(|row| only.is_empty() || only.iter().any(|part| row.name.contains(part.as_str())));
    Ok(rows)
}
