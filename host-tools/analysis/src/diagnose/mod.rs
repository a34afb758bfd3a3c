//! Which physical effect the declared model lacks: `backseat diagnose`.

mod corrected_vehicle;
mod files;
mod format;
mod json;
pub mod log_kinds;
mod magnetic;
mod page;
mod report;
mod sentence;
pub mod torpedo;
mod torpedo_drift;

pub use files::{Files, Options};
pub use report::report;
pub use sentence::sentence;

use crate::columns::has_actuators;
use crate::read_log::{ReadLog, file_name};
use anyhow::bail;
use backseat_diagnose::diagnosis::{self, Diagnosis};
use backseat_diagnose::floor;
use backseat_diagnose::log_effects::Effects;
use backseat_diagnose::log_models::LogModelDiagnosis;
use backseat_diagnose::prepared_log::PreparedLog;
use backseat_diagnose::scores::{self, Scores};
use backseat_estimation::dead_reckoning::{self, Method};
use backseat_estimation::inputs;
use backseat_logs::log::Column;
use backseat_logs::{Log, Truth, VehicleFile};
use backseat_report::console::Spinner;
use log_kinds::Kind;
use std::borrow::Cow;
use std::time::Instant;

/// The proposed terms, and the effects that no vehicle file holds, in the report's folder.
pub const TERMS_FILE: &str = "proposed_terms.toml";

/// So many rows are diagnosed, a day at 10 Hz: the search keeps about 1 kB of each, and is to do with 2 GB.
const MOST_ROWS: usize = 1_000_000;

/// What scores are computed on.
const HELD_OUT: &str =
    "two of every nine minutes, and the last tenth of each run, of which nothing was fitted or chosen";

/// Joins logs of the same time base to the first, and leaves one run alone, counted from 1, if that is wanted.
///
/// # Errors
/// There is no such run.
pub fn gather(log: &mut Log, beside: impl Iterator<Item = Log>, run: Option<u32>) -> anyhow::Result<()> {
    beside.for_each(|other| log.join(other));
    if let Some(run) = run {
        log.rows.retain(|row| row.get(Column::Run) == Some(f64::from(run)));
        if log.rows.is_empty() {
            bail!(
                "{}: there is no run {run}; the notes of a diagnosis of all of them list the runs",
                log.path.display()
            );
        }
    }
    log.keep_first(MOST_ROWS);
    Ok(())
}

/// What a log says of the declared model.
pub struct DiagnosisResult<'a> {
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
    /// Position errors before and after: where data judge between those that were fitted, and in the forecast, m.
    pub position_by_part: [[Option<f64>; 2]; 2],
    /// What was assumed and left out.
    pub notes: Vec<String>,
    /// Why the result should not be trusted.
    pub doubts: Vec<String>,
    /// The declared vehicle with the effects found.
    pub vehicle: VehicleFile,
    /// What of the effects stands in its `[installation]`, and what it cannot hold.
    pub vehicle_notes: Vec<String>,
    /// Time taken with reading, s.
    pub wall_s: f64,
}

/// A diagnosis with its scores: of the declared model, with the effects, with the proposed terms.
struct Judged {
    diagnosis: Diagnosis,
    before: Scores,
    after: Scores,
    with_terms: Option<Scores>,
    position_by_part: [[Option<f64>; 2]; 2],
}

impl From<LogModelDiagnosis> for Judged {
    fn from(found: LogModelDiagnosis) -> Self {
        let LogModelDiagnosis { diagnosis, scores: [before, after], with_terms, .. } = found;
        // the forecast's part is among its notes
        Self { diagnosis, before, after, with_terms, position_by_part: [[None; 2]; 2] }
    }
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
) -> anyhow::Result<DiagnosisResult<'a>> {
    compute_with(&[], read, declared, truth, no_dvl)
}

/// The same, with `more` kinds of logs than every user has.
///
/// # Errors
/// As [`compute`].
pub fn compute_with<'a>(
    more: &[Kind],
    read: &'a ReadLog,
    declared: Option<&VehicleFile>,
    truth: Option<&Truth>,
    no_dvl: bool,
) -> anyhow::Result<DiagnosisResult<'a>> {
    let began = Instant::now();
    let vehicle = &declared.cloned().unwrap_or_else(VehicleFile::reference);
    let log = inputs::at_centre(&read.log, &vehicle.installation);
    let mut notes = log.notes.clone();
    let spinner = Spinner::new("diagnose");
    let is_dynamic = has_actuators(&log);
    let Judged { diagnosis, mut before, mut after, with_terms, position_by_part } = if is_dynamic {
        if declared.is_none() {
            notes.push(format!("no --vehicle given: the declared model is the built-in {}", vehicle.name));
        }
        dynamic(&log, vehicle, truth, !no_dvl, &spinner)?
    } else {
        log_kinds::run(more, [&read.log, &log], vehicle, truth, !no_dvl, &|what| spinner.set(what))?.into()
    };
    drop(spinner);
    notes.extend(magnetic::note(&log, &diagnosis.effects));
    notes.extend(diagnosis.notes.iter().cloned());
    let declared = vehicle;
    let (vehicle, vehicle_notes) = corrected_vehicle::of(declared, &diagnosis, is_dynamic);
    if !is_dynamic {
        [before.track, after.track] = reckoned(&read.log, [declared, &vehicle], !no_dvl);
    }
    Ok(DiagnosisResult {
        log,
        diagnosis,
        before,
        after,
        with_terms,
        position_by_part,
        notes,
        doubts: read.examination.suspicions().map(|finding| finding.message.clone()).collect(),
        vehicle,
        vehicle_notes,
        wall_s: read.read_s + began.elapsed().as_secs_f64(),
    })
}

impl DiagnosisResult<'_> {
    /// Whether the verdict or the log itself says that the result is not to be trusted.
    pub fn is_doubtful(&self) -> bool {
        self.diagnosis.verdict.is_doubtful() || !self.doubts.is_empty()
    }

    /// First lines of the vehicle file.
    pub fn source(&self) -> String {
        format!(
            "{} with the effects that `backseat diagnose` found in {}",
            self.vehicle.name,
            file_name(&self.log.path)
        )
    }
}

/// Tracks of dead reckoning from the first fix on by these vehicles; none of a log that is diagnosed by another model.
fn reckoned(log: &Log, vehicles: [&VehicleFile; 2], use_dvl: bool) -> [Vec<(f64, f64)>; 2] {
    let has_dvl = use_dvl && [Column::DvlU, Column::DvlV, Column::DvlW].into_iter().all(|column| log.has(column));
    let method = if has_dvl { Method::CompassDvl } else { Method::HeadingSpeed };
    let is_reckoned = log_kinds::use_of(log) == Ok(log_kinds::DEAD_RECKONING);
    vehicles.map(|vehicle| {
        let log = inputs::at_centre(log, &vehicle.installation);
        let run = is_reckoned.then(|| dead_reckoning::run(&log, method, &vehicle.effects.set));
        let positions = run.and_then(Result::ok).unwrap_or_default();
        positions.iter().map(|position| (position.position_m[0], position.position_m[1])).collect()
    })
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
    let diagnosis = floor::under(diagnosis, &log_data, with_terms.as_ref().unwrap_or(&after));
    let position_by_part = [&before, &after].map(|scores| scores::position_by_part(&log_data.split, scores));
    Ok(Judged { diagnosis, before, after, with_terms, position_by_part })
}
