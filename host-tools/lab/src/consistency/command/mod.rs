//! `cargo lab consistency`: normalised errors and innovations, and the bound, over an ensemble.

mod figures;
mod text;

use crate::consistency::{self, Bounds, DeclaredCase, Inside};
use crate::ensemble::{PageArgs, PartArgs, PictureArgs, all_runs};
use crate::store::{Key, version};
use crate::wrap::wrapped;
use backseat_logs::stats::median;
use serde::{Deserialize, Serialize};

/// Command line.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Examples:
  cargo lab consistency
  cargo lab consistency --runs 20 --minutes 5
  cargo lab consistency --out docs/results/consistency.md --picture docs/results/consistency.svg")]
pub struct Args {
    /// Seeded flights of each model.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u64).range(2..=10_000))]
    runs: u64,
    /// Seed of the first model's first flight; the others follow, those of the next model from 10 000 more on.
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    /// Length of each flight.
    #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u32).range(2..=60))]
    minutes: u32,
    #[command(flatten)]
    page: PageArgs,
    #[command(flatten)]
    picture: PictureArgs,
    #[command(flatten)]
    part: PartArgs,
}

/// Seeds between one model's first and the next one's.
const SEEDS_PER_MODEL: u64 = 10_000;
/// The prior has worn off, and every sensor has been heard, s.
const SETTLED_S: usize = 60;
/// Quantities of errors and bounds, with their units.
const QUANTITIES: [(&str, &str); 3] = [("position", "m"), ("attitude", "rad"), ("velocity", "m/s")];

/// Names of the two sets of real flights.
const STILL: &str = "flights in still water";
const CURRENT: &str = "flights in a current";

/// Results of one model.
#[derive(Clone, Serialize, Deserialize)]
struct ConsistencyRow {
    name: String,
    blocks: Vec<Inside>,
    innovations: Vec<Inside>,
    rejected: u64,
    bound: Option<AgainstBound>,
}

/// Errors beside their bounds.
#[derive(Clone, Serialize, Deserialize)]
struct AgainstBound {
    /// Root mean squared errors by second, of [`QUANTITIES`].
    errors: Vec<[f64; 3]>,
    /// Roots of the bounds, along each track and over the ensemble.
    bounds: [Vec<[f64; 3]>; 2],
}

/// Median, least and greatest of a ratio over time.
struct Ratio {
    median: f64,
    least: f64,
    greatest: f64,
}

impl AgainstBound {
    fn new(errors: Vec<[f64; 3]>, bounds: &Bounds) -> Self {
        let roots = |of: &[consistency::Least]| {
            of.iter()
                .map(|least| [least.position_m2, least.attitude_rad2, least.velocity_m2ps2].map(f64::sqrt))
                .collect()
        };
        Self { errors, bounds: [roots(&bounds.track), roots(&bounds.ensemble)] }
    }

    /// RMSE over one of the bounds.
    fn ratio(&self, bound: usize, quantity: usize) -> Ratio {
        let both = self.errors.iter().zip(&self.bounds[bound]).skip(SETTLED_S);
        let ratios: Vec<f64> = both.map(|(error, bound)| error[quantity] / bound[quantity]).collect();
        Ratio {
            median: median(&ratios).unwrap_or(f64::NAN),
            least: ratios.iter().copied().fold(f64::INFINITY, f64::min),
            greatest: ratios.iter().copied().fold(0.0, f64::max),
        }
    }
}

/// Flies and prints the tables.
///
/// # Errors
/// A flight or a filter that fails; a file that cannot be written.
pub fn run(arguments: &Args) -> anyhow::Result<()> {
    let cases = consistency::cases(arguments.minutes)?;
    let declared = cases.iter().map(|case| (case.name.to_owned(), RowJob::Declared(case)));
    let flights =
        [(STILL, false), (CURRENT, true)].map(|(name, current)| (name.to_owned(), RowJob::Flights { current }));
    // The two sets of flights have the same seeds: in a current and in still water.
    let seeds = (0..cases.len()).chain([cases.len(); 2]).map(|row| arguments.first_seed + row as u64 * SEEDS_PER_MODEL);
    let jobs: Vec<(Key, RowJob)> =
        declared.chain(flights).zip(seeds).map(|((name, job), seed)| ((name, seed), job)).collect();
    let version = version("consistency", &format!("{} runs, {} min", arguments.runs, arguments.minutes))?;
    let finished = all_runs("rows", &arguments.part, version, &jobs, |seed, job| {
        let seeds: Vec<u64> = (seed..seed + arguments.runs).collect();
        job.run(&seeds, arguments.minutes)
    })?;
    let Some(mut finished) = finished else { return Ok(()) };
    let flights = finished.split_off(cases.len());
    let [declared, flights]: [Vec<ConsistencyRow>; 2] =
        [finished, flights].map(|of| of.into_iter().flat_map(|finished| finished.rows).collect());

    arguments.picture.write(|| figures::normalised(&declared))?;
    arguments.page.show(&wrapped(&text::markdown(arguments, &declared, &flights)))
}

/// What is kept of one job.
#[derive(Clone, Serialize, Deserialize)]
struct FinishedRows {
    rows: Vec<ConsistencyRow>,
}

/// One row, or the rows of one set of flights.
enum RowJob<'a> {
    Declared(&'a DeclaredCase),
    Flights { current: bool },
}

impl RowJob<'_> {
    fn run(&self, seeds: &[u64], minutes: u32) -> anyhow::Result<FinishedRows> {
        let rows = match self {
            Self::Declared(case) => {
                let ensemble = consistency::run(case, seeds)?;
                let errors = consistency::errors(&ensemble);
                let bounds = case.bounded.then(|| consistency::bounds(case, seeds));
                vec![ConsistencyRow::of(&ensemble, bounds.map(|bounds| AgainstBound::new(errors, &bounds)))]
            }
            Self::Flights { current } => {
                let flown = consistency::surveys(minutes, seeds, *current)?;
                flown.iter().map(|ensemble| ConsistencyRow::of(ensemble, None)).collect()
            }
        };
        Ok(FinishedRows { rows })
    }
}

impl ConsistencyRow {
    fn of(ensemble: &consistency::Ensemble, bound: Option<AgainstBound>) -> Self {
        Self {
            name: ensemble.name.clone(),
            blocks: consistency::blocks(ensemble, SETTLED_S),
            innovations: consistency::innovations(ensemble),
            rejected: ensemble.runs.iter().map(|run| run.rejected).sum(),
            bound,
        }
    }
}
