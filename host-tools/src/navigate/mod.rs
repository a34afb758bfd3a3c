//! `backseat navigate`: the flight filter over a recorded mission.

mod estimates;
mod page;
mod result;
mod text;
mod trial;

use crate::effect::terms::Terms;
use crate::log_input::LogInput;
use crate::outcome::Outcome;
use anyhow::{Context, bail};
use backseat_analysis::read_log::ReadLog;
use backseat_analysis::uses::{self, Navigation};
use backseat_core::navigation::ProcessModel;
use backseat_diagnose::proposal;
use backseat_diagnose::regressors::Target;
use backseat_estimation::dead_reckoning::{self, Method};
use backseat_estimation::filter::{self, FilterOptions, Health, ShipSource};
use backseat_estimation::inputs;
use backseat_logs::output::{self, Existing};
use backseat_logs::{DataError, Log, ManoeuvringModel, Truth, VehicleFile};
use backseat_report::console::{self, Progress};
use clap::ValueEnum;
pub use page::html;
use result::{Against, Errors};
pub use result::{Estimate, NavigationResult};
use std::path::{Path, PathBuf};
use std::time::Instant;

const EXAMPLES: &str = "\
Examples:
  backseat navigate log.csv.gz --no-dvl                     robust model, ranges only
  backseat navigate log.csv.gz --model nominal              the declared vehicle taken as exact
  backseat navigate log.csv --model kinematic               constant velocity, DVL
  backseat navigate log.csv --truth truth.csv --report out  error against the truth, out/report.html
  backseat navigate log.csv.gz --no-dvl --smooth            the track by the measurements of the whole dive
  backseat navigate log.csv.gz --learn next.toml            what it has shown of the vehicle, for the next dive
  backseat navigate log.csv --terms out/proposed_terms.toml    without what `diagnose` proposes of the readings
  backseat navigate ship.csv --vehicle out/vehicle.toml     a vessel's manoeuvring model (identify), GNSS withheld
  backseat navigate 20221007_120000_survey_Iver2.log        dead reckoning on the vehicle's own log
  backseat navigate table.csv --columns map.toml            a table of any other maker
  backseat navigate dive.log --ship ship.nmea --modem modem.log    what a trial leaves behind, joined by time

The log is a CSV with t_s and any of prop_rpm, fin_{top,bottom,port,starboard}_rad, depth_m, roll_rad, pitch_rad,
heading_rad, p_radps, q_radps, r_radps, dvl_u_mps, dvl_v_mps, dvl_w_mps, range_m, range_rate_mps, tol_s, toa_s,
ship_x_m, ship_y_m, ship_gps_x_m, ship_gps_y_m, gps_x_m, gps_y_m; or the mission log of an Iver.";

/// Run the navigation filter over a recorded mission
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Vehicle log, .csv or .csv.gz, or an Iver UVC mission log
    log: PathBuf,
    /// Vehicle file, TOML [default: the built-in reference vehicle]
    #[arg(long, value_name = "V.toml")]
    vehicle: Option<PathBuf>,
    #[command(flatten)]
    input: LogInput,
    #[command(flatten)]
    settings: Settings,
    #[command(flatten)]
    trial: trial::Trial,
    /// Terms that `diagnose --report` proposed, taken out of the readings
    #[arg(long, value_name = "TERMS.toml")]
    terms: Option<PathBuf>,
    /// Truth CSV to compare with
    #[arg(long, value_name = "T.csv")]
    truth: Option<PathBuf>,
    /// Write the vehicle file with what this dive has shown of the vehicle: the next one starts from it
    #[arg(long, value_name = "V2.toml")]
    learn: Option<PathBuf>,
    /// Write an HTML report into this folder
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Write the estimated track, CSV
    #[arg(long, value_name = "TRACK.csv")]
    out: Option<PathBuf>,
    /// Print one JSON object instead of the table
    #[arg(long)]
    json: bool,
    /// Replace results that exist
    #[arg(long)]
    force: bool,
}

