//! `backseat replay`: a recorded session through the flight code, or to ports.

mod ports;

use crate::output::print;
use crate::record::NamedDevice;
use anyhow::bail;
use backseat_analysis::replay;
use std::path::PathBuf;

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
    to: Vec<NamedDevice>,
    /// Write each byte at its recorded time
    #[arg(long, requires = "to")]
    realtime: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Replays.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let log = &args.log;
    if !args.to.is_empty() {
        let (played, wall) = ports::play(log, &args.to, args.realtime)?;
        return print(&ports::report(&played, wall), args.json);
    }
    let replayed = replay::replay(log)?;
    print(&replay::report(&replayed), args.json)?;
    match replayed.first_difference() {
        Some(difference) => bail!("{}: the replay is not what the board computed: {difference}", log.display()),
        None => Ok(()),
    }
}
