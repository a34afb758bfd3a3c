//! `backseat sim vessel`: the log of a ship's model with a propeller and a rudder.

use super::dataset::noise;
use crate::output::print;
use anyhow::bail;
use backseat_logs::{Column, DataError, LogWriter, TruthWriter};
use backseat_report::Report;
use hil_sim::dataset::vessel::{self, Voyage};
use hil_sim::noise::NoiseKind;
use std::path::PathBuf;

/// Command line.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Examples:
  backseat sim vessel --seed 1 --minutes 50 --out ship1
  backseat sim vessel --seed 2 --minutes 50 --no-velocities --out ship2    positions and heading alone
  backseat sim vessel --seed 3 --minutes 50 --wind 2,-3 --out ship3
then
  backseat identify ship1/log.csv --validate ship3/log.csv")]
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
    /// Spectra of the noise
    #[arg(long, value_name = "white|off", default_value = "white", value_parser = noise)]
    noise: NoiseKind,
    /// Print one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// Simulates and writes.
///
/// # Errors
/// A number that is out of range, a file that exists or cannot be written.
pub fn run(arguments: &Args) -> anyhow::Result<()> {
    let Args { seed, minutes, out, no_velocities, wind, noise, json } = arguments;
    if !(3.0..=1440.0).contains(minutes) {
        bail!("--minutes {minutes}: 3 to 1440");
    }
    let wind_mps = match wind[..] {
        [] => [0.0; 2],
        [north, east] if f64::hypot(north, east) <= 30.0 => [north, east],
        _ => bail!("--wind: north and east, m/s, 30 m/s at most"),
    };
    let noise = match noise {
        NoiseKind::White => true,
        NoiseKind::Off => false,
        NoiseKind::Coloured | NoiseKind::Mixed => bail!("--noise: white or off"),
    };
    if out.join("log.csv").exists() {
        bail!("{}: holds a log already", out.display());
    }
    let voyage = Voyage { duration_s: 60.0 * minutes, velocities: !no_velocities, wind_mps, noise };
    let vessel::Logged { log, truth } = vessel::simulate(&voyage, *seed);
    let folder = out.join("truth");
    std::fs::create_dir_all(&folder).map_err(|error| DataError::io(&folder, &error))?;
    let columns: Vec<Column> = Column::ALL.iter().copied().filter(|column| log.has(*column)).collect();
    let path = out.join("log.csv");
    let mut writer = LogWriter::with_columns(&path, &columns)?;
    log.rows.iter().try_for_each(|row| writer.write(row))?;
    writer.finish()?;
    let mut writer = TruthWriter::create(&folder.join("truth.csv"))?;
    truth.rows.iter().try_for_each(|row| writer.write(row))?;
    writer.finish()?;
    let rows = log.rows.len();
    let report = Report::new("A vessel's data set", format!("{rows} rows, {minutes} min"))
        .file("log", Some(&path))
        .file("truth", Some(&folder))
        .value("rows", rows);
    print(&report, *json)
}
