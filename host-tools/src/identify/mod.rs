//! `backseat identify`: a vehicle's parameters from its log.

mod plan;

use crate::log_input::{LogInput, explain_failure};
use crate::outcome::Outcome;
use crate::output::Output;
use backseat_analysis::identify::{IdentificationResult, SCALES, Settings};
use backseat_analysis::read_log::ReadLog;
use backseat_analysis::uses;
use backseat_core::identification::Scale;
use backseat_identify::Method;
use backseat_logs::VehicleFile;
use backseat_report::word;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  backseat identify log.csv.gz                                       automatic method, built-in vehicle as prior
  backseat identify log.csv --method aid --vehicle prior.toml --out identified.toml
  backseat identify log.csv --validate other.csv --report out        judged on another log, out/report.html
  backseat identify table.csv --columns map.toml                     a table of any other maker
  backseat identify --plan mission.toml --duration 1800              the mission with most information about the vehicle

The log needs prop_rpm, fin_{top,bottom,port,starboard}_rad, roll_rad, pitch_rad, heading_rad, p_radps, q_radps, r_radps
and dvl_{u,v,w}_mps. DVL velocity is over ground: state the water current (--current, or [effects] of the vehicle
file), or identify in still water.";

/// Identify the vehicle's parameters from a log
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Vehicle log, .csv or .csv.gz
    #[arg(required_unless_present = "plan")]
    log: Option<PathBuf>,
    #[command(flatten)]
    input: LogInput,
    /// Method of identification
    #[arg(long, default_value = "auto", value_parser = method())]
    method: Method,
    /// The parameter taken as known: forces are not measured, so one must be
    #[arg(long, default_value = "m11", value_parser = scale())]
    scale: Scale,
    /// Identify the cross drags d26 and d35 too (auto tries by itself)
    #[arg(long)]
    cross_drag: bool,
    /// Water current north and east, m/s [default: the vehicle file's, or none]
    #[arg(long, value_name = "N,E", value_delimiter = ',', allow_hyphen_values = true)]
    current: Vec<f64>,
    /// Vehicle file with the prior, TOML [default: the built-in reference vehicle]
    #[arg(long, value_name = "V.toml")]
    vehicle: Option<PathBuf>,
    /// Log for validation [default: the last fifth of the log, held out]
    #[arg(long, value_name = "LOG2")]
    validate: Option<PathBuf>,
    /// Write the identified vehicle, TOML [default: vehicle.toml beside the report]
    #[arg(long, value_name = "V.toml")]
    out: Option<PathBuf>,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    plan: plan::Planning,
}

/// The methods by name.
fn method() -> impl TypedValueParser<Value = Method> {
    let values = Method::ALL.map(|method| {
        PossibleValue::new(method.name()).help(match method {
            Method::AidOnline => "The board's adaptive identifier as it runs under way",
            Method::Aid => "Adaptive identification without delay, in several passes",
            Method::Iv => "Weak form with instrumental variables",
            Method::OutputError => "Prediction error, Gauss-Newton",
            Method::Auto => "AID, instrumental variables, output error: each only where it predicts better",
        })
    });
    PossibleValuesParser::new(values).try_map(|name| name.parse::<Method>())
}

/// The known parameter by name.
fn scale() -> impl TypedValueParser<Value = Scale> {
    let of = |name: String| SCALES.into_iter().find(|(known, _)| *known == name).map(|(_, scale)| scale);
    PossibleValuesParser::new(SCALES.map(|(name, _)| name)).try_map(move |name| of(name).ok_or("no such parameter"))
}

/// Reads, identifies, judges, writes.
pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    let Some(path) = &args.log else { return args.plan.run(args).map(Outcome::from) };
    let vehicle = args.out.clone().or_else(|| args.output.in_report("vehicle.toml"));
    args.output.check(&[&vehicle])?;
    let mut read = args.input.read(path)?;
    let mut other = args.validate.as_ref().map(|path| args.input.read(path)).transpose()?;
    let mut logs: Vec<&mut ReadLog> = std::iter::once(&mut read).chain(&mut other).collect();
    if !args.input.is_admitted(&mut logs, "identify", &args.output)? {
        return Ok(Outcome::Doubtful);
    }
    explain_failure(&read, || write(args, &read, other.as_ref(), vehicle))
}

/// What to do with the vehicle that was identified, or without one, and the command.
fn next(
    args: &Args,
    read: &ReadLog,
    found: &IdentificationResult,
    file: Option<&Path>,
) -> Option<(&'static str, String)> {
    let (log, options) = (word(&read.log.path), &read.options);
    let can = |command: &str| uses::of(&read.log).iter().any(|of| of.command == command && of.possible);
    match file {
        Some(file) => can("navigate").then(|| {
            let command = format!("backseat navigate {log}{options} --vehicle {}", word(file));
            ("The track with the vehicle that was identified:", command)
        }),
        None if found.vehicle().is_some() => {
            let asked: Vec<String> = std::env::args_os().skip(1).map(|asked| word(Path::new(&asked))).collect();
            let command = format!("backseat {} --out identified.toml", asked.join(" "));
            Some(("The same again keeps the vehicle that was identified:", command))
        }
        None => can("diagnose").then(|| {
            let declared = args.vehicle.as_ref().map_or_else(String::new, |file| format!(" --vehicle {}", word(file)));
            ("What the declared vehicle lacks, by name:", format!("backseat diagnose {log}{options}{declared}"))
        }),
    }
}

/// From the log that was read to what is written: the page and the vehicle file.
fn write(
    args: &Args,
    read: &ReadLog,
    other: Option<&ReadLog>,
    vehicle_path: Option<PathBuf>,
) -> anyhow::Result<Outcome> {
    let declared = args.vehicle.as_ref().map(|path| VehicleFile::read(path)).transpose()?;
    let Args { method, scale, cross_drag, ref current, .. } = *args;
    let settings = Settings { method, scale, cross_drag, current: current.clone() };
    let found = IdentificationResult::of(read, declared.as_ref(), other, &settings)?;
    // a file that repeats the declared vehicle would be taken for a result
    let vehicle_path = vehicle_path.filter(|_| found.vehicle().is_some());
    if let (Some(path), Some((vehicle, source))) = (&vehicle_path, found.vehicle()) {
        vehicle.write(path, &source, args.output.existing())?;
    }
    let report = found.report().file("vehicle_file", vehicle_path.as_deref());
    args.output.show(match next(args, read, &found, vehicle_path.as_deref()) {
        Some((why, command)) => report.section("Next").text(why).command(&command),
        None => report,
    })?;
    Ok(Outcome::doubtful_if(found.is_doubtful()))
}
