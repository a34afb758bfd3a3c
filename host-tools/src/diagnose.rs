//! `backseat diagnose`: which physical effect the declared model lacks.

use crate::log_input::{Beside, LogInput, explain_failure};
use crate::outcome::Outcome;
use crate::output::Output;
use anyhow::bail;
use backseat_analysis::diagnose::{self, Files, Options, TERMS_FILE, torpedo};
use backseat_analysis::effect::terms::Terms;
use backseat_analysis::read_log::ReadLog;
use backseat_analysis::uses;
use backseat_logs::output::{self, Existing};
use backseat_logs::{Truth, VehicleFile};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  backseat diagnose log.csv.gz                                the built-in vehicle, one page of text
  backseat diagnose log.csv --vehicle iver3.toml --report out  out/report.html and out/vehicle.toml
  backseat diagnose log.csv --no-dvl --truth truth.csv --json  one JSON object, for scripts
  backseat diagnose turns.csv --with zigzags.csv --with wind.csv
                                                              runs of a vessel with rudder: the wind
  backseat diagnose runs.csv --run 3                          one run of a table that holds several
  backseat diagnose table.csv --columns map.toml              a table of any other maker
  backseat diagnose runs/ --report out                        a folder of short runs of a torpedo without fixes
  backseat diagnose runs/ --vehicle out/vehicle.toml --predict 20 --json
                                                              how well that file predicts runs, nothing fitted

The log is one that `backseat navigate` reads, or that of a DVL with an AHRS. A log without fin angles and propeller speed
is compared with the plainest model that it supports: a vessel's rudder and propeller, a DVL beside a reference velocity,
or dead reckoning. The vehicle file written holds the declared vehicle and the effects
found; `navigate`, `params import` and the simulator read it.";

/// Find out which physical effect the declared model lacks
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Vehicle log, .csv or .csv.gz, or an Iver UVC mission log; or a folder of runs
    log: PathBuf,
    /// Vehicle file, TOML [default: the built-in reference vehicle]
    #[arg(long, value_name = "V.toml")]
    vehicle: Option<PathBuf>,
    /// Truth CSV to compare positions with
    #[arg(long, value_name = "T.csv")]
    truth: Option<PathBuf>,
    /// Do not use the DVL
    #[arg(long)]
    no_dvl: bool,
    /// A second log of the same time base, joined to the first; may be repeated. Runs join by their labels
    #[arg(long, value_name = "LOG2")]
    with: Vec<PathBuf>,
    #[command(flatten)]
    beside: Beside,
    /// Use this run only, of a table that holds several, counted from 1
    #[arg(long, value_name = "N")]
    run: Option<u32>,
    #[command(flatten)]
    input: LogInput,
    #[command(flatten)]
    output: Output,
    /// Fit nothing: score open-loop predictions of the vehicle file over so many seconds
    #[arg(long, value_name = "S", conflicts_with_all = ["truth", "with", "no_dvl", "out"])]
    predict: Option<f64>,
    /// Draw a prediction of short runs as one picture as well; replaces an earlier one
    #[arg(long, value_name = "PICTURE.svg")]
    picture: Option<PathBuf>,
    /// Write the augmented vehicle file here [default: vehicle.toml beside the report]
    #[arg(long, value_name = "V2.toml")]
    out: Option<PathBuf>,
}

/// Reads, diagnoses, writes.
pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    let vehicle_path = args.out.clone().or_else(|| args.output.in_report("vehicle.toml"));
    args.output.check(&[&vehicle_path, &args.output.in_report(TERMS_FILE)])?;
    if let Some(picture) = &args.picture {
        output::check(picture, Existing::Replace)?;
    }
    let vehicle = args.vehicle.as_ref().map(|path| VehicleFile::read(path)).transpose()?;
    let Some(mut read) = read(args)? else { return Ok(Outcome::Doubtful) };
    args.beside.join(&mut read, vehicle.as_ref().unwrap_or(&VehicleFile::reference()))?;
    if let Some(horizon_s) = args.predict {
        if !(1.0..=600.0).contains(&horizon_s) {
            bail!("--predict {horizon_s}: expected 1 to 600 s");
        }
        args.output.show(torpedo::predict(&read, vehicle.as_ref(), horizon_s)?)?;
        return Ok(Outcome::Done);
    }
    if torpedo::is_for(&read.log) {
        return explain_failure(&read, || short_runs(args, &read, vehicle.as_ref(), vehicle_path));
    }
    explain_failure(&read, || write(args, &read, vehicle.as_ref(), vehicle_path))
}

