//! `cargo lab reproduce`: the thesis' tables and figures beside ours.
//!
//! An `item` is a table or figure: rows and columns of one of the `studies`, which simulate. Items share studies, and
//! a study is run once a seed; finished runs are kept by the `store` and become medians and intervals in the
//! `ensemble`.

mod ensemble;
mod item;
mod markdown;
mod page;
mod printed;
mod registry;
mod studies;
mod text;

use crate::ensemble::{PartArgs, Progressed, run_and_keep};
use crate::store::{Key, Store, version};
use anyhow::{Context, bail};
use backseat_logs::output::{self, Existing};
use backseat_report::console;
use ensemble::ItemRuns;
use item::Item;
use std::path::PathBuf;
use studies::{Measured, Study};

const EXAMPLES: &str = "\
Examples:
  cargo lab reproduce --report out              everything, ten runs each; resumes if it was interrupted
  cargo lab reproduce table-4.15 --runs 20      one table
  cargo lab reproduce figure-3.5 table-4.12

Every run is simulated anew from its seed: seeds 1 to N. With --report finished runs are kept in
DIR/runs.jsonl, and the same command resumes there; Ctrl-C stops the runs under way and reports the finished ones.
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
    /// Write an HTML report into this folder, and keep finished runs there unless --store says where
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    #[command(flatten)]
    part: PartArgs,
    /// Write the tables to this file too, Markdown
    #[arg(long, value_name = "FILE.md")]
    markdown: Option<PathBuf>,
    /// Replace results that exist
    #[arg(long)]
    force: bool,
}

/// Runs what is missing and shows all items.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let items = registry::selected(&args.items);
    let store = open_store(args)?;
    let jobs = jobs(&items, args.runs);
    let page = args.report.as_ref().map(|folder| folder.join("report.html"));
    if jobs.iter().any(|(key, _)| !store.has(key)) {
        // Before the work, not after it.
        for path in [&page, &args.markdown].into_iter().flatten() {
            output::check(path, existing(args))?;
        }
    }
    let progressed = run_and_keep("reproduce", &args.part, &jobs, &store, |seed, study| study.run(seed))?;
    if progressed == Progressed::Part {
        return Ok(());
    }
    let ensemble = ItemRuns { items: &items, runs: args.runs, store: &store };
    if let Some(path) = &page {
        write(args, path, &page::html(&ensemble))?;
    }
    if let Some(path) = &args.markdown {
        write(args, path, &markdown::page(&ensemble))?;
    }
    console::print(text::tables(&ensemble, args.items.is_empty()).as_bytes())?;
    if let Some(path) = page {
        console::print(format!("\nreport   {}\n", path.display()).as_bytes())?;
    }
    if progressed == Progressed::Interrupted {
        bail!("interrupted: the result covers the finished runs only");
    }
    Ok(())
}

fn existing(args: &Args) -> Existing {
    if args.force { Existing::Replace } else { Existing::Keep }
}

fn open_store(args: &Args) -> anyhow::Result<Store<Measured>> {
    if let Some(folder) = &args.report {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let in_report = args.report.as_ref().map(|folder| folder.join("runs.jsonl"));
    Store::open(args.part.store.clone().or(in_report).as_deref(), version("reproduce", "")?)
}

/// Writes a result, unless an identical file exists.
fn write(args: &Args, path: &std::path::Path, text: &str) -> anyhow::Result<()> {
    if std::fs::read(path).is_ok_and(|there| there == text.as_bytes()) {
        return Ok(());
    }
    Ok(output::write(path, existing(args), |file| file.write_all(text.as_bytes()))?)
}

/// Runs of the items' studies, seed by seed: what an interruption leaves is an ensemble of each.
fn jobs(items: &[&'static Item], runs: u64) -> Vec<(Key, &'static Study)> {
    let mut studies: Vec<&'static Study> = Vec::new();
    for item in items {
        if !studies.iter().any(|study| study.name == item.study.name) {
            studies.push(item.study);
        }
    }
    (1..=runs).flat_map(|seed| studies.iter().map(move |study| ((study.name.to_owned(), seed), *study))).collect()
}
