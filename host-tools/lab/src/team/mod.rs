//! `cargo lab team`: four vehicles that hear each other, and a ship that leaves after twenty minutes.
//!
//! | module | |
//! |---|---|
//! | `run` | cases, and the flight of one seed |
//! | `page` | the tables and the picture |

mod page;
mod run;

use crate::ensemble::{PageArgs, PartArgs, PictureArgs, SeedArgs, by_row, named};
use crate::store::version;
use page::FlownCase;
use run::{CASES, TeamCase};

/// Command line.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    #[command(flatten)]
    ensemble: SeedArgs,
    /// Cases, separated by commas [default: all]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    cases: Vec<String>,
    #[command(flatten)]
    part: PartArgs,
    #[command(flatten)]
    page: PageArgs,
    #[command(flatten)]
    picture: PictureArgs,
}

/// Flies and prints the page.
///
/// # Errors
/// An unknown case; a flight that fails; a file that cannot be written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let cases = named("case", &CASES, &args.cases, |case| case.name)?;
    let seeds = args.ensemble.seeds();
    let fly = |seed: u64, case: TeamCase| run::run(case, seed);
    let flown = by_row(&args.part, version("team", "")?, seeds, &cases, |case| case.name, fly)?;
    let Some(flown) = flown else { return Ok(()) };
    let flown: Vec<FlownCase> = flown.into_iter().map(|(case, runs)| FlownCase { case, runs }).collect();
    args.picture.write(|| page::picture(&flown))?;
    args.page.show(&page::page(&flown, args))
}
