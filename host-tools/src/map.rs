//! `backseat map`: a draft of the column mapping of another maker's table.

use crate::outcome::Outcome;
use crate::output;
use anyhow::bail;
use backseat_analysis::map;
use backseat_logs::importers;
use backseat_logs::output::{Existing, check, write};
use backseat_report::console;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  backseat map table.csv --out map.toml           a draft with every column, its range and a guess
  backseat info table.csv --columns map.toml      do units and signs fit each other?
  backseat diagnose table.csv --columns map.toml

Guesses come from the names and ranges of the columns; units in names, as in \"Depth (ft)\", are heeded, and words such as
left, up and enu decide the axes of all. The draft is read, its columns are tested against each other, and what physics
contradicts is changed. Each entry is marked \"sure\", with the test that shows it, or \"check\". What still contradicts
stands at the top, and the exit code is 3. The draft lists what it did not use, and says how to write constants,
quaternions and turned axes.";

/// Draft the column mapping of another maker's table
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Table, .csv or .csv.gz, separated by commas, semicolons or tabs
    table: PathBuf,
    /// Write the mapping here instead of printing it
    #[arg(long, value_name = "MAP.toml")]
    out: Option<PathBuf>,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Drafts and writes.
pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    let existing = if args.force { Existing::Replace } else { Existing::Keep };
    if let Some(path) = &args.out {
        check(path, existing)?;
    }
    let draft = importers::draft(&args.table)?;
    if draft.guesses.len() < 2 {
        bail!(
            "{}: no column looks like one of a vehicle log; its columns: {}",
            args.table.display(),
            draft.unused.join(", ")
        );
    }
    if let Some(path) = &args.out {
        write(path, existing, |out| out.write_all(draft.text.as_bytes()))?;
    }
    if args.out.is_none() && !args.json {
        console::print(draft.text.as_bytes())?;
    } else {
        output::print(&map::report(&draft, &args.table, args.out.as_deref()), args.json)?;
    }
    Ok(Outcome::doubtful_if(!draft.doubts.is_empty()))
}
