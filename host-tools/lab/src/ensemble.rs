//! An ensemble whose runs are kept: to its end or until Ctrl-C, resumed by the next command, in parts on several
//! machines; and where its page goes.

use crate::store::{Key, Store};
use anyhow::{Context, bail};
use backseat_report::console::{self, Progress};
use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Which flights an ensemble has.
#[derive(clap::Args, Clone, Debug)]
pub struct SeedArgs {
    /// Seeded flights of each world
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,
    /// Seed of the first; the others follow
    #[arg(long, value_name = "N", default_value_t = 1)]
    first_seed: u64,
}

impl SeedArgs {
    /// Their seeds.
    pub fn seeds(&self) -> Range<u64> {
        self.first_seed..self.first_seed + self.runs
    }
}

/// Those of these names, as they were asked for; all of them without a name.
///
/// # Errors
/// A name that none has.
pub fn named<T: Copy>(what: &str, all: &[T], names: &[String], name: fn(&T) -> &str) -> anyhow::Result<Vec<T>> {
    if names.is_empty() {
        return Ok(all.to_vec());
    }
    let find = |wanted: &String| {
        all.iter().find(|one| name(one) == wanted).copied().with_context(|| {
            format!("no {what} {wanted}; there are {}", all.iter().map(name).collect::<Vec<_>>().join(", "))
        })
    };
    names.iter().map(find).collect()
}

/// Writes what was asked for, over an earlier one.
///
/// # Errors
/// A file that cannot be written.
pub fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    std::fs::write(path, text).with_context(|| path.display().to_string())
}

/// Where a page goes besides the terminal.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct PageArgs {
    /// Write the page to this file as well (Markdown)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl PageArgs {
    /// Writes the page and prints it.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn show(&self, page: &str) -> anyhow::Result<()> {
        if let Some(path) = &self.out {
            write(path, page)?;
        }
        console::print(page.as_bytes())
    }
}

/// Where a picture goes.
#[derive(clap::Args, Clone, Debug)]
pub struct PictureArgs {
    /// Write the picture to this file (SVG)
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
}

impl PictureArgs {
    /// The lines of a page that show the picture; none without one.
    pub fn shown(&self, about: &str) -> String {
        let name = self.picture.as_ref().and_then(|path| path.file_name());
        name.map_or_else(String::new, |name| format!("![{about}]({})\n\n", name.display()))
    }

    /// Writes the picture, if it is wanted.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, draw: impl FnOnce() -> String) -> anyhow::Result<()> {
        self.picture.as_ref().map_or(Ok(()), |path| write(path, &draw()))
    }
}

/// Where finished runs are kept, and which part of the ensemble is done here.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct PartArgs {
    /// Keep finished runs in this file and go on from it
    #[arg(long, value_name = "RUNS.jsonl")]
    pub store: Option<PathBuf>,
    /// Do the I-th of N parts only and keep its runs in the store, without a page; `cargo lab merge` joins the stores
    #[arg(long, value_name = "I/N", requires = "store")]
    shard: Option<Shard>,
}

/// A part of an ensemble: the `index`-th of `count`, from 1 on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Shard {
    index: usize,
    count: usize,
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let numbers = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        let shard = numbers.map(|(index, count)| Self { index, count });
        let shard = shard.filter(|shard| (1..=shard.count).contains(&shard.index));
        shard.ok_or_else(|| "expected I/N, I from 1 to N, as in 2/8".to_owned())
    }
}

