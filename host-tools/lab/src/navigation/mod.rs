//! `cargo lab navigation`: every filter in undeclared worlds, over an ensemble of seeded missions.
//!
//! Each case is one world: parameters, water, compass and fins differ from what the vehicle file says (`cases`). Each
//! seed is flown once in closed loop by the backseat in this process, steered by the LQR on its own estimate. Its
//! measurements then go through the filters of the table (`filters`). Finished runs are kept, so that a study that was
//! interrupted goes on where it was.

mod cases;
mod filters;
mod run;
mod table;

use crate::ensemble::{PartArgs, Progressed, SeedArgs, run_and_keep};
use crate::store::{Key, Store, version};
use crate::wrap::wrapped;
use anyhow::{Context, bail};
use cases::{CASES, MissionCase};
use run::MissionRun;
use std::path::PathBuf;

/// Command line.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    #[command(flatten)]
    ensemble: SeedArgs,
    /// Cases, separated by commas [default: all]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    cases: Vec<String>,
    /// End each mission after this simulated time
    #[arg(long)]
    minutes: Option<f64>,
    #[command(flatten)]
    part: PartArgs,
    /// Write the tables to this file as well (Markdown)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Flies, filters and prints the tables.
///
/// # Errors
/// An unknown case; a flight or a filter that fails; a file that cannot be written.
pub fn run(arguments: &Args) -> anyhow::Result<()> {
    let cases = selected(&arguments.cases)?;
    let length = arguments.minutes.map_or(String::new(), |minutes| format!("{minutes} min"));
    let store: Store<MissionRun> = Store::open(arguments.part.store.as_deref(), version("navigation", &length)?)?;
    let seeds = arguments.ensemble.seeds();
    let all = seeds.clone().flat_map(|seed| cases.iter().map(move |case| ((case.name.to_owned(), seed), *case)));
    let jobs: Vec<(Key, &MissionCase)> = all.collect();
    let fly = |seed: u64, case: &&MissionCase| run::run(case, seed, arguments.minutes);
    if run_and_keep("flights", &arguments.part, &jobs, &store, fly)? == Progressed::Part {
        return Ok(());
    }
    let results: Vec<(&MissionCase, Vec<(u64, MissionRun)>)> =
        cases.iter().map(|case| (*case, store.of(case.name, seeds.clone()))).collect();
    let text = table::markdown(arguments, &results);
    if let Some(path) = &arguments.out {
        std::fs::write(path, wrapped(&text)).with_context(|| path.display().to_string())?;
    }
    print!("{text}");
    Ok(())
}

fn selected(names: &[String]) -> anyhow::Result<Vec<&'static MissionCase>> {
    if names.is_empty() {
        return Ok(CASES.iter().collect());
    }
    let find = |name: &String| match CASES.iter().find(|case| case.name == name) {
        Some(case) => Ok(case),
        None => {
            let known: Vec<&str> = CASES.iter().map(|case| case.name).collect();
            bail!("no case {name}; there are {}", known.join(", "))
        }
    };
    names.iter().map(find).collect()
}
