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

use crate::ensemble::{PartArgs, Progressed, run_and_keep};
use crate::store::{Key, Store};
use crate::wrap::wrapped;
use anyhow::{Context, bail};
use backseat_logs::output::{self, Existing};
use backseat_report::console;
use page::Page;
use plan::Class;
use run::DiagnosedLog;
use sections::Findings;
use std::path::PathBuf;

/// Seeds below this were used while `diagnose` was developed.
const FIRST_SEED: u64 = 10_000;
/// The only study of its file.
const STUDY: &str = "";
/// Version of the study: results of other versions are not mixed in. Raise it whenever a verdict may change.
const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "-13");

const EXAMPLES: &str = "\
Examples:
  cargo lab diagnosis-accuracy --out study                  the whole study; resumes if it was interrupted
  cargo lab diagnosis-accuracy --out study --runs 40        the first forty runs of it
  cargo lab diagnosis-accuracy --out try --first-seed 100   seeds on which `diagnose` may be tried and changed
  cargo lab diagnosis-accuracy --out study --class none,outside   only logs with nothing, or with what is no entry

Each run is a simulated log of half an hour with an undeclared effect, or two or three, or none, or one that is in
no catalogue.
Finished runs are kept in DIR/runs.jsonl (or in --store), and the same command resumes there. Ctrl-C stops the runs under way. The page,
DIR/study.md, covers the finished runs.";

/// How often the right cause is found: verdicts over simulated logs of undeclared effects
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Folder of the runs and of the page
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
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
    /// Length of each log, s.
    #[arg(skip = 1800.0)]
    seconds: f64,
}

impl Args {
    fn wants(&self, seed: u64) -> bool {
        self.class.is_empty() || self.class.contains(&plan::class_of(seed))
    }
}

/// Runs what is missing, writes the page and shows it.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let (text, progressed) = finish(args)?;
    console::print(text.as_bytes())?;
    if progressed == Progressed::Interrupted {
        bail!("interrupted: the result covers the finished runs only");
    }
    Ok(())
}

/// Runs what is missing and writes the page; what is to be shown, and how far it came.
fn finish(args: &Args) -> anyhow::Result<(String, Progressed)> {
    std::fs::create_dir_all(&args.out).with_context(|| args.out.display().to_string())?;
    let path = args.part.store.clone().unwrap_or_else(|| args.out.join("runs.jsonl"));
    let store = Store::open(Some(&path), VERSION.to_owned())?;
    let seeds = args.first_seed..args.first_seed.saturating_add(args.runs);
    let progressed = work(args, &store)?;
    if progressed == Progressed::Part {
        return Ok((String::new(), progressed));
    }
    let finished = store.of(STUDY, seeds.clone()).into_iter().filter(|(seed, _)| args.wants(*seed));
    let runs: Vec<DiagnosedLog> = finished.map(|(seed, run)| DiagnosedLog { seed, ..run }).collect();
    let asked = seeds.clone().filter(|seed| args.wants(*seed)).count();
    let page = Page { study: Findings::new(&runs), runs: &runs, seeds, asked, classes: &args.class };
    let markdown = wrapped(&page.markdown());
    // The page is made from the runs alone, so that it can be written again.
    output::write(&args.out.join("study.md"), Existing::Replace, |file| file.write_all(markdown.as_bytes()))?;
    Ok((markdown, progressed))
}

/// Runs what is missing.
fn work(args: &Args, store: &Store<DiagnosedLog>) -> anyhow::Result<Progressed> {
    let seeds = args.first_seed..args.first_seed.saturating_add(args.runs);
    let wanted = seeds.filter(|seed| args.wants(*seed));
    let jobs: Vec<(Key, ())> = wanted.map(|seed| ((STUDY.to_owned(), seed), ())).collect();
    run_and_keep("diagnosis", &args.part, &jobs, store, |seed, ()| {
        let (class, mut spec) = plan::of(seed);
        spec.duration_s = args.seconds;
        run::run(class, &spec, seed)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;
    use std::path::Path;

    /// Logs of five minutes: what is tested is the bookkeeping.
    fn study(folder: &Path, runs: u64) -> String {
        // Seeds of development: a log with an effect and one without.
        finish(&args(folder, runs, Vec::new())).unwrap().0
    }

    fn args(folder: &Path, runs: u64, class: Vec<Class>) -> Args {
        Args { out: folder.to_owned(), runs, first_seed: 100, class, part: PartArgs::default(), seconds: 300.0 }
    }

    #[test]
    fn only_the_classes_asked_for_are_run() {
        let folder = tempfile::tempdir().unwrap();
        let (page, _) = finish(&args(folder.path(), 2, vec![Class::None])).unwrap();
        assert!(page.contains("1 of 1 runs, seeds 100 to 101"), "{page}");
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
        let page = study(once.path(), 2);
        assert!(page.contains("2 of 2 runs, seeds 100 to 101"), "{page}");
        assert!(study(again.path(), 1).contains("1 of 1 runs"));
        // Cut off in the middle of a line, it goes on; a line of other sources is passed over.
        let mut file = std::fs::OpenOptions::new().append(true).open(again.path().join("runs.jsonl")).unwrap();
        write!(file, "{{\"build\":\"another\"}}\n{{\"build\":").unwrap();
        assert_eq!(study(again.path(), 2), page);
        let others = |line: &String| line.contains("another");
        assert_eq!(
            lines(once.path()),
            lines(again.path()).into_iter().filter(|line| !others(line)).collect::<Vec<_>>()
        );
        assert_eq!(lines(once.path()).len(), 2);
    }
}
