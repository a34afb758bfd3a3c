//! Many seeded runs on all cores, with one progress bar.

use backseat_report::console::Progress;
use rayon::prelude::*;

/// Runs every job on all cores; the results in the order of the jobs.
///
/// # Errors
/// The first run that fails.
pub fn run_all<J: Sync, R: Send>(
    what: impl Into<String>,
    jobs: &[J],
    run: impl Fn(&J) -> anyhow::Result<R> + Sync,
) -> anyhow::Result<Vec<R>> {
    let progress = Progress::new(what, jobs.len());
    let finished = jobs.par_iter().map(|job| run(job).inspect(|_| progress.advance()));
    finished.collect()
}
