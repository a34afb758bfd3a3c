//! `backseat info`: what a file is, whether it is plausible, and what can be done with it.

mod other;
mod report;
mod settings;

use crate::log_input::LogInput;
use crate::outcome::Outcome;
use anyhow::bail;
use backseat_report::console;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  backseat info log.csv.gz                         a vehicle log, or the log of an Iver, a glider, a pinger
  backseat info table.csv --columns map.toml       a table of any other maker
  backseat info session.mcap                       what a session holds; board logs (.BSL) as well
  backseat info vehicle.toml --json                one JSON object

Range, rate and gaps of every column; what contradicts units, signs and times (a heading beyond 2 pi, a depth above the
surface, a yaw rate 57 times what the heading does, mirrored positions, times in milliseconds); and what `navigate`,
`identify` and `diagnose` can do with it. The last lines say \"usable\", or \"suspicious\" or \"of no use\" with the reasons;
the exit code is then 3, of what is suspicious with --strict 1. The three commands make the same check when they begin.";

/// What a file is, whether it is plausible, and what can be done with it
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Any file that a command reads: log, session, board log, vehicle file, scenario, mission, mapping, topside's
    /// configuration, truth
    file: PathBuf,
    #[command(flatten)]
    input: LogInput,
    /// Print one JSON object instead of the table
    #[arg(long)]
    json: bool,
}

/// Examines a file.
///
/// # Errors
/// A file that cannot be read; with `--strict`, one that is suspicious.
pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    if !args.input.is_mapped()
        && let Some(found) = other::describe(&args.file)?
    {
        let text = if args.json { format!("{}\n", found.json()) } else { found.text() };
        console::print(text.as_bytes())?;
        return Ok(Outcome::Done);
    }
    let read = args.input.examine(&args.file)?;
    let text = if args.json { report::json(&read) } else { report::text(&read) };
    console::print(text.as_bytes())?;
    match read.examination.suspicions().next() {
        Some(first) if args.input.is_strict() => {
            bail!("{}: {} (refused by --strict)", args.file.display(), first.message)
        }
        _ => Ok(Outcome::doubtful_if(!report::verdict(&read).1.is_empty())),
    }
}
