//! Finished runs on disk, one JSON line each, written at once; a stored run is not repeated.
//!
//! A line belongs to one version of the results: those of another stay where they are and are not mixed in.

use anyhow::{Context, bail};
use backseat_logs::output::{self, Existing};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fs::{File, OpenOptions};
use std::hash::Hasher;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// A run: the name of its row or study, empty if the file has one only, and its seed.
pub type Key = (String, u64);

/// One line of the file.
#[derive(Serialize, Deserialize)]
struct StoredRun<R> {
    build: String,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    study: String,
    seed: u64,
    #[serde(flatten)]
    run: R,
}

/// What every line begins with, whatever its study.
#[derive(Deserialize)]
struct Label {
    build: String,
    #[serde(default)]
    study: String,
    seed: u64,
}

/// Finished runs, in memory and, if there is a file, in it.
pub struct Store<R> {
    build: String,
    kept: Mutex<Kept<R>>,
}

struct Kept<R> {
    file: Option<File>,
    runs: BTreeMap<Key, R>,
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
                    let StoredRun { study, seed, run, .. } = serde_json::from_value(value).with_context(place)?;
                    runs.insert((study, seed), run);
                }
                Some(_) => {}
                None => bail!(place()),
            }
        }
        Ok(Self { build, kept: Mutex::new(Kept { file: Some(file), runs }) })
    }

    /// A finished run.
    pub fn get(&self, key: &Key) -> Option<R> {
        self.kept.lock().ok()?.runs.get(key).cloned()
    }

    /// Keeps a finished run, as a later reader of the file will see it, to the bit.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn add(&self, (study, seed): Key, run: &R) -> anyhow::Result<()> {
        let line = StoredRun { build: self.build.clone(), study: study.clone(), seed, run: run.clone() };
        let line = format!("{}\n", serde_json::to_string(&line)?);
        let StoredRun { run, .. } = serde_json::from_str(&line).context("a run that cannot be read back")?;
        let mut kept = self.kept.lock().map_err(|_| anyhow::anyhow!("a run panicked"))?;
        if let Some(file) = &mut kept.file {
            file.write_all(line.as_bytes())?;
        }
        kept.runs.insert((study, seed), run);
        Ok(())
    }
}

/// Which results these are: those of one build of the program, one command and one set of conditions.
///
/// # Errors
/// If the program's own file cannot be read.
pub fn version(command: &str, conditions: &str) -> anyhow::Result<String> {
    let path = std::env::current_exe().context("the program's own file")?;
    let bytes = std::fs::read(&path).with_context(|| path.display().to_string())?;
    let mut hasher = std::hash::DefaultHasher::new();
    hasher.write(&bytes);
    let digest = hasher.finish();
    Ok(format!("{digest:016x} {command} {conditions}").trim_end().to_owned())
}

/// Writes the runs of several stores into one, in order of study and seed; how many there are.
///
/// # Errors
/// A file that cannot be read or written, a line that is no run, runs of two versions, or two results of one run: the
/// error names file and line. A store that exists is not replaced.
pub fn merge(stores: &[PathBuf], to: &Path) -> anyhow::Result<usize> {
    output::check(to, Existing::Keep).context("a store is not replaced")?;
    let mut version: Option<(String, String)> = None;
    let mut runs: BTreeMap<Key, (String, String)> = BTreeMap::new();
    for path in stores {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).with_context(|| name.clone())?;
        // What stands after the last end of a line was cut off while it was written.
        let whole = text.rfind('\n').map_or("", |end| &text[..end]);
        for (index, line) in whole.lines().enumerate() {
            let place = format!("{name}, line {}", index + 1);
            let Label { build, study, seed } =
                serde_json::from_str(line).with_context(|| format!("{place}: not a run of the laboratory"))?;
            let (first, first_place) = version.get_or_insert_with(|| (build.clone(), place.clone()));
            if *first != build {
                bail!(
                    "{place}: a result of version `{build}`, but {first_place} is of `{first}`: merge one version only"
                );
            }
            match runs.entry((study, seed)) {
                Entry::Vacant(entry) => {
                    entry.insert((line.to_owned(), place));
                }
                Entry::Occupied(entry) if entry.get().0 == line => {}
                Entry::Occupied(entry) => {
                    let ((study, seed), (_, other)) = (entry.key(), entry.get());
                    bail!("{place}: `{study}` seed {seed} differs from {other}: remove one of the two lines");
                }
            }
        }
    }
    output::write(to, Existing::Keep, |file| runs.values().try_for_each(|(line, _)| writeln!(file, "{line}")))?;
    Ok(runs.len())
}

