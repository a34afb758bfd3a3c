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

use crate::ensemble::{PageArgs, PartArgs, PictureArgs, SeedArgs, by_row, named};
use crate::store::version;
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
    let fly = |seed: u64, world: World| run::run(world, seed);
    let flown = by_row(&args.part, version("alone", "")?, seeds, &worlds, |world| world.name, fly)?;
    let Some(flown) = flown else { return Ok(()) };
    let flown: Vec<FlownWorld> = flown.into_iter().map(|(world, runs)| FlownWorld { world, runs }).collect();
    args.picture.write(|| page::picture(&flown))?;
    args.page.show(&page::page(&flown, args))
}
