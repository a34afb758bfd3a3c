//! `hil-sim consistency`: normalised errors and innovations, and the bound, over an ensemble.

use crate::consistency::{self, Ensemble};

/// What the command line says.
#[derive(clap::Args, Clone, Debug)]
pub struct Arguments {
    /// Seeded flights of each model.
    #[arg(long, default_value_t = 100)]
    runs: u64,
    /// Seed of the first; the others follow.
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    /// Length of each flight, minutes.
    #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u32).range(1..=60))]
    minutes: u32,
    #[arg(long)]
    case: Option<usize>,
    #[arg(long)]
    bound: bool,
}

/// Flies and prints the tables.
///
/// # Errors
/// A filter that fails.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let seeds: Vec<u64> = (arguments.first_seed..arguments.first_seed + arguments.runs).collect();
    for (i, case) in consistency::cases(arguments.minutes)?.iter().enumerate() {
        if arguments.case.is_some_and(|c| c != i) { continue; }
        let began = std::time::Instant::now();
        let ensemble: Ensemble = consistency::run(case, &seeds, || {})?;
        println!("{} {:?}", case.name, began.elapsed());
        for inside in consistency::blocks(&ensemble, 30).iter().chain(&consistency::innovations(&ensemble)) {
            println!("  {:10} dof {:2} mean {:.4} band {:.3} {:.3} meanband {:?} inside {:.3} below {:.3} above {:.3}", inside.name, inside.degrees, inside.mean, inside.band.low, inside.band.high, inside.mean_band, inside.shares[0], inside.shares[1], inside.shares[2]);
        }
        println!("  rejected {}", ensemble.runs.iter().map(|r| r.rejected).sum::<u64>());
        let errors = consistency::errors(&ensemble);
        let bounds = arguments.bound.then(|| consistency::bounds(case, &seeds, || {}));
        println!("  {:?}", began.elapsed());
        for s in [0usize, 1, 5, 30, 60, 120, 200, 300, 400, 500, 600, 700, 800, 900] {
            let Some(e) = errors.get(s) else { continue };
            print!("  {s:4} rmse {:.4} {:.5} {:.5}", e[0], e[1], e[2]);
            if let Some(b) = &bounds {
                for b in [&b.ensemble[s], &b.track[s]] {
                    print!("   {:.4} {:.5} {:.5}", b.position_m2.sqrt(), b.attitude_rad2.sqrt(), b.velocity_m2ps2.sqrt());
                }
            }
            println!();
        }
    }
    Ok(())
}
