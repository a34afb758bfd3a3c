//! `cargo lab naming`: does the board name what changes in flight?
//!
//! Flights of the default survey without a DVL, closed loop, the vehicle as declared until something changes at a time
//! that a seed draws. Judged by what the board has sent.

mod asking;
mod draw;
mod fly;
mod known;
mod page;
mod using;

use crate::ensemble::{PageArgs, PartArgs, all_runs};
use crate::store::{Key, version};
use draw::{Drawn, drawn};

/// Options of the command.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// How many flights: of seven in a row four have one cause, one two, one none, and one a cause outside the table
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,
    /// Seed of the first; the others follow
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// End each flight after this simulated time
    #[arg(long, value_name = "MIN", default_value_t = 200.0)]
    minutes: f64,
    /// What is gained where this is named and used: each flight named only, used by the filter, and by both
    #[arg(long, value_name = "CAUSE")]
    using: Option<using::Change>,
    /// What is gained where the board flies manoeuvres to name this: each flight without and with them
    #[arg(long, requires = "using")]
    ask: bool,
    #[command(flatten)]
    page: PageArgs,
    #[command(flatten)]
    part: PartArgs,
}

/// Runs it.
///
/// # Errors
/// A flight that fails, a file that cannot be written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    if let Some(change) = args.using {
        return if args.ask { asking::run(args, change) } else { using::run(args, change) };
    }
    let flights: Vec<(Key, Drawn)> = (args.seed..args.seed + args.runs)
        .map(|seed| Ok(((String::new(), seed), drawn(seed, args.minutes)?)))
        .collect::<anyhow::Result<_>>()?;
    let conditions = format!("{} min", args.minutes);
    let flown = all_runs("naming", &args.part, version("naming", &conditions)?, &flights, fly::fly)?;
    let Some(flown) = flown else { return Ok(()) };
    args.page.show(&page::page(&flown, args))
}
