//! Finished runs on disk, one JSON line each, written at once: what is there is not run again.

use super::run::Run;
use anyhow::Context;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::Path;
use std::sync::Mutex;

/// Finished runs by seed, in memory and in their file.
pub struct Store {
    state: Mutex<(File, BTreeMap<u64, Run>)>,
}

impl Store {
    /// Opens the file, or makes it; runs of another build are passed over.
    pub fn open(path: &Path, build: &str) -> anyhow::Result<Self> {
        let name = || path.display().to_string();
        let mut file = OpenOptions::new().read(true).append(true).create(true).open(path).with_context(name)?;
        let mut text = String::new();
        file.read_to_string(&mut text).with_context(name)?;
        // A run that was being written when the program ended.
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        file.set_len(whole as u64).with_context(name)?;
        let mut runs = BTreeMap::new();
        for (index, line) in text[..whole].lines().enumerate() {
            let place = || format!("{}, line {}: not a run of this command", name(), index + 1);
            let line: Value = serde_json::from_str(line).with_context(place)?;
            // Results of other sources stay where they are and are not mixed in.
            if line["build"] == build {
                let run: Run = serde_json::from_value(line).with_context(place)?;
                runs.insert(run.seed, run);
            }
        }
        Ok(Self { state: Mutex::new((file, runs)) })
    }

    pub fn has(&self, seed: u64) -> bool {
        self.state.lock().is_ok_and(|state| state.1.contains_key(&seed))
    }

    /// Keeps a finished run. What goes on is what a later reader of the file will see, to the bit.
    pub fn add(&self, run: &Run) -> anyhow::Result<()> {
        let line = format!("{}\n", serde_json::to_string(run)?);
        let mut state = self.state.lock().map_err(|_| anyhow::anyhow!("a run panicked"))?;
        state.0.write_all(line.as_bytes())?;
        state.1.insert(run.seed, serde_json::from_str(&line)?);
        Ok(())
    }

    /// Runs of these seeds, in order.
    pub fn of(&self, seeds: std::ops::Range<u64>) -> Vec<Run> {
        self.state.lock().map(|state| state.1.range(seeds).map(|(_, run)| run.clone()).collect()).unwrap_or_default()
    }
}
