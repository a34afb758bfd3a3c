//! `cargo lab team`: four vehicles that hear each other, and a ship that leaves after twenty minutes.
//!
//! | module | |
//! |---|---|
//! | `run` | cases, and the flight of one seed |
//! | `page` | the tables and the picture |

mod page;
mod run;

use crate::ensemble::{PageArgs, PartArgs, PictureArgs, SeedArgs, all_runs, named};
use crate::store::{Key, version};
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
    let all =
        args.ensemble.seeds().flat_map(|seed| cases.iter().map(move |case| ((case.name.to_owned(), seed), *case)));
    let jobs: Vec<(Key, TeamCase)> = all.collect();
    let fly = |seed: u64, case: &TeamCase| run::run(*case, seed);
    let Some(runs) = all_runs("flights", &args.part, version("team", "")?, &jobs, fly)? else { return Ok(()) };
    let of_case =
        |case: &TeamCase| jobs.iter().zip(&runs).filter(|((_, of), _)| of == case).map(|(_, run)| run).collect();
    let flown: Vec<page::FlownCase<'_>> =
        cases.iter().map(|case| page::FlownCase { case: *case, runs: of_case(case) }).collect();
    args.picture.write(|| page::picture(&flown))?;
    args.page.show(&page::page(&flown, args))
}