/// Numbers that may be NaN: JSON writes null for it.
pub mod nan {
    use serde::de::Error as _;
    use serde::{Deserialize, Deserializer};

    /// A number.
    pub fn one<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
        Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
    }

    /// Several.
    pub fn many<'de, D: Deserializer<'de>, const N: usize>(from: D) -> Result<[f64; N], D::Error> {
        let all: Vec<Option<f64>> = Vec::deserialize(from)?;
        let all: Vec<f64> = all.into_iter().map(|number| number.unwrap_or(f64::NAN)).collect();
        all.try_into().map_err(|_| D::Error::custom(format!("{N} numbers are expected")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    struct Stored {
        value: f64,
    }

    fn key(study: &str, seed: u64) -> Key {
        (study.to_owned(), seed)
    }

    fn open(path: &Path) -> anyhow::Result<Store<Stored>> {
        Store::open(Some(path), "this".to_owned())
    }

    #[test]
    fn a_later_reader_sees_the_same_bits() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("runs.jsonl");
        let store = open(&path).unwrap();
        for (seed, value) in [(1, 0.1 + 0.2), (3, 1.0 / 3.0)] {
            store.add(key("study", seed), &Stored { value }).unwrap();
        }
        let later = open(&path).unwrap();
        for (study, seed) in [("study", 1), ("study", 2), ("study", 3), ("other", 1)] {
            assert_eq!(store.get(&key(study, seed)), later.get(&key(study, seed)));
        }
        assert_eq!(later.get(&key("study", 1)), Some(Stored { value: 0.1 + 0.2 }));
        assert!(later.get(&key("study", 2)).is_none() && later.get(&key("other", 1)).is_none());
    }

    #[test]
    fn a_line_cut_off_and_another_build_are_passed_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("runs.jsonl");
        open(&path).unwrap().add(key("study", 1), &Stored { value: 1.0 }).unwrap();
        let mut file = OpenOptions::new().append(true).open(&path).unwrap();
        write!(file, "{{\"build\":\"another\",\"seed\":2}}\n{{\"build\":").unwrap();
        let store = open(&path).unwrap();
        let seeds =
            |store: &Store<Stored>| (1..9).filter(|seed| store.get(&key("study", *seed)).is_some()).collect::<Vec<_>>();
        assert_eq!(seeds(&store), [1]);
        store.add(key("study", 3), &Stored { value: 3.0 }).unwrap();
        assert_eq!(seeds(&open(&path).unwrap()), [1, 3]);
        std::fs::write(&path, "{}\n").unwrap();
        let error = open(&path).err().unwrap().to_string();
        assert!(error.contains("line 1"), "{error}");
    }

    #[test]
    fn merged_stores_are_of_one_version_and_agree() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let write = |name: &str, lines: &str| std::fs::write(path(name), lines).unwrap();
        let run =
            |seed: u64, value: f64| format!("{{\"build\":\"1\",\"study\":\"s\",\"seed\":{seed},\"value\":{value}}}\n");
        write("a", &(run(3, 0.5) + &run(1, 1.5)));
        // The same run twice, and one that was cut off.
        write("b", &(run(2, 2.5) + &run(1, 1.5) + "{\"build\":"));
        assert_eq!(merge(&[path("a"), path("b")], &path("c")).unwrap(), 3);
        assert_eq!(std::fs::read_to_string(path("c")).unwrap(), run(1, 1.5) + &run(2, 2.5) + &run(3, 0.5));
        for (other, said) in [
            (run(3, 0.25), "line 1: `s` seed 3 differs from"),
            ("{\"build\":\"2\",\"seed\":9}\n".to_owned(), "line 1: a result of version `2`"),
            (run(4, 0.5) + "no run\n", "line 2: not a run"),
        ] {
            write("d", &other);
            let error = format!("{:#}", merge(&[path("a"), path("d")], &path("e")).unwrap_err());
            assert!(error.contains(said) && error.contains("/d, line"), "{error}");
        }
        assert!(merge(&[path("a")], &path("c")).is_err(), "a store was replaced");
    }
}
