//! `backseat diagnose`: which physical effect the declared model lacks.

mod json;
mod page;
mod sentence;
mod text;

pub use json::text as json;
pub use page::html;
pub use sentence::sentence;

use crate::effect::terms::Terms;
use crate::log_input::LogInput;
use crate::outcome::Outcome;
use anyhow::{Context, bail};
use backseat_analysis::read_log::ReadLog;
use backseat_analysis::uses;
use backseat_core::effects::ParameterId;
use backseat_diagnose::diagnosis::{self, Diagnosis};
use backseat_diagnose::log_effects::{Effects, is_of_readings};
use backseat_diagnose::log_models::{
    LogModelDiagnosis, dead_reckoning, glider, pinger, planar_manoeuvring, reference_velocity, thruster, transponders,
};
use backseat_diagnose::prepared_log::PreparedLog;
use backseat_diagnose::scores::{self, Scores};
use backseat_estimation::inputs;
use backseat_logs::importers;
use backseat_logs::log::Column;
use backseat_logs::output::{self, Existing};
use backseat_logs::{Log, Truth, VehicleFile};
use backseat_report::console;
use indicatif::{ProgressBar, ProgressStyle};
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const EXAMPLES: &str = "\
Examples:
  backseat diagnose log.csv.gz                                the built-in vehicle, one page of text
  backseat diagnose log.csv --vehicle iver3.toml --report out  out/report.html and out/vehicle.toml
  backseat diagnose log.csv --no-dvl --truth truth.csv --json  one JSON object, for scripts
  backseat diagnose glider_flight.csv --with glider_ctd.csv   two logs of one time base
  backseat diagnose ranges.csv --with transponders.csv        two-way ranges: lever arm and speed of sound
  backseat diagnose turns.csv --with zigzags.csv --with wind.csv
                                                              runs of a vessel with rudder: the wind
  backseat diagnose runs.csv --run 3                          one run of a table that holds several
  backseat diagnose table.csv --columns map.toml              a table of any other maker

The log is one that `backseat navigate` reads, or the log of a glider, of a pinger, or of a DVL with an AHRS. A log without
fin angles and propeller speed is compared with the plainest model that it supports: a steady glide, the pseudo-ranges of
a pinger with its own clock, or dead reckoning. The vehicle file written holds the declared vehicle and the effects
found; `navigate`, `params import` and the simulator read it.";

/// Find out which physical effect the declared model lacks
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Vehicle log, .csv or .csv.gz, or an Iver UVC mission log
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
    /// Use this run only, of a table that holds several, counted from 1
    #[arg(long, value_name = "N")]
    run: Option<u32>,
    #[command(flatten)]
    input: LogInput,
    /// Write an HTML report and the augmented vehicle file into this folder
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Write the augmented vehicle file here
    #[arg(long, value_name = "V2.toml")]
    out: Option<PathBuf>,
    /// Print one JSON object instead of the text
    #[arg(long)]
    json: bool,
    /// Replace results that exist
    #[arg(long)]
    force: bool,
}

/// A diagnosis with its scores: of the declared model, with the effects, with the proposed terms.
struct Judged {
    diagnosis: Diagnosis,
    before: Scores,
    after: Scores,
    with_terms: Option<Scores>,
}

/// The proposed terms, and the effects that no vehicle file holds, in the report's folder.
const TERMS_FILE: &str = "proposed_terms.toml";

/// So many rows are diagnosed, a day at 10 Hz: the search keeps about 1 kB of each, and is to do with 2 GB.
const MOST_ROWS: usize = 1_000_000;

/// What the report shows.
pub struct DiagnosisReport<'a> {
    /// At the centre of gravity.
    pub log: Cow<'a, Log>,
    /// Verdict and effects.
    pub diagnosis: Diagnosis,
    /// Scores of the declared model on held-out data.
    pub before: Scores,
    /// Those with the effects found.
    pub after: Scores,
    /// Those with the proposed terms as well, where there are any.
    pub with_terms: Option<Scores>,
    /// What was assumed and left out.
    pub notes: Vec<String>,
    /// Why the result should not be trusted.
    pub doubts: Vec<String>,
    /// The declared vehicle with the effects found.
    pub vehicle: VehicleFile,
    /// What of the effects stands in its `[installation]`, and what it cannot hold.
    pub vehicle_notes: Vec<String>,
    /// Where that vehicle was written.
    pub vehicle_file: Option<&'a Path>,
    /// Where the proposed terms were written.
    pub terms_file: Option<PathBuf>,
    /// Where the report is written.
    pub page: Option<&'a Path>,
    /// Time taken with reading, s.
    pub wall_s: f64,
}

