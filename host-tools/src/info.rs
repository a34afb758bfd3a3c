//! `backseat info`: what a file is, whether it is plausible, and what can be done with it.

use crate::log_input::LogInput;
use crate::outcome::Outcome;
use crate::output;
use backseat_analysis::info;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  backseat info log.csv.gz                         a vehicle log, or the log of an Iver, an autopilot, a ROS 2 bag
  backseat info table.csv --columns map.toml       a table of any other maker
  backseat info session.mcap                       what a session holds; board logs (.BSL) as well
  backseat info vehicle.toml --json                one JSON object

Range, rate and gaps of every column; what contradicts units, signs and times (a heading beyond 2 pi, a depth above the
surface, a yaw rate 57 times what the heading does, mirrored positions, times in milliseconds); and what `navigate`,
`identify` and `diagnose` can do with it. The first line says \"usable\", \"suspicious\" (what speaks against it stands above,
with the lines of a mapping that mend it) or \"of no use\"; of the last two the exit code is 3. The three commands make the same
check when they begin, and refuse what is suspicious; with --force they go on. What the log does not let be tested is said.";

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
/// A file that cannot be read.
pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    if !args.input.is_mapped()
        && let Some(report) = info::describe(&args.file)?
    {
        output::print(&report, args.json)?;
        return Ok(Outcome::Done);
    }
    let read = args.input.read(&args.file)?;
    output::print(&info::report(&read), args.json)?;
    Ok(Outcome::doubtful_if(!info::verdict(&read).1.is_empty()))
}
