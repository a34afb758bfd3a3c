//! `cargo lab vessel`: a ship's model with propellers and rudders on the surface, simulated, identified and navigated. What `cargo
//! lab single-log` finds of its wind is there.

mod data;
mod identify;
pub mod model;
mod navigate;
pub mod planar;
pub mod readings;
pub mod ship;

use anyhow::bail;
use backseat_logs::{Column, DataError, Log, LogWriter, Truth, TruthWriter};
use backseat_report::console;
use ship::Voyage;
use std::path::{Path, PathBuf};

/// What to do.
#[derive(clap::Subcommand, Clone, Debug)]
pub enum Command {
    /// Make the log of a tanker's model in zigzags and turning circles
    Simulate(Args),
    /// Identify surge, sway and yaw from a log
    Identify(identify::Args),
    /// Dead reckoning by propeller, rudder and heading
    Navigate(navigate::Args),
}

impl Command {
    /// Does it.
    ///
    /// # Errors
    /// Those of what is done.
    pub fn run(&self) -> anyhow::Result<()> {
        match self {
            Self::Simulate(arguments) => run(arguments),
            Self::Identify(arguments) => arguments.run(),
            Self::Navigate(arguments) => arguments.run(),
        }
    }
}

/// Command line of the simulation.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Examples:
  cargo lab vessel simulate --seed 1 --minutes 50 --out ship1
  cargo lab vessel simulate --seed 2 --minutes 50 --no-velocities --out ship2    positions and heading alone
  cargo lab vessel simulate --seed 3 --minutes 50 --wind 2,-3 --out ship3
then
  cargo lab vessel identify ship1/log.csv --validate ship3/log.csv
  cargo lab single-log ship3/log.csv")]
pub struct Args {
    /// Seed of the noise
    #[arg(long, value_name = "N")]
    seed: u64,
    /// Length of the log, minutes: zigzags and turning circles of five minutes each
    #[arg(long, value_name = "M")]
    minutes: f64,
    /// Folder for log.csv, and for truth/truth.csv
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Log no surge, sway and yaw rate
    #[arg(long)]
    no_velocities: bool,
    /// True wind towards north and east, m/s
    #[arg(long, value_name = "N,E", value_delimiter = ',', allow_hyphen_values = true)]
    wind: Vec<f64>,
    /// Sensors without noise
    #[arg(long)]
    no_noise: bool,
}

/// Simulates and writes.
///
/// # Errors
/// A number that is out of range, a file that exists or cannot be written.
fn run(arguments: &Args) -> anyhow::Result<()> {
    let Args { seed, minutes, out, no_velocities, wind, no_noise } = arguments;
    if !(3.0..=1440.0).contains(minutes) {
        bail!("--minutes {minutes}: 3 to 1440");
    }
    let wind_mps = match wind[..] {
        [] => [0.0; 2],
        [north, east] if f64::hypot(north, east) <= 30.0 => [north, east],
        _ => bail!("--wind: north and east, m/s, 30 m/s at most"),
    };
    let voyage = Voyage { duration_s: 60.0 * minutes, velocities: !no_velocities, wind_mps, noise: !no_noise };
    let rows = write(&ship::simulate(&voyage, *seed), out)?;
    console::print(format!("{rows} rows, {minutes} min, in {}\n", out.display()).as_bytes())
}

/// Writes a log, and its truth into a folder of its own; the number of rows.
///
/// # Errors
/// A file that exists or cannot be written.
pub fn write((log, truth): &(Log, Truth), out: &Path) -> anyhow::Result<usize> {
    if out.join("log.csv").exists() {
        bail!("{}: holds a log already", out.display());
    }
    let folder = out.join("truth");
    std::fs::create_dir_all(&folder).map_err(|error| DataError::io(&folder, &error))?;
    let columns: Vec<Column> = Column::ALL.iter().copied().filter(|column| log.has(*column)).collect();
    let mut writer = LogWriter::with_columns(&out.join("log.csv"), &columns)?;
    log.rows.iter().try_for_each(|row| writer.write(row))?;
    writer.finish()?;
    let mut writer = TruthWriter::create(&folder.join("truth.csv"))?;
    truth.rows.iter().try_for_each(|row| writer.write(row))?;
    writer.finish()?;
    Ok(log.rows.len())
}
