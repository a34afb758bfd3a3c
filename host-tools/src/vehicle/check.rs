//! `backseat vehicle check`: does what a vehicle file describes fly, and which numbers do not fit?

use crate::outcome::Outcome;
use crate::output::print;
use backseat_analysis::vehicle::{examine, own_speed_mps, report};
use backseat_logs::VehicleFile;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  backseat vehicle check my_vehicle.toml
  backseat vehicle check my_vehicle.toml --speed 1.5 --json

Speeds with their trim, turn, dive, stability, buoyancy and righting moment; added mass and drag beside those of a
slender body of the same size; and the first three minutes of the default mission in the simulator, at the vehicle's own
speed where the file has one ([app] cruise_speed_mps). The first line says
whether it flies, or why not; the exit code is then 3. `backseat sim run --vehicle` refuses a vehicle that does not fly.";

/// Check whether a vehicle flies, and which of its numbers do not fit
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Vehicle file, TOML
    vehicle: PathBuf,
    /// Speed of turn, dive and stability, m/s [default: the file's cruise_speed_mps in [app], or 1]
    #[arg(long, value_name = "M/S")]
    speed: Option<f64>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Checks a vehicle file.
pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    let file = VehicleFile::read(&args.vehicle)?;
    let speed_mps = args.speed.unwrap_or_else(|| own_speed_mps(&file));
    if !(speed_mps > 0.0 && speed_mps < 30.0) {
        anyhow::bail!("--speed {speed_mps}: expected 0 to 30 m/s");
    }
    let findings = examine(&file, speed_mps)?;
    print(&report(&file, &findings), args.json)?;
    Ok(Outcome::doubtful_if(!findings.flies()))
}