/// How a log is navigated.
#[derive(clap::Args, Clone, Copy, Debug, Default)]
pub struct Settings {
    /// Process model [default: the best that the log supports]
    #[arg(long)]
    pub model: Option<Model>,
    /// Leave the DVL out
    #[arg(long)]
    pub no_dvl: bool,
    /// Leave acoustic range rates out
    #[arg(long)]
    pub no_range_rate: bool,
    /// Estimate a steady water current as well (the robust model always does)
    #[arg(long)]
    pub current: bool,
    /// Take the ship from the packets alone instead of its GNSS at full rate
    #[arg(long)]
    pub packet: bool,
    /// Smooth the track after the filter: the best estimate of each time from the whole log
    #[arg(long)]
    pub smooth: bool,
}

/// What moves the vehicle between measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Model {
    /// The vehicle's own dynamics; what is not known of vehicle, compass and current is estimated
    Robust,
    /// The vehicle's own dynamics exactly as the vehicle file declares them
    #[value(alias = "dynamic")]
    Nominal,
    /// Constant velocity
    Kinematic,
}

/// What runs over the log.
enum Plan {
    Filter(Box<FilterOptions>),
    DeadReckoning(Method),
    Manoeuvring(ManoeuvringModel),
}

/// Reads, runs, compares, writes.
pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    let existing = if args.force { Existing::Replace } else { Existing::Keep };
    let page = args.report.as_ref().map(|folder| folder.join("report.html"));
    for path in [&page, &args.out, &args.learn].into_iter().flatten() {
        output::check(path, existing)?;
    }
    let vehicle = args.vehicle.as_ref().map(|path| VehicleFile::read(path)).transpose()?;
    let mut read = args.input.read(&args.log)?;
    args.trial.join(&mut read, &vehicle.clone().unwrap_or_else(VehicleFile::reference))?;
    if let Some(path) = &args.terms {
        take_out(&mut read, vehicle.as_ref(), &Terms::read(path)?)?;
    }
    crate::log_input::explain_failure(&read, || write(args, &read, vehicle.as_ref(), page.as_deref(), existing))
}

/// Takes effects of sensors and proposed terms out of the readings at the centre of gravity; says which do not concern
/// readings.
fn take_out(read: &mut ReadLog, vehicle: Option<&VehicleFile>, file: &Terms) -> anyhow::Result<()> {
    let (terms, effects) = (file.known()?, file.effects()?);
    let vehicle = vehicle.cloned().unwrap_or_else(VehicleFile::reference);
    let log = inputs::at_centre(&read.log, &vehicle.installation).into_owned();
    read.log = effects.corrected(proposal::corrected(&log, &terms)).into_owned();
    for effect in &file.effect {
        read.log.notes.push(format!("{} was taken out of the readings", effect.name));
    }
    for (term, _) in terms.iter().filter(|(term, _)| !matches!(term.target, Target::Reading(_))) {
        let name = term.name();
        read.log
            .notes
            .push(format!("{name} is not taken into account: the filter has no such term; `effect new` drafts it"));
    }
    Ok(())
}

