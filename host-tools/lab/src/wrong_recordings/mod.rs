//! `cargo lab wrong-recordings`: logs that are recorded wrongly in every way that is known, and logs that are not.
//!
//! Whoever says how a log was recorded must say so of every wrong one and of no right one. A wrong recording is made of
//! a right one by an exact change of its columns, so that the mend is known.

mod change;
mod judge;
mod latest;
mod logs;
mod page;
mod recordings;

use crate::ensemble::{PageArgs, PartArgs, all_runs};
use crate::store::{Key, version};
use backseat_logs::Log;
use backseat_logs::log::plausibility::Examination;
use judge::{Judged, judge};
use logs::{Base, Clean};
use page::{Page, Row};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Seeds below this were used while the tests of columns were written.
const FIRST_SEED: u64 = 10_000;

const EXAMPLES: &str = "\
Examples:
  cargo lab wrong-recordings                                          simulated logs only
  cargo lab wrong-recordings --log iver.csv --held-out other.csv --out docs/results/wrong_recordings.md
  cargo lab wrong-recordings --first-seed 1 --clean 20                seeds on which the tests may be tried and changed";

/// Whether a log that is recorded wrongly is told, and one that is recorded rightly is not
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// A recorded log, right as it is, on which the tests of columns were tried; may be repeated
    #[arg(long, value_name = "LOG")]
    log: Vec<PathBuf>,
    /// A recorded log, right as it is, that nobody looked at; may be repeated
    #[arg(long, value_name = "LOG")]
    held_out: Vec<PathBuf>,
    /// Seed of the first simulated log; those below 10000 were used while the tests were written
    #[arg(long, value_name = "S", default_value_t = FIRST_SEED)]
    first_seed: u64,
    /// Simulated logs that are recorded rightly
    #[arg(long, value_name = "N", default_value_t = 120)]
    clean: u64,
    #[command(flatten)]
    page: PageArgs,
    #[command(flatten)]
    part: PartArgs,
    /// Length of the simulated logs in which wrong recordings are made, s
    #[arg(skip = 1800.0)]
    seconds: f64,
}

/// One log, done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Done {
    /// Every mistake that it has the columns for.
    Wrong { clean: Vec<String>, judged: BTreeMap<String, Judged> },
    /// What is said against a log that is right.
    Clean { what: String, accused: Vec<String> },
}

enum Job {
    Base(Base),
    Clean(Clean),
}

/// Makes the recordings, examines them and writes the page.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let seeds = [args.first_seed, args.first_seed + 1];
    let simulated =
        [Base::Dives { seed: seeds[0], seconds: args.seconds }, Base::Lines { seed: seeds[1], seconds: args.seconds }];
    let files = args.log.iter().chain(&args.held_out).map(|path| Base::File(path.clone()));
    let bases: Vec<Base> = simulated.into_iter().chain(files).collect();
    let mut jobs: Vec<(Key, Job)> =
        bases.iter().map(|base| ((base.name(), args.first_seed), Job::Base(base.clone()))).collect();
    jobs.extend((0..args.clean).map(|k| {
        let kind = match k % 6 {
            4 => Clean::WithEffect,
            5 => Clean::Vessel,
            _ => Clean::AsDeclared,
        };
        (("clean".to_owned(), args.first_seed + 100 + k), Job::Clean(kind))
    }));
    let version = version("wrong-recordings", &format!("{} s", args.seconds))?;
    let done = all_runs("logs", &args.part, version, &jobs, |seed, job| {
        Ok(match job {
            Job::Base(base) => wrongly(&base.log()?),
            Job::Clean(kind) => {
                let (what, log) = logs::clean(*kind, seed)?;
                Done::Clean { what, accused: accusations(&log) }
            }
        })
    })?;
    let Some(done) = done else { return Ok(()) };
    let row = |(base, done): (&Base, &Done)| match done {
        Done::Wrong { clean, judged } => Some(Row {
            name: base.name(),
            is_held_out: matches!(base, Base::File(path) if args.held_out.contains(path)),
            clean: clean.clone(),
            judged: judged.clone(),
        }),
        Done::Clean { .. } => None,
    };
    let clean = jobs.iter().zip(&done).filter_map(|(((_, seed), job), done)| match (job, done) {
        (Job::Clean(kind), Done::Clean { what, accused }) => {
            Some((*kind, *seed, format!("{}: {what}", page::kind(*kind)), accused.clone()))
        }
        _ => None,
    });
    let page = Page {
        first_seed: args.first_seed,
        seconds: args.seconds,
        clean: clean.collect(),
        rows: bases.iter().zip(&done).filter_map(row).collect(),
    };
    args.page.show(&page.markdown())
}

/// Every mistake made in one log.
fn wrongly(log: &Log) -> Done {
    let each = latest::all();
    let judged = each.iter().filter_map(|wrong| Some((wrong.name.clone(), judge(wrong, log)?))).collect();
    Done::Wrong { clean: accusations(log), judged }
}

fn accusations(log: &Log) -> Vec<String> {
    Examination::of(log).suspicions().map(|finding| finding.message.clone()).collect()
}

#[cfg(test)]
mod tests;
