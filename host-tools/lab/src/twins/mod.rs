//! `cargo lab twins`: how often `diagnose FOLDER` names the right cause in simulated runs of a torpedo.
//!
//! Each seed gives a folder of runs with hidden effects, each fifth one without. The folder is read and diagnosed as a
//! user's would be; the answer is compared with the truth, which it never sees.

mod page;
mod score;

use crate::ensemble::{PageArgs, PartArgs, SeedArgs, all_runs};
use crate::store::{Key, version};
use backseat_analysis::read_log::ReadLog;
use backseat_diagnose::torpedo;
use backseat_diagnose::torpedo::separable::Known;
use hil_sim::dataset::runs::{self, Wanted};
use score::{Twin, is_of};

const EXAMPLES: &str = "\
Examples:
  cargo lab twins --runs 3
  nice cargo lab twins --runs 100 --store twins.jsonl --out docs/results/torpedo_twins.md";

/// How often `diagnose` names the right cause in simulated short runs of a torpedo
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[command(flatten)]
    ensemble: SeedArgs,
    /// Runs of each of the two configurations
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u8).range(3..=20))]
    flown: u8,
    #[command(flatten)]
    page: PageArgs,
    #[command(flatten)]
    part: PartArgs,
}

/// Simulates, diagnoses and tabulates.
///
/// # Errors
/// A folder that cannot be written or read.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let seeds = args.ensemble.seeds();
    let jobs: Vec<(Key, Wanted)> = seeds
        .clone()
        .map(|seed| {
            let wanted = if seed.is_multiple_of(5) { Wanted::None } else { Wanted::Random };
            ((String::new(), seed), wanted)
        })
        .collect();
    let version = version("twins", &format!("{} runs a configuration", args.flown))?;
    let flown = usize::from(args.flown);
    let Some(twins) = all_runs("data sets", &args.part, version, &jobs, |seed, wanted| twin(seed, *wanted, flown))?
    else {
        return Ok(());
    };
    args.page.show(&page::markdown(&twins, seeds.start, flown))
}

fn twin(seed: u64, wanted: Wanted, flown: usize) -> anyhow::Result<Twin> {
    let folder = tempfile::tempdir()?;
    let (runs, hidden) = runs::simulate(wanted, seed, flown);
    runs::write(&runs, &hidden, seed, folder.path())?;
    let log = ReadLog::of(folder.path(), None)?.log;
    let vehicle = backseat_analysis::diagnose::torpedo::textbook();
    let diagnosis = torpedo::diagnose(&log, &vehicle, torpedo::Predictions::LeftOut, &mut |_| ());
    let names: Vec<&'static str> = hidden.effects.iter().map(|effect| effect.name).collect();
    // runs that no fit takes tell nothing
    let mut known = torpedo::separable::known(&log, &vehicle, &names).unwrap_or_default();
    // fins off their zero are a roll moment to the model
    let per_rad = hidden.roll_moment_uu_per_rad();
    let of_fins = |known: &Known| Known {
        name: "fin_zero_rad".to_owned(),
        sigma: known.sigma / per_rad,
        open: known.open.map(|moment| moment / per_rad),
    };
    let moments: Vec<Known> = known.iter().filter(|known| is_of(known, "k_uu")).map(of_fins).collect();
    known.extend(moments);
    Ok(Twin::of(&hidden.effects, diagnosis.map(|diagnosis| diagnosis.found), &known))
}