/// From the log that was read to what is written.
fn write(
    args: &Args,
    read: &ReadLog,
    vehicle: Option<&VehicleFile>,
    page: Option<&Path>,
    existing: Existing,
) -> anyhow::Result<Outcome> {
    let truth = args.truth.as_ref().map(|path| Truth::read(path)).transpose()?;
    let outcome = compute(read, vehicle, truth.as_ref(), &args.settings)?;
    if let (Some(path), true) = (&args.truth, outcome.errors.is_none()) {
        return Err(DataError::file(path, "the truth has no time in common with the estimate").into());
    }
    if let Some(path) = &args.learn {
        let learnt = match &outcome.estimate {
            Estimate::Filter(run) => run.learnt.as_deref(),
            Estimate::DeadReckoning(_) => None,
        };
        let Some(learnt) = learnt else {
            bail!(
                "--learn: only the robust model learns anything of the vehicle (--model robust, a log with fins and propeller)"
            );
        };
        let vehicle = vehicle.cloned().unwrap_or_else(VehicleFile::reference);
        let next = VehicleFile { learnt: *learnt, ..vehicle };
        next.write(path, &learnt_from(&args.log, &next), existing)?;
    }
    if let Some(path) = &args.out {
        output::write(path, existing, |file| outcome.write_track(file))?;
    }
    if let Some(path) = page {
        let folder = args.report.as_ref().map_or_else(PathBuf::new, Clone::clone);
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        let html = page::html(&outcome);
        output::write(path, existing, |file| file.write_all(html.as_bytes()))?;
    }
    let text =
        if args.json { outcome.json(page, args.out.as_deref()) } else { outcome.text(page, args.out.as_deref()) };
    console::print(text.as_bytes())?;
    Ok(Outcome::doubtful_if(!outcome.health.doubts.is_empty()))
}

/// Navigates a log that was read; without a vehicle, by the built-in reference.
///
/// # Errors
/// The log has nothing to start from, or lacks what the model needs.
pub fn compute<'a>(
    read: &'a ReadLog,
    declared: Option<&VehicleFile>,
    truth: Option<&'a Truth>,
    settings: &Settings,
) -> anyhow::Result<NavigationResult<'a>> {
    let began = Instant::now();
    let vehicle = &declared.cloned().unwrap_or_else(VehicleFile::reference);
    let log = inputs::at_centre(&read.log, &vehicle.installation);
    let mut notes = log.notes.clone();
    let plan = plan(settings, &log, vehicle, &mut notes);
    let estimate = estimate(&plan, &log, vehicle)?;
    let wall_s = read.read_s + began.elapsed().as_secs_f64();

    let errors = compare(&estimate, &log, truth)?;
    let smoothed_errors = estimate
        .smoothed()
        .zip(truth)
        .map(|(smoothed, truth)| dead_reckoning::errors_against_truth(&result::positions(smoothed), truth));
    let mut health = Health::default();
    if let Estimate::Filter(run) = &estimate {
        notes.extend(run.notes.iter().cloned());
        health = Health::of(run, errors.as_ref().map(|(_, errors)| &errors[..]));
    }
    health.doubts.splice(..0, read.examination.suspicions().map(|finding| finding.message.clone()));
    Ok(NavigationResult {
        description: describe(declared.is_some(), &plan, vehicle),
        format: read.format,
        log,
        estimate,
        truth,
        errors,
        smoothed_errors,
        health,
        notes,
        read_s: read.read_s,
        wall_s,
    })
}

/// First lines of the vehicle file for the next dive.
fn learnt_from(log: &Path, vehicle: &VehicleFile) -> String {
    let name = log.file_name().map_or_else(|| "a log".into(), |name| name.to_string_lossy());
    format!(
        "Vehicle {} with what `backseat navigate --learn` has learnt from {name}, in section [learnt].",
        vehicle.name
    )
}

