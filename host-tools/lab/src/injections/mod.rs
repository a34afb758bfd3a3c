//! `cargo lab injections`: effects of known size in recorded logs, and whether `diagnose` names and sizes them.
//!
//! A recorded log has the noise that no simulator has. What it holds itself is diagnosed first; then each effect is put
//! into its columns, and the log is diagnosed again.

mod inject;
mod page;
mod score;

use crate::ensemble::{PageArgs, PartArgs, all_runs};
use crate::store::{Key, version};
use anyhow::{Context as _, bail};
use backseat_analysis::diagnose::log_kinds;
use backseat_diagnose::log_models::{LogModelDiagnosis, dead_reckoning};
use backseat_logs::log::plausibility::Examination;
use backseat_logs::{Column, Log, VehicleFile, importers};
use inject::Injection;
use score::{Base, Scored};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A shorter log says too little for any word, s.
const SHORTEST_S: f64 = 300.0;

const EXAMPLES: &str = "\
Examples:
  cargo lab injections logs                     every log in the folder that is diagnosed by dead reckoning
  cargo lab injections logs --store runs.jsonl --out docs/results/injections.md
  cargo lab injections logs --seed 7            sizes, directions and onsets drawn by a seed";

/// Whether `diagnose` names and sizes effects of known size that are put into recorded logs
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Folder of recorded logs; those of five minutes and more that are diagnosed by dead reckoning from fix to fix are used
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    #[command(flatten)]
    page: PageArgs,
    /// Seed by which sizes, directions and onsets are drawn; left out: those listed in the source
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    #[command(flatten)]
    part: PartArgs,
}

/// The injections into one log; the store wants an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Done {
    base: Base,
    scored: Vec<Scored>,
}

/// Puts every effect into every log, diagnoses and writes the page.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let mut paths = Vec::new();
    logs_in(&args.folder, &mut paths)?;
    let mut jobs: Vec<(Key, Log)> = Vec::new();
    let mut refused: Vec<(String, String)> = Vec::new();
    for path in paths {
        // A folder of logs holds other tables as well.
        let Ok(imported) = importers::read(&path) else { continue };
        let is_reckoned = log_kinds::use_of(&imported.log) == Ok(log_kinds::DEAD_RECKONING);
        if is_reckoned && imported.log.duration_s() >= SHORTEST_S {
            let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
            // What `diagnose` refuses is not diagnosed here either.
            match Examination::of(&imported.log).suspicions().next() {
                Some(finding) => refused.push((name, finding.what.clone())),
                None => jobs.push(((name, args.seed.unwrap_or(0)), imported.log)),
            }
        }
    }
    if jobs.is_empty() {
        bail!(
            "{}: no log of five minutes in this folder is diagnosed by dead reckoning: heading, speed and GNSS fixes under way, \
             without fins",
            args.folder.display()
        );
    }
    let vehicle = VehicleFile::reference();
    let done = all_runs("logs", &args.part, version("injections", "")?, &jobs, |_, log| {
        let diagnosed = |log: &Log| -> anyhow::Result<LogModelDiagnosis> {
            dead_reckoning::run(log, &vehicle, true, None).context("too few fixes, headings or speeds")
        };
        let found = diagnosed(log)?;
        let has_dvl = log.has(Column::DvlU) && log.has(Column::DvlV);
        let length_m = vehicle.parameters.length_m;
        let all =
            args.seed.map_or_else(|| inject::all(length_m, has_dvl), |seed| inject::drawn(length_m, has_dvl, seed));
        let is_tested = |injection: &Injection| injection.effect.is_none_or(|effect| score::tests(&found, effect));
        let score =
            |injection: &Injection| anyhow::Ok(score::of(injection, &found, &diagnosed(&injection.apply(log))?));
        let scored = all.iter().filter(|injection| is_tested(injection)).map(score).collect::<Result<_, _>>()?;
        Ok(Done { base: Base::of(&found, log.duration_s()), scored })
    })?;
    let Some(done) = done else { return Ok(()) };
    let logs: Vec<(String, Done)> = jobs.into_iter().map(|((name, _), _)| name).zip(done).collect();
    let text = page::markdown(&logs, &refused, args.seed);
    args.page.show(&text)
}

/// Files below a folder, in the order of their names.
fn logs_in(folder: &Path, found: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    let entries = std::fs::read_dir(folder).with_context(|| format!("{}: a folder of logs", folder.display()))?;
    let mut paths: Vec<PathBuf> = entries.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>()?;
    paths.sort();
    for path in paths {
        if path.is_dir() {
            logs_in(&path, found)?;
        } else {
            found.push(path);
        }
    }
    Ok(())
}
