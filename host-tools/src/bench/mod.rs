//! `backseat bench`: noise of every sensor from a log at rest, and a vehicle file with it (Tables 4.2 to 4.4).

mod allan;
mod channels;
mod page;

use crate::log_input::LogInput;
use anyhow::{Context, bail};
use backseat_logs::VehicleFile;
use backseat_logs::output::{self, Existing};
use backseat_report::console;
use channels::{Channel, Sensor};
use serde_json::{Value, json};
use std::fmt::Write as _;
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
    /// Write an HTML report into this folder
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Measures, prints and writes.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let existing = if args.force { Existing::Replace } else { Existing::Keep };
    let page = args.report.as_ref().map(|folder| folder.join("report.html"));
    for path in [&page, &args.out].into_iter().flatten() {
        output::check(path, existing)?;
    }
    let read = args.input.read(&args.log)?;
    let channels = channels::of(&read.log);
    if channels.is_empty() {
        bail!(
            "{}: no sensor has {} readings or more: a log of some minutes at rest is needed",
            args.log.display(),
            channels::FEWEST
        );
    }
    let sensors = channels::sensors(&channels);
    let mut notes: Vec<String> = channels.iter().filter_map(Channel::note).collect();
    if let Some(out) = &args.out {
        let mut vehicle = match &args.vehicle {
            Some(path) => VehicleFile::read(path)?,
            None => VehicleFile::reference(),
        };
        let found = sensors.iter().map(|sensor| (sensor.key, sensor.sigma));
        vehicle.apply(found).map_err(|error| anyhow::anyhow!("{}: {error}", args.log.display()))?;
        let source = format!("Section [sensors] by backseat bench of {}.", args.log.display());
        vehicle.write(out, &source, existing)?;
        notes.push(format!("written: {}", out.display()));
    }
    if let Some(path) = &page {
        let text = page::html(&args.log.display().to_string(), &channels, &sensors);
        let folder = path.parent().context("report folder")?;
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        output::write(path, existing, |file| file.write_all(text.as_bytes()))?;
        notes.push(format!("report: {}", path.display()));
    }
    let text = if args.json { json_text(&channels, &sensors, &notes) } else { text(&channels, &sensors, &notes) };
    console::print(text.as_bytes())
}

fn text(channels: &[Channel], sensors: &[Sensor], notes: &[String]) -> String {
    let mut out = format!(
        "{:<12} {:>8} {:>7} {:>12} {:>10} {:>10}  {:<5} Allan deviation\n",
        "", "readings", "Hz", "mean", "sigma", "white", "unit"
    );
    for channel in channels {
        let allan: Vec<String> =
            channel.allan.iter().map(|(tau, deviation)| format!("{} at {tau:.3} s", short(*deviation))).collect();
        let _ = writeln!(
            out,
            "{:<12} {:>8} {:>7.2} {:>12.5} {:>10} {:>10}  {:<5} {}",
            channel.name,
            channel.values.len(),
            channel.rate_hz,
            channel.mean,
            short(channel.sigma),
            short(channel.white),
            channel.unit,
            allan.into_iter().step_by(2).take(6).collect::<Vec<_>>().join(", ")
        );
    }
    out.push('\n');
    for sensor in sensors {
        let _ = writeln!(out, "{:<24} {}", sensor.key, short(sensor.sigma));
    }
    for note in notes {
        let _ = writeln!(out, "{note}");
    }
    out
}

/// Three significant digits.
fn short(value: f64) -> String {
    if value == 0.0 || (1e-3..1e4).contains(&value.abs()) {
        let digits = if value == 0.0 { 0 } else { (2.0 - value.abs().log10().floor()).max(0.0) as usize };
        return format!("{value:.digits$}");
    }
    format!("{value:.2e}")
}

fn json_text(channels: &[Channel], sensors: &[Sensor], notes: &[String]) -> String {
    let channels: Vec<Value> = channels
        .iter()
        .map(|channel| {
            let allan: Vec<Value> =
                channel.allan.iter().map(|(tau, sigma)| json!({"tau_s": tau, "deviation": sigma})).collect();
            json!({
                "name": channel.name, "unit": channel.unit, "readings": channel.values.len(), "rate_hz": channel.rate_hz,
                "mean": channel.mean, "sigma": channel.sigma, "white": channel.white, "allan": allan,
            })
        })
        .collect();
    let sensors: serde_json::Map<String, Value> =
        sensors.iter().map(|sensor| (sensor.key.to_owned(), json!(sensor.sigma))).collect();
    format!("{}\n", json!({"channels": channels, "sensors": sensors, "notes": notes}))
}
