//! Finished runs on disk, one JSON line each, written at once: what is there is not run again.
//!
//! A line belongs to one build of the program, by a digest of its file: results of another build stay where they are and
//! are not mixed in.

use super::studies::Measured;
use anyhow::Context;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::hash::Hasher;
use std::io::{Read, Write};
use std::path::Path;
use std::sync::Mutex;

/// A run of a study: its name and seed.
pub type Key = (&'static str, u64);

/// Finished runs, in memory and, if there is a file, in it.
pub struct Store {
    build: String,
    file: Option<Mutex<File>>,
    runs: Mutex<BTreeMap<(String, u64), Measured>>,
}

impl Store {
    /// Opens the file, or makes it; `None` keeps runs in memory only.
    pub fn open(path: Option<&Path>) -> anyhow::Result<Self> {
        let build = build()?;
        let mut runs = BTreeMap::new();
        let file = match path {
            None => None,
            Some(path) => {
                let name = || path.display().to_string();
                let mut file = OpenOptions::new().read(true).append(true).create(true).open(path).with_context(name)?;
                let mut text = String::new();
                file.read_to_string(&mut text).with_context(name)?;
                // A run that was being written when the program ended.
                let whole = text.rfind('\n').map_or(0, |end| end + 1);
                file.set_len(whole as u64).with_context(name)?;
                for (index, line) in text[..whole].lines().enumerate() {
                    match parse(line) {
                        Some((of, key, measured)) if of == build => {
                            runs.insert(key, measured);
                        }
                        Some(_) => {}
                        None => anyhow::bail!("{}, line {}: not a run of this command", path.display(), index + 1),
                    }
                }
                Some(Mutex::new(file))
            }
        };
        Ok(Self { build, file, runs: Mutex::new(runs) })
    }

    /// Digest of the program.
    pub fn build(&self) -> &str {
        &self.build
    }

    /// Whether a run is there.
    pub fn has(&self, (study, seed): Key) -> bool {
        self.runs.lock().is_ok_and(|runs| runs.contains_key(&(study.to_owned(), seed)))
    }

    /// Keeps a finished run. What goes on is what a later reader of the file will see, to the bit.
    pub fn add(&self, (study, seed): Key, measured: &Measured) -> anyhow::Result<()> {
        let line = serialise(&self.build, study, seed, measured);
        if let Some(Ok(mut file)) = self.file.as_ref().map(Mutex::lock) {
            file.write_all(format!("{line}\n").as_bytes()).and_then(|()| file.flush())?;
        }
        let (_, key, measured) = parse(&line).context("a run that cannot be read back")?;
        if let Ok(mut runs) = self.runs.lock() {
            runs.insert(key, measured);
        }
        Ok(())
    }

    /// The runs of a study with seeds 1 to `runs`, in order of their seeds.
    pub fn of(&self, study: &str, runs: u64) -> Vec<(u64, Measured)> {
        let Ok(all) = self.runs.lock() else { return Vec::new() };
        (1..=runs).filter_map(|seed| Some((seed, all.get(&(study.to_owned(), seed))?.clone()))).collect()
    }
}

/// Digest of the running program's file.
fn build() -> anyhow::Result<String> {
    let path = std::env::current_exe().context("the program's own file")?;
    let bytes = std::fs::read(&path).with_context(|| path.display().to_string())?;
    let mut hasher = std::hash::DefaultHasher::new();
    hasher.write(&bytes);
    Ok(format!("{:016x}", hasher.finish()))
}

fn serialise(build: &str, study: &str, seed: u64, measured: &Measured) -> String {
    json!({"build": build, "study": study, "seed": seed, "rows": measured.rows, "curves": measured.curves}).to_string()
}

fn parse(line: &str) -> Option<(String, (String, u64), Measured)> {
    let mut value: Value = serde_json::from_str(line).ok()?;
    let build = value.get("build")?.as_str()?.to_owned();
    let key = (value.get("study")?.as_str()?.to_owned(), value.get("seed")?.as_u64()?);
    // JSON has no NaN: null.
    let rows: BTreeMap<String, BTreeMap<String, Option<f64>>> =
        serde_json::from_value(value.get_mut("rows")?.take()).ok()?;
    let number = |(key, value): (String, Option<f64>)| (key, value.unwrap_or(f64::NAN));
    let rows = rows.into_iter().map(|(name, row)| (name, row.into_iter().map(number).collect())).collect();
    let curves = serde_json::from_value(value.get_mut("curves")?.take()).ok()?;
    Some((build, key, Measured { rows, curves }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(value: f64) -> Measured {
        let mut measured = Measured::default();
        measured.set("row", "column", value);
        measured
    }

    #[test]
    fn a_later_reader_sees_the_same_bits() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("runs.jsonl");
        let store = Store::open(Some(&path)).unwrap();
        for (seed, value) in [(1, 0.1 + 0.2), (2, f64::NAN), (3, 1.0 / 3.0)] {
            store.add(("study", seed), &measured(value)).unwrap();
        }
        let later = Store::open(Some(&path)).unwrap();
        assert!(later.has(("study", 3)) && !later.has(("study", 4)) && !later.has(("other", 1)));
        for ((_, a), (_, b)) in store.of("study", 3).iter().zip(later.of("study", 3)) {
            assert_eq!(a.rows["row"]["column"].to_bits(), b.rows["row"]["column"].to_bits());
        }
    }

    #[test]
    fn a_line_cut_off_and_another_build_are_passed_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("runs.jsonl");
        Store::open(Some(&path)).unwrap().add(("study", 1), &measured(1.0)).unwrap();
        let mut file = OpenOptions::new().append(true).open(&path).unwrap();
        writeln!(file, "{}", serialise("another", "study", 2, &measured(2.0))).unwrap();
        write!(file, "{{\"build\":").unwrap();
        let store = Store::open(Some(&path)).unwrap();
        assert_eq!(store.of("study", 9).len(), 1);
        store.add(("study", 3), &measured(3.0)).unwrap();
        let later = Store::open(Some(&path)).unwrap();
        assert_eq!(later.of("study", 9).iter().map(|(seed, _)| *seed).collect::<Vec<_>>(), [1, 3]);
        std::fs::write(&path, "{}\n").unwrap();
        let error = Store::open(Some(&path)).err().unwrap().to_string();
        assert!(error.contains("line 1"), "{error}");
    }
}
