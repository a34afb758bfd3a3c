//! `backseat vehicle check`: does what a vehicle file describes fly, and which numbers do not fit?

use super::examination::{MISSION_MPS, examine};
use super::report;
use crate::outcome::Outcome;
use backseat_logs::VehicleFile;
use backseat_report::console;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  backseat vehicle check my_vehicle.toml
  backseat vehicle check my_vehicle.toml --speed 1.5 --json

Speeds with their trim, turn, dive, stability, buoyancy and righting moment; added mass and drag beside those of a
slender body of the same size; and the first three minutes of the default mission in the simulator. The last line says
\"flies\", or why not; the exit code is then 3. `backseat sim run --vehicle` refuses a vehicle that does not fly.";

/// Check whether a vehicle flies, and which of its numbers do not fit
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Vehicle file, TOML
    vehicle: PathBuf,
    /// Speed of turn, dive and stability, m/s
    #[arg(long, value_name = "M/S", default_value_t = MISSION_MPS)]
    speed: f64,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Checks a vehicle file.
pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    let file = VehicleFile::read(&args.vehicle)?;
    if !(args.speed > 0.0 && args.speed < 30.0) {
        anyhow::bail!("--speed {}: expected 0 to 30 m/s", args.speed);
    }
    let findings = examine(&file, args.speed)?;
    let text = if args.json { report::json(&file, &findings) } else { report::text(&file, &findings) };
    console::print(text.as_bytes())?;
    Ok(Outcome::doubtful_if(findings.misfits.iter().any(|misfit| misfit.is_fatal)))
}
