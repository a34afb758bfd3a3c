//! An ensemble whose runs are kept: to its end or until Ctrl-C, resumed by the next command.

use crate::store::{Key, Store};
use anyhow::Context;
use backseat_report::console::Progress;
use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::sync::atomic::{AtomicBool, Ordering};

/// Runs the jobs on all cores, in their order, and keeps each finished run at once; whether Ctrl-C ended it early.
///
/// # Errors
/// The first run that fails; a run that cannot be kept.
pub fn run_and_keep<J: Sync, R: Clone + Send + Serialize + DeserializeOwned>(
    what: impl Into<String>,
    jobs: &[(Key, J)],
    store: &Store<R>,
    run: impl Fn(u64, &J) -> anyhow::Result<R> + Sync,
) -> anyhow::Result<bool> {
    static STOP: AtomicBool = AtomicBool::new(false);
    if jobs.is_empty() {
        return Ok(false);
    }
    let handler = ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        eprintln!("\nending the runs under way; Ctrl-C once more ends at once");
    });
    // A second ensemble of one process (a test) keeps the handler of the first.
    handler.or_else(|error| if matches!(error, ctrlc::Error::MultipleHandlers) { Ok(()) } else { Err(error) })?;
    let progress = Progress::new(what, jobs.len());
    // In their order: seeds are finished one after the other, so that what an interruption leaves is balanced.
    jobs.iter().par_bridge().try_for_each(|((study, seed), job)| {
        if !STOP.load(Ordering::Relaxed) {
            let finished = run(*seed, job).with_context(|| format!("{study} seed {seed}"))?;
            store.add((*study, *seed), &finished)?;
            progress.advance();
        }
        anyhow::Ok(())
    })?;
    Ok(STOP.load(Ordering::Relaxed))
}
