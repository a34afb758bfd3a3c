//! `backseat replay`: a recorded session through the flight code, or to ports.

mod approximate;
mod board;
mod compare;
mod ports;
mod survey;
mod text;

use crate::record::Source;
use anyhow::{Context, bail};
use approximate::Approximate;
use backseat_logs::session::{Clock, Damage, Meta, Reader};
use backseat_report::console::{self, Progress};
use board::Replay;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use survey::Survey;

const EXAMPLES: &str = "\
Examples:
  backseat replay out/survey-1/session.mcap          through the flight code, compared to the bit
  backseat replay LOG00012.BSL --json                the log of a board's memory card
  backseat replay session.mcap --to dvl=/dev/ttyUSB1 ahrs=/dev/ttyUSB2:115200 --realtime

Without --to the app runs in this program, as fast as it can, on everything that the board received: parameters, bytes,
PPS edges, steps. Its results and the bytes it sends are compared with the board's. The first difference is printed with
time, record and field, and the exit code is then 1. A session of `backseat record` has the times of a PC instead of the
board's: the board's time is then reconstructed from its telemetry, and the distance of both estimates is printed.
With --to the bytes that the board received at these ports are written to devices, as fast as these take them, or with
--realtime at their recorded times. Ports: frontseat, dvl, ahrs, modem, host.";

/// Replay a session through the flight code, or to ports
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Session (.mcap), or log of a board's memory card (.BSL)
    log: PathBuf,
    /// Write what a port of the board received to a device instead
    #[arg(long, value_name = "NAME=PATH[:BAUD]", num_args = 1..)]
    to: Vec<Source>,
    /// Write each byte at its recorded time
    #[arg(long, requires = "to")]
    realtime: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// A session through the flight code.
struct Replayed {
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

/// Replays.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let log = &args.log;
    if !args.to.is_empty() {
        let (played, wall) = ports::play(log, &args.to, args.realtime)?;
        let said = if args.json { text::played_json(&played, wall) } else { text::played(&played, wall) };
        return console::print(said.as_bytes());
    }
    let replayed = replay(log)?;
    let said = if args.json { text::json(log, &replayed) } else { text::text(log, &replayed) };
    console::print(said.as_bytes())?;
    match &replayed.found {
        Found::Exact(outcome) => match outcome.first_difference() {
            Some(difference) => bail!("{}: the replay is not what the board computed: {difference}", log.display()),
            None => Ok(()),
        },
        Found::Approximate(_) => Ok(()),
    }
}

fn replay(log: &Path) -> anyhow::Result<Replayed> {
    let begun = Instant::now();
    let survey = Survey::of(log)?;
    let mut reader = Reader::open(log)?;
    let meta = reader.meta().clone();
    let progress = Progress::new("replay", reader.position().1 as usize);
    let named = || log.display().to_string();
    let found = match meta.clock {
        Clock::Board => {
            let mut replay = Replay::new(&survey);
            while let Some(entry) = reader.next() {
                if reader.damage().broken_records > 0 {
                    replay.hole("a part of the file is broken");
                }
                replay.take(entry?).with_context(named)?;
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
    Ok(Replayed { meta, wall: begun.elapsed(), damage: reader.damage(), found })
}
