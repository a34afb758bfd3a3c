//! `cargo lab alone`: five hours without ship, DVL or fixes, after twenty minutes of ranges.
//!
//! | module | |
//! |---|---|
//! | `worlds` | ways and waters, as scenarios |
//! | `run` | a flight, and the filters over its measurements |
//! | `aids` | what an operator could add: a DVL, a range, a fix now and then |
//! | `bound` | the least error that is possible |
//! | `page` | the tables and the picture |

mod aids;
mod bound;
mod page;
mod run;
pub(crate) mod worlds;

use crate::ensemble::{PageArgs, PartArgs, PictureArgs, SeedArgs, all_runs, named};
use crate::store::{Key, version};
use page::FlownWorld;
use worlds::{WORLDS, World};

/// Command line.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    #[command(flatten)]
    ensemble: SeedArgs,
    /// Worlds, separated by commas [default: all]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    worlds: Vec<String>,
    #[command(flatten)]
    part: PartArgs,
    #[command(flatten)]
    page: PageArgs,
    #[command(flatten)]
    picture: PictureArgs,
}

/// Flies, filters and prints the page.
///
/// # Errors
/// An unknown world; a flight or a filter that fails; a file that cannot be written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let worlds = named("world", &WORLDS, &args.worlds, |world| world.name)?;
    let seeds = args.ensemble.seeds();
    let all = seeds.flat_map(|seed| worlds.iter().map(move |world| ((world.name.to_owned(), seed), *world)));
    let jobs: Vec<(Key, World)> = all.collect();
    let fly = |seed: u64, world: &World| run::run(*world, seed);
    let Some(runs) = all_runs("flights", &args.part, version("alone", "")?, &jobs, fly)? else { return Ok(()) };
    let of_world =
        |world: &World| jobs.iter().zip(&runs).filter(|((_, of), _)| of == world).map(|(_, run)| run).collect();
    let flown: Vec<FlownWorld<'_>> =
        worlds.iter().map(|world| FlownWorld { world: *world, runs: of_world(world) }).collect();
    args.picture.write(|| page::picture(&flown))?;
    args.page.show(&page::page(&flown, args))
}