/// Reads, diagnoses, writes.
pub fn run(args: &Args) -> anyhow::Result<Outcome> {
    let existing = if args.force { Existing::Replace } else { Existing::Keep };
    let page = args.report.as_ref().map(|folder| folder.join("report.html"));
    let vehicle_path = args.out.clone().or_else(|| args.report.as_ref().map(|folder| folder.join("vehicle.toml")));
    let terms_path = args.report.as_ref().map(|folder| folder.join(TERMS_FILE));
    for path in [&page, &vehicle_path, &terms_path].into_iter().flatten() {
        output::check(path, existing)?;
    }
    let vehicle = args.vehicle.as_ref().map(|path| VehicleFile::read(path)).transpose()?;
    let read = read(args)?;
    crate::log_input::explain_failure(&read, || {
        write(args, &read, vehicle.as_ref(), [page.as_deref(), vehicle_path.as_deref()], existing)
    })
}

/// From the log that was read to what is written: the page and the vehicle file.
fn write(
    args: &Args,
    read: &ReadLog,
    vehicle: Option<&VehicleFile>,
    [page, vehicle_path]: [Option<&Path>; 2],
    existing: Existing,
) -> anyhow::Result<Outcome> {
    let truth = args.truth.as_ref().map(|path| Truth::read(path)).transpose()?;
    let mut outcome = compute(read, vehicle, truth.as_ref(), args.no_dvl)?;
    for path in [page, vehicle_path].into_iter().flatten() {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        }
    }
    if let Some(path) = vehicle_path.filter(|_| !outcome.diagnosis.effects.is_empty()) {
        outcome.vehicle.write(path, &outcome.source(), existing)?;
        outcome.vehicle_file = Some(path);
        outcome.notes.append(&mut outcome.vehicle_notes);
    }
    let terms = Terms::of(&outcome.diagnosis.proposed, &outcome.diagnosis.effects);
    if let Some(path) = args.report.as_ref().filter(|_| !terms.is_empty()) {
        let (path, log) = (path.join(TERMS_FILE), args.log.display().to_string());
        terms.write(&path, &log, existing)?;
        outcome.terms_file = Some(path);
    }
    outcome.page = page;
    if let Some(path) = page {
        let html = page::html(&outcome);
        output::write(path, existing, |file| file.write_all(html.as_bytes()))?;
    }
    let text = if args.json { json(&outcome) } else { text::text(&outcome) };
    console::print(text.as_bytes())?;
    Ok(Outcome::doubtful_if(!outcome.doubts.is_empty()))
}

/// Diagnoses a log that was read; without a vehicle, against the built-in reference.
///
/// # Errors
/// The log fits no model, or the filter cannot start or diverges.
pub fn compute<'a>(
    read: &'a ReadLog,
    declared: Option<&VehicleFile>,
    truth: Option<&Truth>,
    no_dvl: bool,
) -> anyhow::Result<DiagnosisReport<'a>> {
    let began = Instant::now();
    let vehicle = &declared.cloned().unwrap_or_else(VehicleFile::reference);
    let log = inputs::at_centre(&read.log, &vehicle.installation);
    let mut notes = log.notes.clone();
    let spinner = Spinner::new();
    let is_dynamic = uses::has_actuators(&log);
    let Judged { diagnosis, before, after, with_terms } = if is_dynamic {
        if declared.is_none() {
            notes.push(format!("no --vehicle given: the declared model is the built-in {}", vehicle.name));
        }
        dynamic(&log, vehicle, truth, !no_dvl, &spinner)?
    } else {
        by_log_model([&read.log, &log], vehicle, truth, !no_dvl, &spinner)?
    };
    drop(spinner);
    notes.extend(diagnosis.notes.iter().cloned());
    let mut augmented = augmented(vehicle, &diagnosis);
    let vehicle_notes = install(&mut augmented, &diagnosis, is_dynamic);
    Ok(DiagnosisReport {
        log,
        diagnosis,
        before,
        after,
        with_terms,
        notes,
        doubts: read.examination.suspicions().map(|finding| finding.message.clone()).collect(),
        vehicle: augmented,
        vehicle_notes,
        vehicle_file: None,
        terms_file: None,
        page: None,
        wall_s: read.read_s + began.elapsed().as_secs_f64(),
    })
}

impl DiagnosisReport<'_> {
    /// First lines of the vehicle file.
    pub fn source(&self) -> String {
        let name = self.log.path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        format!("{} with the effects that `backseat diagnose` found in {name}", self.vehicle.name)
    }
}

