//! `backseat identify`: a vehicle's parameters from its log.

mod manoeuvring;
mod page;
mod partial;
mod plan;
mod result;
mod surge_yaw;

use crate::log_input::LogInput;
use crate::outcome::Outcome;
use anyhow::{Context, anyhow, bail};
use backseat_analysis::read_log::ReadLog;
use backseat_analysis::uses;
use backseat_core::effects::{EffectSet, water_current};
use backseat_core::identification::Scale;
use backseat_estimation::inputs;
use backseat_identify::{
    IdentificationData, LoggedInputs, Method, Options, TimingEstimate, fold_into_plant, identify, learnt, timing,
    validate,
};
use backseat_logs::VehicleFile;
use backseat_logs::output::{self, Existing};
use backseat_report::console::{self, Progress};
use clap::ValueEnum;
pub use page::html;
use result::HeldOut;
pub use result::IdentificationResult;
use std::path::{Path, PathBuf};
use std::time::Instant;

const EXAMPLES: &str = "\
Examples:
  backseat identify log.csv.gz                                       automatic method, built-in vehicle as prior
  backseat identify log.csv --method aid --vehicle prior.toml --out identified.toml
  backseat identify log.csv --validate other.csv --report out        judged on another log, out/report.html
  backseat identify iver_mission.log                                 surge and yaw of a log in servo counts
  backseat identify ship.csv --report out                            a vessel's log with propeller and rudder: surge, sway, yaw
  backseat identify table.csv --columns map.toml                     a table of any other maker
  backseat identify --plan mission.toml --duration 1800              the mission with most information about the vehicle

The log needs prop_rpm, fin_{top,bottom,port,starboard}_rad, roll_rad, pitch_rad, heading_rad, p_radps, q_radps, r_radps
and dvl_{u,v,w}_mps. DVL velocity is over ground: state the water current (--current, or [effects] of the vehicle
file), or identify in still water. Of a vessel on the surface: prop_rpm (or commands of thrusters), rudder_rad,
heading_rad, and dvl_u_mps, dvl_v_mps, r_radps or the positions gps_x_m, gps_y_m.";

/// Share of the log that is fitted when nothing else is there to judge by.
const FITTED: f64 = 0.8;

/// Identify the vehicle's parameters from a log
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Vehicle log, .csv or .csv.gz, or an Iver UVC mission log with servo counts
    #[arg(required_unless_present = "plan")]
    log: Option<PathBuf>,
    #[command(flatten)]
    input: LogInput,
    #[command(flatten)]
    settings: Settings,
    /// Vehicle file with the prior, TOML [default: the built-in reference vehicle]
    #[arg(long, value_name = "V.toml")]
    vehicle: Option<PathBuf>,
    /// Log for validation [default: the last fifth of the log, held out]
    #[arg(long, value_name = "LOG2")]
    validate: Option<PathBuf>,
    /// Write the identified vehicle, TOML
    #[arg(long, value_name = "V.toml")]
    out: Option<PathBuf>,
    /// Write an HTML report (and the identified vehicle) into this folder
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Print one JSON object instead of the table
    #[arg(long)]
    json: bool,
    /// Replace results that exist
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    plan: plan::Planning,
}

/// How a vehicle is identified.
#[derive(clap::Args, Clone, Debug)]
pub struct Settings {
    /// Method of identification
    #[arg(long, default_value = "auto")]
    pub method: Choice,
    /// The parameter taken as known: forces are not measured, so one must be
    #[arg(long, default_value = "m11")]
    pub scale: Known,
    /// Identify the cross drags d26 and d35 too (auto tries by itself)
    #[arg(long)]
    pub cross_drag: bool,
    /// Water current north and east, m/s [default: the vehicle file's, or none]
    #[arg(long, value_name = "N,E", value_delimiter = ',', allow_hyphen_values = true)]
    pub current: Vec<f64>,
}

/// Method of identification.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Choice {
    /// The board's adaptive identifier as it runs under way
    AidOnline,
    /// Adaptive identification without delay, in several passes
    Aid,
    /// Nullspace least squares of the thesis
    Nbls,
    /// Nullspace least squares, noise taken out
    Gtls,
    /// Weak form with instrumental variables
    Iv,
    /// Prediction error, Gauss-Newton
    OutputError,
    /// AID, instrumental variables, output error: each only where it predicts better
    Auto,
}

/// The parameter taken as known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Known {
    /// Mass and added mass in surge.
    M11,
    /// Thrust.
    Beta5,
}