/// The requested model, or the best that the log supports, with the reason.
fn plan(settings: &Settings, log: &Log, vehicle: &VehicleFile, notes: &mut Vec<String>) -> Plan {
    if let (None, Some(model)) = (settings.model, &vehicle.manoeuvring)
        && uses::navigation(log) != Some(Navigation::Dynamic)
    {
        notes.push(
            "the vehicle file has [manoeuvring]: dead reckoning by propeller, rudder and heading, GNSS withheld after the \
             first fix of each run"
                .to_owned(),
        );
        return Plan::Manoeuvring(model.clone());
    }
    let model = match (settings.model, uses::navigation(log)) {
        (Some(model), _) => model,
        (None, Some(Navigation::Dynamic)) => Model::Robust,
        (None, Some(Navigation::Kinematic)) => {
            notes.push("the log has no fins and propeller: kinematic model".to_owned());
            Model::Kinematic
        }
        (None, Some(Navigation::DeadReckoning)) => {
            notes.push(
                "the log has no fins and propeller, no DVL velocity and no ranges: dead reckoning on its heading and \
                 speed, GNSS withheld after the first fix"
                    .to_owned(),
            );
            if settings.smooth {
                notes.push("dead reckoning has no covariance: --smooth changes nothing".to_owned());
            }
            return Plan::DeadReckoning(Method::HeadingSpeed);
        }
        (None, None) => Model::Kinematic,
    };
    let mut options = match model {
        Model::Robust => FilterOptions::robust(vehicle),
        Model::Nominal => FilterOptions::new(vehicle, ProcessModel::Dynamic),
        Model::Kinematic => FilterOptions::new(vehicle, ProcessModel::Kinematic),
    };
    options.use_dvl = !settings.no_dvl;
    options.use_range_rate = !settings.no_range_rate;
    options.smooth = settings.smooth;
    if settings.current && model != Model::Robust {
        options.navigation.effect_states = FilterOptions::water_current();
    }
    if settings.packet {
        options.ship = ShipSource::Packet;
    }
    Plan::Filter(Box::new(options))
}

fn estimate(plan: &Plan, log: &Log, vehicle: &VehicleFile) -> anyhow::Result<Estimate> {
    Ok(match plan {
        Plan::DeadReckoning(method) => {
            Estimate::DeadReckoning(dead_reckoning::run(log, *method, &vehicle.effects.set)?)
        }
        Plan::Manoeuvring(model) => Estimate::DeadReckoning(dead_reckoning::by_model(log, model)?),
        Plan::Filter(options) => {
            let progress = Progress::new("filter", log.rows.len());
            let run = filter::run_with_progress(log, vehicle, options, |row| progress.set(row))?;
            Estimate::Filter(Box::new(run))
        }
    })
}

/// Horizontal errors against the truth, or (dead reckoning) against the fixes that were withheld.
fn compare(estimate: &Estimate, log: &Log, truth: Option<&Truth>) -> anyhow::Result<Option<Errors>> {
    let positions = estimate.positions();
    let (against, errors) = match (truth, estimate) {
        (Some(truth), _) => (Against::Truth, dead_reckoning::errors_against_truth(&positions, truth)),
        (None, Estimate::DeadReckoning(_)) => (Against::Gnss, dead_reckoning::errors_against_fixes(&positions, log)),
        (None, Estimate::Filter(_)) => return Ok(None),
    };
    Ok((!errors.is_empty()).then_some((against, errors)))
}

fn describe(is_declared: bool, plan: &Plan, vehicle: &VehicleFile) -> String {
    match plan {
        Plan::DeadReckoning(_) => "dead reckoning on logged heading and speed".to_owned(),
        Plan::Manoeuvring(_) => "dead reckoning by the vessel's manoeuvring model and its heading".to_owned(),
        Plan::Filter(options) => {
            let model = match options.navigation.process_model {
                ProcessModel::Dynamic if options.is_robust() => "robust dynamic model",
                ProcessModel::Dynamic => "nominal dynamic model",
                ProcessModel::Kinematic => "kinematic model",
            };
            let dvl = if options.use_dvl { "" } else { ", no DVL" };
            let range_rate = if options.use_range_rate { "" } else { ", no range rate" };
            let current = if options.navigation.effect_states.current().is_some() { ", current states" } else { "" };
            let ship = match options.ship {
                ShipSource::Centralized => "",
                ShipSource::Packet => ", ship from packets",
            };
            let origin = if is_declared { "" } else { ", built in" };
            format!("{model}{dvl}{range_rate}{current}{ship}; vehicle {}{origin}", vehicle.name)
        }
    }
}