/// All runs in the order of the jobs; `None` after a part. Those of this part that the store lacks are made on all
/// cores, and each is kept as soon as it is finished. The jobs of an ensemble must always be given in the same order: it
/// says which part a job belongs to.
///
/// # Errors
/// The first run that fails; a run that cannot be kept; an interruption, after which the same command goes on if it has
/// a store.
pub fn all_runs<J: Sync, R: Clone + Send + Serialize + DeserializeOwned>(
    what: impl Into<String>,
    part: &PartArgs,
    version: String,
    jobs: &[(Key, J)],
    run: impl Fn(u64, &J) -> anyhow::Result<R> + Sync,
) -> anyhow::Result<Option<Vec<R>>> {
    static STOP: AtomicBool = AtomicBool::new(false);
    let store = Store::open(part.store.as_deref(), version)?;
    let Shard { index, count } = part.shard.unwrap_or(Shard { index: 1, count: 1 });
    let own = || jobs.iter().skip(index - 1).step_by(count);
    let due: Vec<&(Key, J)> = own().filter(|(key, _)| store.get(key).is_none()).collect();
    if !due.is_empty() {
        let handler = ctrlc::set_handler(|| {
            if STOP.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
            eprintln!("\nending the runs under way; Ctrl-C once more ends at once");
        });
        // A second ensemble of one process (a test) keeps the handler of the first.
        handler.or_else(|error| if matches!(error, ctrlc::Error::MultipleHandlers) { Ok(()) } else { Err(error) })?;
        let progress = Progress::new(what, due.len());
        // In their order: seeds are finished one after the other, so that what an interruption leaves is balanced.
        due.iter().par_bridge().try_for_each(|(key, job)| {
            if !STOP.load(Ordering::Relaxed) {
                let (row, seed) = key;
                let finished = run(*seed, job).with_context(|| format!("{row} seed {seed}"))?;
                store.add(key.clone(), &finished)?;
                progress.advance();
            }
            anyhow::Ok(())
        })?;
    }
    if STOP.load(Ordering::Relaxed) {
        bail!("interrupted; with --store the finished runs are kept");
    }
    if let Some(path) = part.store.as_ref().filter(|_| part.shard.is_some()) {
        let (done, all) = (own().count(), jobs.len());
        console::print(format!("part {index} of {count}: {done} of {all} runs in {}\n", path.display()).as_bytes())?;
        return Ok(None);
    }
    jobs.iter().map(|(key, _)| store.get(key).context("a run is missing")).collect::<Result<_, _>>().map(Some)
}

/// Rows, each with its runs.
pub type RunsByRow<T, R> = Vec<(T, Vec<R>)>;

/// Every row with every seed, seed by seed: the runs of each row, in the order of the seeds; `None` after a part.
///
/// # Errors
/// As [`all_runs`].
pub fn by_row<T: Copy + Sync, R: Clone + Send + Serialize + DeserializeOwned>(
    part: &PartArgs,
    version: String,
    seeds: Range<u64>,
    rows: &[T],
    name: fn(&T) -> &str,
    run: impl Fn(u64, T) -> anyhow::Result<R> + Sync,
) -> anyhow::Result<Option<RunsByRow<T, R>>> {
    let jobs: Vec<(Key, T)> =
        seeds.flat_map(|seed| rows.iter().map(move |row| ((name(row).to_owned(), seed), *row))).collect();
    let Some(runs) = all_runs("flights", part, version, &jobs, |seed, row| run(seed, *row))? else { return Ok(None) };
    let of = |place: usize| runs.iter().skip(place).step_by(rows.len()).cloned().collect();
    Ok(Some(rows.iter().enumerate().map(|(place, row)| (*row, of(place))).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_share_the_jobs_and_together_are_the_whole() {
        let folder = tempfile::tempdir().unwrap();
        let jobs: Vec<(Key, u64)> = (1..=7).map(|seed| ((String::new(), seed), 10 * seed)).collect();
        let run = |store: Option<&str>, shard: Option<&str>| {
            let store = store.map(|name| folder.path().join(name));
            let part = PartArgs { store, shard: shard.map(|text| text.parse().unwrap()) };
            all_runs("jobs", &part, "1".to_owned(), &jobs, |seed, ten| {
                Ok(std::collections::BTreeMap::from([("x".to_owned(), seed + ten)]))
            })
            .unwrap()
        };
        let whole = run(None, None).unwrap();
        assert!(run(Some("a"), Some("1/2")).is_none() && run(Some("b"), Some("2/2")).is_none());
        let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
        let lines = |path: &PathBuf| std::fs::read_to_string(path).unwrap().lines().count();
        assert_eq!([lines(&a), lines(&b)], [4, 3]);
        crate::store::merge(&[a, b], &folder.path().join("c")).unwrap();
        assert_eq!(run(Some("c"), None).unwrap(), whole);
    }

    #[test]
    fn a_part_that_there_is_not_is_refused() {
        for text in ["0/2", "3/2", "1", "a/b", "1/0", "-1/2"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
