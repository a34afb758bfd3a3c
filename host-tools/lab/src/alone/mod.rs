//! `cargo lab alone`: five hours without ship, DVL or fixes, after twenty minutes of ranges.

mod bound;
mod run;
mod worlds;

use crate::ensemble::{PartArgs, all_runs};
use crate::store::{Key, version};
use worlds::{WORLDS, World};

/// Command line.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// Seeded flights of each world
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,
    /// Seed of the first; the others follow
    #[arg(long, value_name = "N", default_value_t = 1)]
    first_seed: u64,
    /// Worlds, separated by commas [default: all]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    worlds: Vec<String>,
    /// Flights at a time [default: one a core]
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    #[command(flatten)]
    part: PartArgs,
}

/// Flies, filters and prints the page.
///
/// # Errors
/// An unknown world; a flight or a filter that fails; a file that cannot be written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    if let Some(jobs) = args.jobs {
        // Fails only if something has used the pool before: its size then stays.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(jobs).build_global();
    }
    let seeds = args.first_seed..args.first_seed + args.runs;
    let chosen = WORLDS.iter().filter(|world| args.worlds.is_empty() || args.worlds.iter().any(|name| name == world.name));
    let worlds: Vec<&World> = chosen.collect();
    let jobs: Vec<(Key, &World)> =
        seeds.flat_map(|seed| worlds.iter().map(move |world| ((world.name.to_owned(), seed), *world))).collect();
    let Some(runs) = all_runs("flights", &args.part, version("alone", "")?, &jobs, |seed, world| run::run(world, seed))? else {
        return Ok(());
    };
    for (((name, seed), _), alone) in jobs.iter().zip(&runs) {
        println!("{name} {seed}: distance {:.0} level ratio {:.2}", alone.distance_m, alone.level_ratio);
        for (row, points) in &alone.rows {
            print!("  {row:12}");
            for p in points.iter().step_by(6) {
                print!(" {:7.1}/{:7.1}", p.error(), p.drms_m);
            }
            println!();
        }
        print!("  bound       ");
        for b in alone.bounds_m.iter().step_by(6) {
            print!(" {:7.1}/{:7.1}", b[0], b[1]);
        }
        println!();
    }
    Ok(())
}
