//! `cargo lab judge`: is the bound that the board states a bound? Flights drawn over the scenario language, judged by
//! truth and telemetry alone.
//!
//! | module | |
//! |---|---|
//! | `classes` | what may be wrong, with sizes and their sources |
//! | `draw` | mission, ship and trouble by a seed |
//! | `watch` | a flight against truth |
//! | `page` | the table by class, and the diagram |

mod classes;
mod draw;
mod page;
mod watch;

use crate::ensemble::{PageArgs, PartArgs, PictureArgs, all_runs, write};
use crate::store::{Key, version};
use anyhow::Context;
use backseat_report::console;
use classes::Which;
use draw::{Drawn, Options, drawn};
use std::path::{Path, PathBuf};
use watch::judge;

/// Options of the command.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// How many flights
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,
    /// Seed of the first; the others follow
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// From which half of the classes
    #[arg(long, value_enum, default_value_t = Which::All)]
    classes: Which,
    /// Longest flight, h; the shortest is half an hour
    #[arg(long, value_name = "H", default_value_t = 12.0)]
    hours: f64,
    /// Write the scenarios here instead of flying them
    #[arg(long, value_name = "DIR")]
    scenarios: Option<PathBuf>,
    #[command(flatten)]
    page: PageArgs,
    #[command(flatten)]
    picture: PictureArgs,
    #[command(flatten)]
    part: PartArgs,
}

/// Runs it.
///
/// # Errors
/// A scenario that cannot be read, a flight that fails, a file that cannot be written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let options = Options { which: args.classes, longest_h: args.hours };
    let flights: Vec<(Key, Drawn)> = (args.seed..args.seed + args.runs)
        .map(|seed| Ok(((String::new(), seed), drawn(seed, options)?)))
        .collect::<anyhow::Result<_>>()?;
    if let Some(folder) = &args.scenarios {
        return write_scenarios(folder, &flights);
    }
    let conditions = format!("{:?} {} h", args.classes, args.hours);
    let judged = all_runs("judge", &args.part, version("judge", &conditions)?, &flights, |_, drawn| judge(drawn))?;
    let Some(judged) = judged else { return Ok(()) };
    args.picture.write(|| page::picture(&judged))?;
    args.page.show(&page::page(&judged, args))
}

fn write_scenarios(folder: &Path, flights: &[(Key, Drawn)]) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    for ((_, seed), drawn) in flights {
        let path = folder.join(format!("drawn_{seed}.toml"));
        write(&path, &drawn.text)?;
    }
    console::print(format!("{} scenarios in {}\n", flights.len(), folder.display()).as_bytes())
}
