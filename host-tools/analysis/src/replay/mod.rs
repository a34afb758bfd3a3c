//! A recorded session through the flight code.

mod approximate;
mod board;
mod compare;
mod report;
mod survey;

use anyhow::{Context, bail};
use approximate::Approximate;
use backseat_logs::session::{Axis, Clock, Damage, Meta, Reader};
use backseat_report::console::Progress;
use board::Replay;
pub use compare::Difference;
pub use report::report;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use survey::Survey;

/// A session through the flight code.
pub struct Replayed {
    log: PathBuf,
    meta: Meta,
    wall: Duration,
    damage: Damage,
    found: Found,
}

/// What came of it.
enum Found {
    /// Compared to the bit.
    Exact(Box<board::ExactReplay>),
    /// Compared in metres.
    Approximate(approximate::ApproximateReplay),
}

impl Replayed {
    /// Where the replay is not what the board computed, in the most informative record; a session with a PC's times is
    /// not compared to the bit.
    pub fn first_difference(&self) -> Option<&Difference> {
        match &self.found {
            Found::Exact(outcome) => outcome.record.as_ref().or(outcome.step.as_ref()),
            Found::Approximate(_) => None,
        }
    }
}

/// Replays a session, or the log of a board's memory card.
///
/// # Errors
/// A file that cannot be read, or has nothing to step the app through.
pub fn replay(log: &Path) -> anyhow::Result<Replayed> {
    let begun = Instant::now();
    let survey = Survey::of(log)?;
    let mut reader = Reader::open(log)?;
    let meta = reader.meta().clone();
    let progress = Progress::new("replay", reader.position().1 as usize);
    let named = || log.display().to_string();
    let found = match meta.clock {
        Clock::Board => {
            let mut replay = Replay::new(&survey);
            let mut axis = Axis::of(log)?;
            while let Some(entry) = reader.next() {
                if reader.damage().broken_records > 0 {
                    replay.hole("a part of the file is broken");
                }
                let entry = entry?;
                let placed_us = axis.place(entry.time_us);
                replay.take(entry, placed_us).with_context(named)?;
                progress.set(reader.position().0 as usize);
            }
            Found::Exact(Box::new(replay.finish()))
        }
        Clock::Host => {
            let mut replay = Approximate::new(&survey);
            while let Some(entry) = reader.next() {
                progress.set(reader.position().0 as usize);
                if !replay.take(entry?).with_context(named)? {
                    break;
                }
            }
            Found::Approximate(replay.finish())
        }
    };
    let steps = match &found {
        Found::Exact(outcome) => outcome.steps,
        Found::Approximate(outcome) => outcome.steps,
    };
    if steps == 0 {
        bail!("{}: nothing in it that the app could be stepped through", log.display());
    }
    Ok(Replayed { log: log.to_owned(), meta, wall: begun.elapsed(), damage: reader.damage(), found })
}
