//! Finished runs on disk, one JSON line each, written at once; a stored run is not repeated.
//!
//! A line belongs to one build or version of the program: results of another stay where they are and are not mixed in.

use anyhow::{Context, bail};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::hash::Hasher;
use std::io::{Read, Write};
use std::ops::Range;
use std::path::Path;
use std::sync::Mutex;

/// A run: the name of its study, empty if the file has one study only, and its seed.
pub type Key = (&'static str, u64);

/// One line of the file.
#[derive(Serialize, Deserialize)]
struct Line<R> {
    build: String,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    study: String,
    seed: u64,
    #[serde(flatten)]
    run: R,
}

/// Finished runs, in memory and, if there is a file, in it.
pub struct Store<R> {
    build: String,
    kept: Mutex<Kept<R>>,
}

struct Kept<R> {
    file: Option<File>,
    /// By study and seed.
    runs: BTreeMap<(String, u64), R>,
}

impl<R: Clone + Serialize + DeserializeOwned> Store<R> {
    /// Opens the file, or makes it; `None` keeps runs in memory only.
    ///
    /// # Errors
    /// A file that cannot be read or written, or has a line that is no run.
    pub fn open(path: Option<&Path>, build: String) -> anyhow::Result<Self> {
        let mut runs = BTreeMap::new();
        let Some(path) = path else { return Ok(Self { build, kept: Mutex::new(Kept { file: None, runs }) }) };
        let name = || path.display().to_string();
        let mut file = OpenOptions::new().read(true).append(true).create(true).open(path).with_context(name)?;
        let mut text = String::new();
        file.read_to_string(&mut text).with_context(name)?;
        // The program ended while it wrote the rest of this line.
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        file.set_len(whole as u64).with_context(name)?;
        for (index, line) in text[..whole].lines().enumerate() {
            let place = || format!("{}, line {}: not a run of this command", name(), index + 1);
            let value: Value = serde_json::from_str(line).with_context(place)?;
            match value["build"].as_str() {
                Some(of) if of == build => {
                    let Line { study, seed, run, .. } = serde_json::from_value(value).with_context(place)?;
                    runs.insert((study, seed), run);
                }
                Some(_) => {}
                None => bail!(place()),
            }
        }
        Ok(Self { build, kept: Mutex::new(Kept { file: Some(file), runs }) })
    }

    /// Which build or version of the program the runs are of.
    pub fn build(&self) -> &str {
        &self.build
    }

    /// Whether a run is there.
    pub fn has(&self, (study, seed): Key) -> bool {
        self.kept.lock().is_ok_and(|kept| kept.runs.contains_key(&(study.to_owned(), seed)))
    }

    /// Keeps a finished run. Returns it as a later reader of the file will see it, to the bit.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn add(&self, (study, seed): Key, run: &R) -> anyhow::Result<()> {
        let line = Line { build: self.build.clone(), study: study.to_owned(), seed, run: run.clone() };
        let line = format!("{}\n", serde_json::to_string(&line)?);
        let Line { run, .. } = serde_json::from_str(&line).context("a run that cannot be read back")?;
        let mut kept = self.kept.lock().map_err(|_| anyhow::anyhow!("a run panicked"))?;
        if let Some(file) = &mut kept.file {
            file.write_all(line.as_bytes())?;
        }
        kept.runs.insert((study.to_owned(), seed), run);
        Ok(())
    }

    /// The finished runs of a study with these seeds, in order.
    pub fn of(&self, study: &str, seeds: Range<u64>) -> Vec<(u64, R)> {
        let Ok(kept) = self.kept.lock() else { return Vec::new() };
        let runs = kept.runs.range((study.to_owned(), seeds.start)..(study.to_owned(), seeds.end));
        runs.map(|((_, seed), run)| (*seed, run.clone())).collect()
    }
}

/// Digest of the running program's file.
///
/// # Errors
/// If it cannot be read.
pub fn program_digest() -> anyhow::Result<String> {
    let path = std::env::current_exe().context("the program's own file")?;
    let bytes = std::fs::read(&path).with_context(|| path.display().to_string())?;
    let mut hasher = std::hash::DefaultHasher::new();
    hasher.write(&bytes);
    Ok(format!("{:016x}", hasher.finish()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    struct Run {
        value: f64,
    }

    fn open(path: &Path) -> anyhow::Result<Store<Run>> {
        Store::open(Some(path), "this".to_owned())
    }

    #[test]
    fn a_later_reader_sees_the_same_bits() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("runs.jsonl");
        let store = open(&path).unwrap();
        for (seed, value) in [(1, 0.1 + 0.2), (3, 1.0 / 3.0)] {
            store.add(("study", seed), &Run { value }).unwrap();
        }
        let later = open(&path).unwrap();
        assert!(later.has(("study", 3)) && !later.has(("study", 2)) && !later.has(("other", 1)));
        assert_eq!(store.of("study", 1..4), later.of("study", 1..4));
        assert_eq!(later.of("study", 1..3), [(1, Run { value: 0.1 + 0.2 })]);
    }

    #[test]
    fn a_line_cut_off_and_another_build_are_passed_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("runs.jsonl");
        open(&path).unwrap().add(("study", 1), &Run { value: 1.0 }).unwrap();
        let mut file = OpenOptions::new().append(true).open(&path).unwrap();
        write!(file, "{{\"build\":\"another\",\"seed\":2}}\n{{\"build\":").unwrap();
        let store = open(&path).unwrap();
        assert_eq!(store.of("study", 1..9).len(), 1);
        store.add(("study", 3), &Run { value: 3.0 }).unwrap();
        let seeds = |store: &Store<Run>| store.of("study", 1..9).iter().map(|(seed, _)| *seed).collect::<Vec<_>>();
        assert_eq!(seeds(&open(&path).unwrap()), [1, 3]);
        std::fs::write(&path, "{}\n").unwrap();
        let error = open(&path).err().unwrap().to_string();
        assert!(error.contains("line 1"), "{error}");
    }
}
