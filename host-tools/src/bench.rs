//! `backseat bench`: noise of every sensor from a log at rest, and a vehicle file with it.

use crate::log_input::LogInput;
use crate::outcome::Outcome;
use crate::output::Output;
use backseat_analysis::bench::{self, Bench};
use backseat_logs::VehicleFile;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  backseat bench static.csv                                          noise of every sensor in the log
  backseat bench static.csv --report out                             histograms and Allan deviations, out/report.html
  backseat bench static.csv --vehicle iver3.toml --out mine.toml     the vehicle file with these sensors

The vehicle has to lie still for some minutes, the longer the better. \"white\" is the Allan deviation at the interval
between readings: for white noise it is sigma, and it leaves out drift. It is what --out writes into section [sensors].
A sensor without scatter keeps what the vehicle file says: a DVL in a tank reads zero, and a filter cannot use that.";

/// Noise of every sensor, from a log of a vehicle at rest
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Log of a vehicle that lies still, of any format that `navigate` reads
    log: PathBuf,
    #[command(flatten)]
    input: LogInput,
    /// Vehicle file to take everything else from [default: the built-in reference vehicle]
    #[arg(long, value_name = "FILE.toml", requires = "out")]
    vehicle: Option<PathBuf>,
    /// Write a vehicle file with the noise found in its section [sensors]
    #[arg(long, value_name = "FILE.toml")]
    out: Option<PathBuf>,
    #[command(flatten)]
    output: Output,
}

/// Measures, prints and writes.
pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    args.output.check(&[&args.out])?;
    let mut read = args.input.read(&args.log)?;
    if !args.input.is_admitted(&mut [&mut read], "bench", &args.output)? {
        return Ok(Outcome::Doubtful);
    }
    let found = Bench::of(&read.log)?;
    if let Some(out) = &args.out {
        let vehicle =
            args.vehicle.as_ref().map_or_else(|| Ok(VehicleFile::reference()), |path| VehicleFile::read(path))?;
        let source = format!("Section [sensors] by backseat bench of {}.", args.log.display());
        found.applied(&vehicle)?.write(out, &source, args.output.existing())?;
    }
    args.output.show(bench::report(&found).file("vehicle_file", args.out.as_deref()))?;
    Ok(Outcome::Done)
}