/// The log, with the one beside it.
fn read(args: &Args) -> anyhow::Result<ReadLog> {
    let mut read = args.input.read(&args.log)?;
    for path in &args.with {
        read.log.join(importers::read(path)?.log);
    }
    if let Some(run) = args.run {
        read.log.rows.retain(|row| row.get(Column::Run) == Some(f64::from(run)));
        if read.log.rows.is_empty() {
            bail!(
                "{}: there is no run {run}; the notes of a diagnosis without --run list the runs",
                args.log.display()
            );
        }
    }
    read.log.keep_first(MOST_ROWS);
    Ok(read)
}

/// Logs without fins and propeller: each kind has its own model. Those of sensors apply the installation themselves, to
/// the `raw` log.
fn by_log_model(
    [raw, log]: [&Log; 2],
    vehicle: &VehicleFile,
    truth: Option<&Truth>,
    use_dvl: bool,
    spinner: &Spinner,
) -> anyhow::Result<Judged> {
    let refuse_truth = |what: &str| match truth {
        Some(_) => {
            bail!("--truth cannot be used with {what}, whose errors are computed from the log itself: leave it out")
        }
        None => Ok(()),
    };
    let found = if pinger::is_for(log) {
        refuse_truth("a pinger's log")?;
        spinner.set("pseudo-ranges");
        let Some(found) = pinger::run(log, vehicle) else {
            bail!(
                "{}: the log has fewer than 30 pings with a GNSS position (gps_x_m, gps_y_m) and the pinger's place (ship_x_m, ship_y_m)",
                log.path.display()
            );
        };
        found
    } else if transponders::is_for(raw) {
        refuse_truth("travel times to transponders")?;
        spinner.set("two-way ranges");
        let Some(found) = transponders::run(raw, vehicle) else {
            bail!(
                "{}: the log needs 200 two-way travel times (two_way_time_s) with the antenna's place and the attitude at both \
                 ends, and the places of the transponders (station_x_m, station_y_m, station_z_m): join their table by --with",
                log.path.display()
            );
        };
        found
    } else if reference_velocity::is_for(raw) {
        refuse_truth("a reference velocity")?;
        spinner.set("DVL and reference");
        let Some(found) = reference_velocity::run(raw, vehicle) else {
            bail!(
                "{}: the log needs 60 DVL velocities inside runs of the reference velocity with attitude, and at most 24 runs",
                log.path.display()
            );
        };
        found
    } else if thruster::is_for(raw) {
        refuse_truth("a log of thrusters")?;
        spinner.set("thrust");
        let Some(found) = thruster::run(raw, vehicle) else {
            bail!(
                "{}: the log needs four stretches of 5 s on which both thrusters have the same command above 0.05",
                log.path.display()
            );
        };
        found
    } else if planar_manoeuvring::is_for(raw) {
        refuse_truth("a manoeuvring vessel")?;
        spinner.set("manoeuvres");
        let Some(found) = planar_manoeuvring::run(raw, vehicle) else {
            bail!(
                "{}: the log needs 30 windows under way, each half the time that the vessel takes for its own length, and at \
                 most 24 runs of 8 windows or more",
                log.path.display()
            );
        };
        found
    } else if glider::is_for(log) {
        refuse_truth("a glider's log")?;
        spinner.set("glide");
        let Some(found) = glider::run(log, vehicle) else {
            bail!(
                "{}: too little steady gliding: the model needs 60 stretches of 16 s below 3 m with constant ballast",
                log.path.display()
            );
        };
        found
    } else {
        spinner.set("dead reckoning");
        let Some(found) = dead_reckoning::run(log, vehicle, use_dvl, truth) else {
            bail!(
                "{}: the log has neither fins and propeller speed (for the dynamic model) nor heading, speed and GNSS \
                 fixes under way, {} stretches between two fixes (for dead reckoning)",
                log.path.display(),
                dead_reckoning::FEWEST
            );
        };
        found
    };
    let LogModelDiagnosis { diagnosis, scores: [before, after], with_terms, .. } = found;
    Ok(Judged { diagnosis, before, after, with_terms })
}

