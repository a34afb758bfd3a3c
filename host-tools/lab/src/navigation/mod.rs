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

use crate::ensemble::{PageArgs, PartArgs, SeedArgs, all_runs, named};
use crate::store::{Key, version};
use crate::wrap::wrapped;
use cases::{CASES, MissionCase};
use run::MissionRun;

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
    #[command(flatten)]
    page: PageArgs,
}

/// Flies, filters and prints the tables.
///
/// # Errors
/// An unknown case; a flight or a filter that fails; a file that cannot be written.
pub fn run(arguments: &Args) -> anyhow::Result<()> {
    let all: Vec<&MissionCase> = CASES.iter().collect();
    let cases = named("case", &all, &arguments.cases, |case| case.name)?;
    let length = arguments.minutes.map_or(String::new(), |minutes| format!("{minutes} min"));
    let version = version("navigation", &length)?;
    let seeds = arguments.ensemble.seeds();
    let all = seeds.flat_map(|seed| cases.iter().map(move |case| ((case.name.to_owned(), seed), *case)));
    let jobs: Vec<(Key, &MissionCase)> = all.collect();
    let fly = |seed: u64, case: &&MissionCase| run::run(case, seed, arguments.minutes);
    let Some(runs) = all_runs("flights", &arguments.part, version, &jobs, fly)? else { return Ok(()) };
    let of_case = |case: &MissionCase| {
        let own = jobs.iter().zip(&runs).filter(|(((name, _), _), _)| name == case.name);
        own.map(|(((_, seed), _), run)| (*seed, run)).collect()
    };
    let results: Vec<(&MissionCase, Vec<(u64, &MissionRun)>)> =
        cases.iter().map(|case| (*case, of_case(case))).collect();
    arguments.page.show(&wrapped(&table::markdown(arguments, &results)))
}