impl Choice {
    const fn method(self) -> Method {
        match self {
            Self::AidOnline => Method::AidOnline,
            Self::Aid => Method::Aid,
            Self::Nbls => Method::Nbls,
            Self::Gtls => Method::Gtls,
            Self::Iv => Method::Iv,
            Self::OutputError => Method::OutputError,
            Self::Auto => Method::Auto,
        }
    }
}

/// Reads, identifies, judges, writes.
pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    let Some(path) = &args.log else { return args.plan.run(args).map(Outcome::from) };
    let existing = if args.force { Existing::Replace } else { Existing::Keep };
    let in_report = |name: &str| args.report.as_ref().map(|folder| folder.join(name));
    let page = in_report("report.html");
    let vehicle_path = args.out.clone().or_else(|| in_report("vehicle.toml"));
    for path in [&page, &vehicle_path].into_iter().flatten() {
        output::check(path, existing)?;
    }
    let read = args.input.read(path)?;
    crate::log_input::explain_failure(&read, || {
        if surge_yaw::is_for(&read.log) || uses::is_vessel(&read.log) {
            return identify_part(args, path, &read, [page.as_deref(), vehicle_path.as_deref()], existing);
        }
        identify_vehicle(args, &read, [page.as_deref(), vehicle_path.as_deref()], existing)
    })
}