/// The main route: the vehicle's own dynamics.
fn dynamic(
    log: &Log,
    vehicle: &VehicleFile,
    truth: Option<&Truth>,
    use_dvl: bool,
    spinner: &Spinner,
) -> anyhow::Result<Judged> {
    let Some(mut log_data) = PreparedLog::new(log, vehicle, use_dvl) else {
        bail!(
            "{}: the filter cannot start: the log needs a GNSS fix (gps_x_m, gps_y_m) and an attitude (roll_rad, pitch_rad, heading_rad)",
            log.path.display()
        );
    };
    let Some(diagnosis) = diagnosis::run(&mut log_data, |what| spinner.set(what)) else {
        bail!(
            "{}: the filter diverged: check the units and signs of the log's columns and the vehicle file",
            log.path.display()
        );
    };
    spinner.set("before and after");
    let score = |pass, set| scores::of(&log_data, pass, set, log, vehicle, truth, use_dvl);
    let declared = Effects::from(vehicle.effects.set);
    let set = diagnosis.set(&declared);
    let (before, after) = rayon::join(
        || score(&diagnosis.before, &declared),
        || if diagnosis.effects.is_empty() { Ok(None) } else { score(&diagnosis.after, &set).map(Some) },
    );
    let before = before?;
    let after = after?.unwrap_or_else(|| before.clone());
    let with_terms = diagnosis.with_terms.as_ref().map(|pass| score(pass, &declared)).transpose()?;
    Ok(Judged { diagnosis, before, after, with_terms })
}

/// Where `[installation]` of the vehicle file declares what an effect corrects: key, and number of values.
const INSTALLED: [(&str, &str, usize); 5] = [
    ("gnss_lever_arm", "installation.gnss_arm_m", 2),
    ("dvl_lever_arm", "installation.dvl_arm_m", 3),
    ("transducer_lever_arm", "installation.transducer_arm_m", 3),
    ("dvl_delay", "installation.dvl_delay_s", 1),
    ("heading_lag", "installation.ahrs_delay_s", 1),
];

/// Corrects `[installation]` by the effects found; returns a note for each that it cannot hold. Of a log with fins and
/// propeller, a late heading is no late AHRS, whose delay would shift rates and pitch as well.
fn install(file: &mut VehicleFile, diagnosis: &Diagnosis, is_dynamic: bool) -> Vec<String> {
    let mut notes = Vec::new();
    for found in &diagnosis.effects {
        let effect = found.instance.candidate.effect;
        let mut places = INSTALLED.iter().filter(|(name, ..)| !(is_dynamic && is_of_readings(name)));
        let Some((_, key, count)) = places.find(|(name, ..)| *name == effect) else {
            if is_dynamic && is_of_readings(effect) {
                notes.push(format!(
                    "{effect} is no part of a vehicle file: --report writes {TERMS_FILE}, which `navigate --terms` takes \
                     out of a log"
                ));
            } else if backseat_core::effects::find(effect).is_none() {
                notes.push(format!("{effect} is no part of a vehicle file: it is written nowhere"));
            }
            continue;
        };
        let declared = file.flatten();
        // an axis of an arm that the log does not show stays as it is declared
        let is_shown = |place: usize| {
            found.values.get(place).is_none_or(|value| value.ci95[0] > 0.0 || value.ci95[1] < 0.0) || *count == 1
        };
        let sizes = found.instance.sizes.iter().take(*count).enumerate().filter(|(place, _)| is_shown(*place));
        let moved = sizes.map(|(place, size)| {
            let name = if *count == 1 { (*key).to_owned() } else { format!("{key}[{place}]") };
            let before = declared.iter().find(|(of, _)| *of == name).map_or(0.0, |(_, value)| *value);
            (name, before + size)
        });
        let moved: Vec<(String, f64)> = moved.collect();
        let is_partial = moved.len() < *count;
        match file.apply(moved) {
            Ok(()) if is_partial => notes.push(format!(
                "{effect} is written into {key} of the vehicle file, but for axes whose interval holds zero"
            )),
            Ok(()) => notes.push(format!("{effect} is written into {key} of the vehicle file")),
            Err(error) => notes.push(format!("{effect} is not written into the vehicle file: {error}")),
        }
    }
    notes
}

/// The declared vehicle with the effects found and their intervals.
fn augmented(vehicle: &VehicleFile, diagnosis: &Diagnosis) -> VehicleFile {
    let mut file = vehicle.clone();
    file.effects.set = diagnosis.set(&vehicle.effects.set.into()).board;
    for found in &diagnosis.effects {
        for value in &found.values {
            let Some(id) = ParameterId::find(found.instance.candidate.effect, value.name) else { continue };
            let [low, high] = value.ci95;
            // A value held at the edge of what is plausible has no interval.
            let is_interval = low < high && low.is_finite() && high.is_finite();
            if is_interval && (low..=high).contains(&file.effects.set.get(id)) {
                file.effects.ci95.push((id, value.ci95));
            }
        }
    }
    file
}

/// What is being done, on stderr, while it lasts longer than a moment.
struct Spinner {
    bar: ProgressBar,
}

impl Spinner {
    fn new() -> Self {
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} diagnose: {msg} ({elapsed})") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { bar }
    }

    fn set(&self, what: &str) {
        self.bar.set_message(what.to_owned());
    }
}

impl Drop for Spinner {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
