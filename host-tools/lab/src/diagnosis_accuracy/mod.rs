//! `cargo lab diagnosis-accuracy`: how often `diagnose` names the right cause, over seeded logs of the
//! simulator.

mod estimate;
mod outcome;
mod page;
mod plan;
mod run;
mod sections;
mod separability;
mod sizes;
mod verdicts;

use crate::ensemble::{PageArgs, PartArgs, all_runs};
use crate::store::Key;
use crate::wrap::wrapped;
use page::Page;
use plan::Class;
use run::DiagnosedLog;
use sections::Findings;

/// Seeds below this were used while `diagnose` was developed.
const FIRST_SEED: u64 = 10_000;
/// Version of the study: results of other versions are not mixed in. Raise it whenever a verdict may change.
const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "-13");

const EXAMPLES: &str = "\
Examples:
  cargo lab diagnosis-accuracy --store runs.jsonl                  the whole study; goes on if it was interrupted
  cargo lab diagnosis-accuracy --store runs.jsonl --runs 40        the first forty runs of it
  cargo lab diagnosis-accuracy --runs 20 --first-seed 100          seeds on which `diagnose` may be tried and changed
  cargo lab diagnosis-accuracy --store runs.jsonl --class none,outside    only logs with nothing, or with what is no entry

Each run is a simulated log of half an hour with an undeclared effect, or two or three, or none, or one that is in
no catalogue.";

/// How often the right cause is found: verdicts over simulated logs of undeclared effects
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Number of runs
    #[arg(long, value_name = "N", default_value_t = 1600, value_parser = clap::value_parser!(u64).range(1..1_000_000))]
    runs: u64,
    /// Seed of the first run; those below 10000 were used while `diagnose` was developed
    #[arg(long, value_name = "S", default_value_t = FIRST_SEED)]
    first_seed: u64,
    /// Only seeds of these classes, of those that --runs gives
    #[arg(long, value_name = "CLASS", value_delimiter = ',')]
    class: Vec<Class>,
    #[command(flatten)]
    part: PartArgs,
    #[command(flatten)]
    page: PageArgs,
    /// Length of each log, s.
    #[arg(skip = 1800.0)]
    seconds: f64,
}

/// Runs what is missing and shows the page.
pub fn run(args: &Args) -> anyhow::Result<()> {
    page(args)?.map_or(Ok(()), |page| args.page.show(&page))
}

/// Runs what is missing; the page, unless it is for a part.
fn page(args: &Args) -> anyhow::Result<Option<String>> {
    let seeds = args.first_seed..args.first_seed.saturating_add(args.runs);
    let is_wanted = |seed: &u64| args.class.is_empty() || args.class.contains(&plan::class_of(*seed));
    let jobs: Vec<(Key, ())> = seeds.clone().filter(is_wanted).map(|seed| ((String::new(), seed), ())).collect();
    let finished = all_runs("diagnosis", &args.part, VERSION.to_owned(), &jobs, |seed, ()| {
        let (class, mut spec) = plan::of(seed);
        spec.duration_s = args.seconds;
        run::run(class, &spec, seed)
    })?;
    let Some(finished) = finished else { return Ok(None) };
    let runs: Vec<DiagnosedLog> =
        jobs.iter().zip(finished).map(|(((_, seed), ()), run)| DiagnosedLog { seed: *seed, ..run }).collect();
    let page = Page { study: Findings::new(&runs), runs: &runs, seeds, classes: &args.class };
    Ok(Some(wrapped(&page.markdown())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;
    use std::path::Path;

    /// Logs of five minutes: what is tested is the bookkeeping. Seeds of development: a log with an effect and one
    /// without.
    fn study(folder: &Path, runs: u64, class: Vec<Class>) -> String {
        let mut part = PartArgs::default();
        part.store = Some(folder.join("runs.jsonl"));
        let (page, seconds) = (PageArgs::default(), 300.0);
        super::page(&Args { runs, first_seed: 100, class, part, page, seconds }).unwrap().unwrap()
    }

    #[test]
    fn only_the_classes_asked_for_are_run() {
        let folder = tempfile::tempdir().unwrap();
        let page = study(folder.path(), 2, vec![Class::None]);
        assert!(page.contains("1 runs, seeds 100 to 101"), "{page}");
        assert!(page.contains("--class none"), "{page}");
        assert!(lines(folder.path())[0].contains("\"class\":\"none\""));
    }

    fn lines(folder: &Path) -> Vec<String> {
        let text = std::fs::read_to_string(folder.join("runs.jsonl")).unwrap();
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        lines.sort();
        lines
    }

    #[test]
    #[ignore = "a quarter of a minute: .ci/nightly"]
    fn two_runs_twice_give_the_same_bytes_and_resume() {
        let (once, again) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let page = study(once.path(), 2, Vec::new());
        assert!(page.contains("2 runs, seeds 100 to 101"), "{page}");
        assert!(study(again.path(), 1, Vec::new()).contains("1 runs"));
        // Cut off in the middle of a line, it goes on; a line of other sources is passed over.
        let mut file = std::fs::OpenOptions::new().append(true).open(again.path().join("runs.jsonl")).unwrap();
        write!(file, "{{\"build\":\"another\"}}\n{{\"build\":").unwrap();
        assert_eq!(study(again.path(), 2, Vec::new()), page);
        let others = |line: &String| line.contains("another");
        assert_eq!(
            lines(once.path()),
            lines(again.path()).into_iter().filter(|line| !others(line)).collect::<Vec<_>>()
        );
        assert_eq!(lines(once.path()).len(), 2);
    }
}
