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

use crate::ensemble::{PageArgs, PartArgs, SeedArgs, by_row, named};
use crate::store::version;
use crate::wrap::wrapped;
use cases::{CASES, MissionCase};

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
    let fly = |seed: u64, case: &MissionCase| run::run(case, seed, arguments.minutes);
    let results = by_row(&arguments.part, version, seeds, &cases, |case| case.name, fly)?;
    let Some(results) = results else { return Ok(()) };
    arguments.page.show(&wrapped(&table::markdown(arguments, &results)))
}
