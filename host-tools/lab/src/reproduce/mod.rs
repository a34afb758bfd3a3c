//! `cargo lab reproduce`: the thesis' tables and figures beside ours.
//!
//! An `item` is a table or figure: rows and columns of one of the `studies`, which simulate. Items share studies, and
//! a study is run once a seed; the runs become medians and intervals in the `ensemble`, rows of cells in the `grid`, and
//! a page in `markdown` or, with the curves, in `page`.

mod ensemble;
mod grid;
mod item;
mod markdown;
mod page;
mod printed;
mod registry;
mod studies;

use crate::ensemble::{PageArgs, PartArgs, all_runs};
use crate::store::{Key, version};
use anyhow::Context;
use backseat_logs::output::{self, Existing};
use backseat_report::console;
use ensemble::ItemRuns;
use item::Item;
use std::path::PathBuf;
use studies::Study;

const EXAMPLES: &str = "\
Examples:
  cargo lab reproduce --report out              everything, ten runs each; goes on if it was interrupted
  cargo lab reproduce table-4.15 --runs 20      one table
  cargo lab reproduce figure-3.5 table-4.12 --json

Every run is simulated anew from its seed: seeds 1 to N. With --report finished runs are kept in DIR/runs.jsonl.
Tables and figures are named as the thesis numbers them; an unknown name prints the list.";

/// Methods were tuned on seeds from here on.
const FIRST_TUNING_SEED: u64 = 1000;

/// Reproduce the thesis' tables and figures
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Tables, figures and studies [default: all]
    #[arg(value_name = "TABLE|FIGURE", value_parser = registry::known)]
    items: Vec<String>,
    /// Runs of each, with seeds from 1
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..FIRST_TUNING_SEED))]
    runs: u64,
    /// Write a page with the figures into this folder (HTML), and keep finished runs there unless --store says where
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    #[command(flatten)]
    part: PartArgs,
    #[command(flatten)]
    page: PageArgs,
    /// Print one JSON object instead of the page
    #[arg(long, conflicts_with = "out")]
    json: bool,
    /// Replace a report that exists
    #[arg(long)]
    force: bool,
}

/// Runs what is missing and shows all items.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let items = registry::selected(&args.items);
    let jobs = jobs(&items, args.runs);
    let build = version("reproduce", "")?;
    let fly = |seed: u64, study: &&Study| study.run(seed);
    let mut part = args.part.clone();
    if let Some(folder) = &args.report {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        part.store = part.store.or_else(|| Some(folder.join("runs.jsonl")));
    }
    let Some(runs) = all_runs("reproduce", &part, build.clone(), &jobs, fly)? else { return Ok(()) };
    let ensemble = ItemRuns { items: &items, runs: args.runs, build, finished: jobs.into_iter().zip(runs).collect() };
    if let Some(folder) = &args.report {
        let (path, html) = (folder.join("report.html"), page::html(&ensemble));
        let is_there = std::fs::read(&path).is_ok_and(|there| there == html.as_bytes());
        let existing = if args.force || is_there { Existing::Replace } else { Existing::Keep };
        output::write(&path, existing, |file| file.write_all(html.as_bytes()))?;
    }
    if args.json {
        return console::print(ensemble.json().as_bytes());
    }
    args.page.show(&markdown::page(&ensemble))
}

/// Runs of the items' studies, seed by seed.
fn jobs(items: &[&'static Item], runs: u64) -> Vec<(Key, &'static Study)> {
    let mut studies: Vec<&'static Study> = Vec::new();
    for item in items {
        if !studies.iter().any(|study| study.name == item.study.name) {
            studies.push(item.study);
        }
    }
    (1..=runs).flat_map(|seed| studies.iter().map(move |study| ((study.name.to_owned(), seed), *study))).collect()
}