/// Runs of a torpedo without fixes: page and vehicle file.
fn short_runs(
    args: &Args,
    read: &ReadLog,
    vehicle: Option<&VehicleFile>,
    vehicle_path: Option<PathBuf>,
) -> anyhow::Result<Outcome> {
    if args.truth.is_some() || args.no_dvl {
        bail!("--truth and --no-dvl need a log with fixes; short runs are judged by their own attitude, depth and DVL");
    }
    let result = torpedo::compute(read, vehicle)?;
    if let (Some(path), Some(picture)) = (&args.picture, torpedo::picture(&result)?) {
        output::write(path, Existing::Replace, |file| file.write_all(picture.as_bytes()))?;
    }
    if let Some(path) = &vehicle_path {
        let source = format!("found by `backseat diagnose` in {}", args.log.display());
        result.diagnosis.vehicle.write(path, &source, args.output.existing())?;
    }
    args.output.show(torpedo::report(&result, &read.log, vehicle_path.as_deref())?)?;
    Ok(Outcome::Done)
}

/// From the log that was read to what is written: the page, the vehicle file, the terms.
fn write(
    args: &Args,
    read: &ReadLog,
    vehicle: Option<&VehicleFile>,
    vehicle_path: Option<PathBuf>,
) -> anyhow::Result<Outcome> {
    let truth = args.truth.as_ref().map(|path| Truth::read(path)).transpose()?;
    let result = diagnose::compute(read, vehicle, truth.as_ref(), args.no_dvl)?;
    let (found, existing) = (&result.diagnosis, args.output.existing());
    let vehicle_path = vehicle_path.filter(|_| !found.effects.is_empty());
    if let Some(path) = &vehicle_path {
        result.vehicle.write(path, &result.source(), existing)?;
    }
    let terms = Terms::of(&found.proposed, &found.effects);
    let terms_path = args.output.in_report(TERMS_FILE).filter(|_| !terms.is_empty());
    if let Some(path) = &terms_path {
        terms.write(path, &args.log.display().to_string(), existing)?;
    }
    let options = options(args, read);
    let files = Files { vehicle: vehicle_path.as_deref(), terms: terms_path.as_deref(), options };
    args.output.show(diagnose::report(&result, &files))?;
    Ok(Outcome::doubtful_if(result.is_doubtful()))
}

/// How it was asked for, for the next command.
fn options(args: &Args, read: &ReadLog) -> Options {
    let path = |name: &str, path: &PathBuf| format!(" --{name} {}", backseat_report::word(path));
    let with = args.with.iter().map(|with| path("with", with));
    let run = args.run.map(|run| format!(" --run {run}"));
    let truth = args.truth.as_ref().map(|truth| path("truth", truth));
    let no_dvl = args.no_dvl.then(|| " --no-dvl".to_owned());
    let force = if args.output.is_forced() { " --force" } else { "" };
    Options {
        read: read.options.clone(),
        beside: with.chain(run).collect::<String>() + &args.beside.options(),
        judge: truth.into_iter().chain(no_dvl).collect::<String>() + force,
        vehicle: args.vehicle.as_ref().map(|vehicle| path("vehicle", vehicle)).unwrap_or_default(),
        is_navigable: uses::of(&read.log).iter().any(|of| of.command == "navigate" && of.possible),
    }
}

/// The log, with those beside it; `None` if one is refused.
fn read(args: &Args) -> anyhow::Result<Option<ReadLog>> {
    let mut read = args.input.read(&args.log)?;
    let beside = args.with.iter().map(|path| ReadLog::of(path, None));
    let mut beside = beside.collect::<Result<Vec<ReadLog>, _>>()?;
    let mut logs: Vec<&mut ReadLog> = std::iter::once(&mut read).chain(&mut beside).collect();
    if !args.input.is_admitted(&mut logs, "diagnose", &args.output)? {
        return Ok(None);
    }
    diagnose::gather(&mut read.log, beside.into_iter().map(|other| other.log), args.run)?;
    Ok(Some(read))
}
