//! `backseat sim short-runs`: short runs of a torpedo as a laboratory's control computer logs them.

use crate::output::print;
use anyhow::bail;
use backseat_report::Report;
use hil_sim::dataset::runs::{self, Wanted};
use std::path::PathBuf;

/// Command line.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Examples:
  backseat sim short-runs --effect random --seed 1 --out runs1
  backseat sim short-runs --effect none --seed 2 --out runs2
then
  backseat diagnose runs1")]
pub struct Args {
    /// What the vehicle does that nobody declares: one or two effects that the seed draws, or none
    #[arg(long, value_name = "random|none", value_parser = wanted)]
    effect: Wanted,
    /// Seed of everything
    #[arg(long, value_name = "N")]
    seed: u64,
    /// Runs of each of the two configurations
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u8).range(1..=20))]
    flown: u8,
    /// Folder for a log and a configuration of each run, and for truth/effects.json
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Print one JSON object on stdout; it does not reveal the effects
    #[arg(long)]
    json: bool,
}

fn wanted(text: &str) -> Result<Wanted, String> {
    match text {
        "random" => Ok(Wanted::Random),
        "none" => Ok(Wanted::None),
        _ => Err("random or none".to_owned()),
    }
}

/// Simulates and writes.
///
/// # Errors
/// A file that exists or cannot be written.
pub fn run(arguments: &Args) -> anyhow::Result<()> {
    let Args { effect, seed, flown, out, json } = arguments;
    if out.join("truth").exists() {
        bail!("{}: holds a data set already", out.display());
    }
    let (flown, hidden) = runs::simulate(*effect, *seed, usize::from(*flown));
    runs::write(&flown, &hidden, *seed, out)?;
    let rows: usize = flown.iter().map(|run| run.rows.len()).sum();
    let report = Report::new("Short runs", format!("{} runs of {rows} rows", flown.len()))
        .file("truth", Some(&out.join("truth")))
        .value("runs", flown.len())
        .value("rows", rows);
    print(&report, *json)
}