/// Identifies what a log shows of a vehicle whose full dynamics it does not hold, and writes it.
fn identify_part(
    args: &Args,
    path: &Path,
    read: &ReadLog,
    [page, vehicle_path]: [Option<&Path>; 2],
    existing: Existing,
) -> anyhow::Result<Outcome> {
    let declared = args.vehicle.as_ref().map(|path| VehicleFile::read(path)).transpose()?;
    let declared = declared.unwrap_or_else(VehicleFile::reference);
    let (found, model) = if surge_yaw::is_for(&read.log) {
        (surge_yaw::identify(args, path, read, &declared)?, None)
    } else {
        let (found, model) = manoeuvring::identify(args, path, read, &declared)?;
        (found, Some(model))
    };
    if let Some(folder) = &args.report {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let vehicle_path = vehicle_path.filter(|_| model.is_some());
    if let (Some(to), Some(model)) = (vehicle_path, model) {
        let source = format!(
            "Vehicle {} with the manoeuvring model that `backseat identify` found in {}, section [manoeuvring].",
            declared.name,
            path.file_name().map_or_else(|| "a log".into(), |name| name.to_string_lossy())
        );
        VehicleFile { manoeuvring: Some(model), ..declared }.write(to, &source, existing)?;
    }
    if let Some(page) = page {
        let html = found.html();
        output::write(page, existing, |file| file.write_all(html.as_bytes()))?;
    }
    let written = [vehicle_path, page];
    let text = if args.json { found.json(written) } else { found.text(written) };
    console::print(text.as_bytes())?;
    Ok(Outcome::doubtful_if(read.examination.is_suspicious()))
}

/// From the log that was read to what is written: the page and the vehicle file.
fn identify_vehicle(
    args: &Args,
    read: &ReadLog,
    [page, vehicle_path]: [Option<&Path>; 2],
    existing: Existing,
) -> anyhow::Result<Outcome> {
    let declared = args.vehicle.as_ref().map(|path| VehicleFile::read(path)).transpose()?;
    let other = args.validate.as_ref().map(|path| args.input.read(path)).transpose()?;
    let outcome = compute(read, declared.as_ref(), other.as_ref(), &args.settings)?;
    // a file that repeats the declared vehicle would be taken for a result
    let vehicle_path = vehicle_path.filter(|_| outcome.is_changed);
    if let Some(folder) = &args.report {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    if let Some(path) = vehicle_path {
        outcome.identified.write(path, &outcome.source(), existing)?;
    }
    if let Some(path) = page {
        let html = page::html(&outcome);
        output::write(path, existing, |file| file.write_all(html.as_bytes()))?;
    }
    let written = [vehicle_path, page];
    let text = if args.json { outcome.json(written) } else { outcome.text(written) };
    console::print(text.as_bytes())?;
    Ok(Outcome::doubtful_if(!outcome.is_changed || !outcome.doubts.is_empty()))
}

/// Identifies a vehicle from a log that was read, without a vehicle from the built-in reference; judged on the other
/// log, or on the last part of the same.
///
/// # Errors
/// The log lacks a column that identification needs, or its motion shows nothing.
pub fn compute(
    read: &ReadLog,
    declared: Option<&VehicleFile>,
    other: Option<&ReadLog>,
    settings: &Settings,
) -> anyhow::Result<IdentificationResult> {
    let began = Instant::now();
    let mut declared = declared.cloned().unwrap_or_else(VehicleFile::reference);
    let left = fold_into_plant(&mut declared.parameters, &mut declared.effects.set);
    let kept = declared.effects.set;
    declared.effects.ci95.retain(|(id, _)| kept.get(*id) != 0.0);
    let effects = effects(&declared, &settings.current)?;
    let data_of = |read: &ReadLog| {
        let log = inputs::at_centre(&read.log, &declared.installation);
        let data = IdentificationData::from_log(&log, &effects).with_context(|| read.log.path.display().to_string())?;
        anyhow::Ok((data, LoggedInputs::of(&log, &effects)))
    };
    let (mut data, inputs) = data_of(read)?;
    data.notes.splice(..0, read.log.notes.iter().cloned());
    data.notes
        .extend(left.iter().map(|name| {
            format!("{name} has an onset time and is ignored: identification assumes constant parameters")
        }));
    let options = options(settings, &declared);
    let timing = input_timing(&mut data, &inputs, &declared, &options);
    let other = other.map(data_of).transpose()?.map(|(mut data, inputs)| {
        if let Some(timing) = &timing {
            inputs.act(&timing.timing(), &mut data.samples);
        }
        data
    });
    let method = settings.method.method();
    let [first, rest] = data.split(FITTED);
    // The automatic method holds the last part out by itself.
    let fitted = if other.is_some() || method == Method::Auto { &data } else { &first };
    let held_out = if other.is_some() { HeldOut::Another } else { HeldOut::LastPart };
    let progress = Progress::new("identify", 1000);
    let estimate = identify(method, fitted, &declared.parameters, &options, &|share| {
        progress.set((share * 1000.0) as usize);
    })?;
    drop(progress);
    let judge = other.unwrap_or(rest);
    let [before, after] = [&declared.parameters, &estimate.vehicle].map(|vehicle| validate(vehicle, &judge));
    // the way through the identifier's own coordinates rounds
    let moves = |p: &backseat_identify::EstimatedParameter| (p.value - p.prior).abs() > 1e-9 * p.prior.abs().max(1e-3);
    let is_changed = estimate.parameters.iter().any(moves);
    let mut identified = declared.clone();
    identified.parameters = estimate.vehicle;
    identified.learnt = learnt(&estimate, &options, &declared.priors);
    identified.name = format!("{}-identified", declared.name);
    Ok(IdentificationResult {
        log: read.log.path.clone(),
        format: read.format,
        estimate,
        before,
        after,
        held_out,
        judge,
        declared,
        identified,
        timing,
        is_changed,
        doubts: read.examination.suspicions().map(|finding| finding.message.clone()).collect(),
        wall_s: read.read_s + began.elapsed().as_secs_f64(),
    })
}

/// Finds out when the inputs act, and lets them.
fn input_timing(
    data: &mut IdentificationData,
    inputs: &LoggedInputs,
    declared: &VehicleFile,
    options: &Options,
) -> Option<TimingEstimate> {
    match timing::estimate(data, inputs, &declared.parameters, options) {
        Ok(found) => {
            inputs.act(&found.timing(), &mut data.samples);
            data.notes.extend(found.notes());
            Some(found)
        }
        Err(error) => {
            data.notes.push(format!("{error}; commands are held until the next"));
            None
        }
    }
}

/// The declared effects, with the current that was given instead of the declared one.
fn effects(declared: &VehicleFile, current: &[f64]) -> anyhow::Result<EffectSet> {
    match current {
        [] => Ok(declared.effects.set),
        [north, east] if north.is_finite() && east.is_finite() => {
            declared.effects.set.with(water_current::INFO.name, current).map_err(|error| anyhow!("--current: {error}"))
        }
        _ => bail!("--current takes two numbers, north and east in m/s"),
    }
}

fn options(settings: &Settings, declared: &VehicleFile) -> Options {
    let sensors = &declared.sensors;
    let (dvl, rates) = (sensors.dvl_mps, sensors.rates_radps);
    Options {
        scale: match settings.scale {
            Known::M11 => Scale::M11,
            Known::Beta5 => Scale::Beta5,
        },
        velocity_noise: [dvl, dvl, dvl, rates, rates, rates],
        roll_pitch_noise_rad: sensors.attitude_rad,
        cross_drag: settings.cross_drag,
        ..Options::DEFAULT
    }
}
