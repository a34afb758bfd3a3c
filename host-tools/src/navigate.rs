//! `backseat navigate`: the flight filter over a recorded mission.

use crate::log_input::{Beside, LogInput, explain_failure};
use crate::outcome::Outcome;
use crate::output::Output;
use anyhow::Context;
use backseat_analysis::navigate::{self, Model, RECEIVER_BIAS_M, Settings};
use backseat_analysis::read_log::ReadLog;
use backseat_analysis::uses;
use backseat_core::navigation::Area;
use backseat_logs::{DataError, Truth, VehicleFile};
use backseat_report::word;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  backseat navigate log.csv.gz --no-dvl                     robust model, ranges only
  backseat navigate log.csv.gz --model nominal              the declared vehicle taken as exact
  backseat navigate log.csv --model kinematic               constant velocity, DVL
  backseat navigate log.csv --truth truth.csv --report out  error against the truth, out/report.html
  backseat navigate log.csv.gz --no-dvl --smooth            the track by the measurements of the whole dive
  backseat navigate log.csv.gz --learn next.toml            what it has shown of the vehicle, for the next dive
  backseat navigate log.csv --terms out/proposed_terms.toml    without what `diagnose` proposes of the readings
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
    /// Process model [default: the best that the log supports]
    #[arg(long, value_parser = model())]
    model: Option<Model>,
    /// Leave the DVL out
    #[arg(long)]
    no_dvl: bool,
    /// Leave acoustic range rates out
    #[arg(long)]
    no_range_rate: bool,
    /// Estimate a steady water current as well (the robust model always does)
    #[arg(long)]
    current: bool,
    /// Take the ship from the packets alone instead of its GNSS at full rate
    #[arg(long)]
    packet: bool,
    /// Smooth the track after the filter: the best estimate of each time from the whole log
    #[arg(long)]
    smooth: bool,
    /// Where it was, which says how much the current may change (protection level)
    #[arg(long, default_value = "coast", value_parser = water())]
    water: Area,
    /// One sigma per axis of the slow errors of the receivers of vehicle and ship, m (protection level)
    #[arg(long, value_name = "M", default_value_t = RECEIVER_BIAS_M, value_parser = length)]
    receiver_bias: f64,
    #[command(flatten)]
    beside: Beside,
    /// Terms that `diagnose --report` proposed, taken out of the readings
    #[arg(long, value_name = "TERMS.toml")]
    terms: Option<PathBuf>,
    /// Truth CSV to compare with
    #[arg(long, value_name = "T.csv")]
    truth: Option<PathBuf>,
    /// Write the vehicle file with what this dive has shown of the vehicle: the next one starts from it
    #[arg(long, value_name = "V2.toml")]
    learn: Option<PathBuf>,
    /// Write the estimated track, CSV
    #[arg(long, value_name = "TRACK.csv")]
    out: Option<PathBuf>,
    #[command(flatten)]
    output: Output,
}

fn model() -> impl TypedValueParser<Value = Model> {
    PossibleValuesParser::new([
        PossibleValue::new("robust")
            .help("The vehicle's own dynamics; what is not known of vehicle, compass and current is estimated"),
        PossibleValue::new("nominal")
            .alias("dynamic")
            .help("The vehicle's own dynamics exactly as the vehicle file declares them"),
        PossibleValue::new("thesis")
            .help("The nominal filter as in the thesis: every measurement is used, to first order, no gates"),
        PossibleValue::new("kinematic").help("Constant velocity"),
    ])
    .try_map(|name| name.parse())
}

fn water() -> impl TypedValueParser<Value = Area> {
    PossibleValuesParser::new(["lake", "coast", "strait"]).try_map(|name| navigate::water(&name))
}

fn length(text: &str) -> Result<f64, String> {
    let metres = text.parse().ok().filter(|metres: &f64| (0.0..=1.0e3).contains(metres));
    metres.ok_or_else(|| "expected metres, 0 to 1000".to_owned())
}

/// Reads, runs, compares, writes.
pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    args.output.check(&[&args.out, &args.learn])?;
    let declared = args.vehicle.as_ref().map(|path| VehicleFile::read(path)).transpose()?;
    let vehicle = declared.clone().unwrap_or_else(VehicleFile::reference);
    let mut read = args.input.read(&args.log)?;
    if !args.input.is_admitted(&mut [&mut read], "navigate", &args.output)? {
        return Ok(Outcome::Doubtful);
    }
    args.beside.join(&mut read, &vehicle)?;
    if let Some(path) = &args.terms {
        navigate::take_out_file(&mut read, &vehicle, path)?;
    }
    explain_failure(&read, || write(args, &read, declared.as_ref(), &vehicle))
}

/// What to do about a track that is not to be trusted, and the command.
fn next(args: &Args, read: &ReadLog) -> Option<(&'static str, String)> {
    let (log, options) = (word(&args.log), &read.options);
    if read.examination.suspicions().next().is_some() {
        return Some(("Which columns contradict physics:", format!("backseat info {log}{options}")));
    }
    // What was taken out of the log, no other command knows.
    let is_diagnosed = uses::of(&read.log).iter().any(|of| of.command == "diagnose" && of.possible);
    (args.terms.is_none() && is_diagnosed).then(|| {
        let path = |name: &str, path: &Option<PathBuf>| {
            path.as_ref().map_or_else(String::new, |path| format!(" --{name} {}", word(path)))
        };
        let (vehicle, truth) = (path("vehicle", &args.vehicle), path("truth", &args.truth));
        let beside = args.beside.options();
        let no_dvl = if args.no_dvl { " --no-dvl" } else { "" };
        (
            "What the declared vehicle lacks, by name:",
            format!("backseat diagnose {log}{options}{beside}{vehicle}{truth}{no_dvl}"),
        )
    })
}

/// From the log that was read to what is written.
fn write(
    args: &Args,
    read: &ReadLog,
    declared: Option<&VehicleFile>,
    vehicle: &VehicleFile,
) -> anyhow::Result<Outcome> {
    let Args { no_dvl, no_range_rate, current, packet, smooth, model, water, receiver_bias: receiver_bias_m, .. } =
        *args;
    let settings = Settings { model, no_dvl, no_range_rate, current, packet, smooth, water, receiver_bias_m };
    let truth = args.truth.as_ref().map(|path| Truth::read(path)).transpose()?;
    let result = navigate::compute(read, declared, truth.as_ref(), &settings)?;
    if let (Some(path), true) = (&args.truth, result.errors.is_none()) {
        return Err(DataError::file(path, "the truth has no time in common with the estimate").into());
    }
    if let Some(path) = &args.learn {
        let next = result.learnt(vehicle).context(
            "--learn: only the robust model learns anything of the vehicle (--model robust, a log with fins and propeller)",
        )?;
        next.write(path, &result.learnt_source(vehicle), args.output.existing())?;
    }
    if let Some(path) = &args.out {
        backseat_logs::output::write(path, args.output.existing(), |file| result.write_track(file))?;
    }
    let report = navigate::report(&result).file("track", args.out.as_deref());
    let next = next(args, read).filter(|_| !result.health.doubts.is_empty());
    args.output.show(match next {
        Some((why, command)) => report.everywhere().section("Next").text(why).command(&command),
        None => report,
    })?;
    Ok(Outcome::doubtful_if(!result.health.doubts.is_empty()))
}
