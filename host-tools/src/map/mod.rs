//! `backseat map`: a draft of the column mapping of another maker's table.

use anyhow::bail;
use backseat_logs::importers;
use backseat_logs::output::{self, Existing};
use backseat_report::console;
use serde_json::{Map, Value, json};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  backseat map table.csv --out map.toml           a draft with every column, its range and a guess
  backseat info table.csv --columns map.toml      do units and signs fit each other?
  backseat diagnose table.csv --columns map.toml

Guesses come from the names and ranges of the columns; units in names, as in \"Depth (ft)\", are heeded. The draft lists
what it did not use, and says how to write constants, quaternions and turned axes.";

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
pub fn run(args: &Args) -> anyhow::Result<()> {
    let existing = if args.force { Existing::Replace } else { Existing::Keep };
    let draft = importers::draft(&args.table)?;
    if draft.guesses.len() < 2 {
        bail!(
            "{}: no column looks like one of a vehicle log; its columns: {}",
            args.table.display(),
            draft.unused.join(", ")
        );
    }
    if let Some(path) = &args.out {
        output::write(path, existing, |out| out.write_all(draft.text.as_bytes()))?;
    }
    let text = if args.json {
        let guesses: Map<String, Value> =
            draft.guesses.iter().map(|(column, guess)| (column.clone(), json!(guess))).collect();
        format!("{}\n", json!({"map": draft.text, "guesses": guesses, "unused": draft.unused, "out": args.out}))
    } else if let Some(path) = &args.out {
        let (map, table) = (path.display(), args.table.display());
        format!(
            "{} columns guessed, {} not used: {map}\nnext: read it, then backseat info {table} --columns {map}\n",
            draft.guesses.len(),
            draft.unused.len()
        )
    } else {
        draft.text
    };
    console::print(text.as_bytes())
}
