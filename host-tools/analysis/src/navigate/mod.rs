//! The flight filter over a recorded mission.

mod estimates;
mod figures;
mod report;
mod result;
mod trial;

use crate::effect::terms::Terms;
use crate::read_log::ReadLog;
use crate::uses::{self, Navigation};
use backseat_core::navigation::{Area, Declared, ProcessModel};
use backseat_diagnose::log_effects::Effects;
use backseat_diagnose::proposal;
use backseat_diagnose::regressors::{Proposed, Target};
use backseat_diagnose::torpedo;
use backseat_estimation::dead_reckoning::{self, Method};
use backseat_estimation::filter::{self, FilterOptions, Health, ShipSource};
use backseat_estimation::inputs;
use backseat_identify::short_runs::recording;
use backseat_logs::plausible_noise::{Carrier, most_position_error_m};
use backseat_logs::stats::rms;
use backseat_logs::{Log, Truth, VehicleFile};
use backseat_report::console::Progress;
pub use report::report;
pub use result::{Against, Errors, Estimate, NavigationResult};
use std::path::Path;
use std::str::FromStr;
use std::time::Instant;
pub use trial::Trial;

/// How a log is navigated.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Process model; the best that the log supports without one.
    pub model: Option<Model>,
    /// Leave the DVL out.
    pub no_dvl: bool,
    /// Leave acoustic range rates out.
    pub no_range_rate: bool,
    /// Estimate a steady water current as well (the robust model always does).
    pub current: bool,
    /// Take the ship from the packets alone instead of its GNSS at full rate.
    pub packet: bool,
    /// Smooth the track after the filter: the best estimate of each time from the whole log.
    pub smooth: bool,
    /// Where it was, for the protection level.
    pub water: Area,
    /// One sigma per axis of the slow errors of the receivers of vehicle and ship, m.
    pub receiver_bias_m: f64,
}

/// One sigma per axis of the slow errors of a receiver without corrections, m.
pub const RECEIVER_BIAS_M: f64 = 1.5;

impl Default for Settings {
    fn default() -> Self {
        Self {
            model: None,
            no_dvl: false,
            no_range_rate: false,
            current: false,
            packet: false,
            smooth: false,
            water: Area::default(),
            receiver_bias_m: RECEIVER_BIAS_M,
        }
    }
}

/// What moves the vehicle between measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// The vehicle's own dynamics; what is not known of vehicle, compass and current is estimated.
    Robust,
    /// The vehicle's own dynamics exactly as the vehicle file declares them.
    Nominal,
    /// [`Self::Nominal`] as in the thesis: every measurement is used, to first order.
    Thesis,
    /// Constant velocity.
    Kinematic,
}

impl FromStr for Model {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "robust" => Ok(Self::Robust),
            "nominal" | "dynamic" => Ok(Self::Nominal),
            "thesis" => Ok(Self::Thesis),
            "kinematic" => Ok(Self::Kinematic),
            _ => Err(format!("model {name:?}: expected robust, nominal, thesis or kinematic")),
        }
    }
}

/// Waters by their name.
///
/// # Errors
/// There are none of this name.
pub fn water(name: &str) -> Result<Area, String> {
    match name {
        "lake" => Ok(Area::Lake),
        "coast" => Ok(Area::Coast),
        "strait" => Ok(Area::Strait),
        _ => Err(format!("water {name:?}: expected lake, coast or strait")),
    }
}

/// What runs over the log.
enum Plan {
    Filter(Box<FilterOptions>),
    DeadReckoning(Method),
}

/// Takes effects of sensors and proposed terms out of the readings at the centre of gravity; notes which terms do not
/// concern readings.
pub fn take_out(read: &mut ReadLog, vehicle: &VehicleFile, terms: &[Proposed], effects: &Effects) {
    let log = inputs::at_centre(&read.log, &vehicle.installation).into_owned();
    read.log = effects.corrected(proposal::corrected(&log, terms)).into_owned();
    for (term, _) in terms.iter().filter(|(term, _)| !matches!(term.target, Target::Reading(_))) {
        let name = term.name();
        read.log
            .notes
            .push(format!("{name} is not taken into account: the filter has no such term; `effect new` drafts it"));
    }
}

/// The same of a file of terms that a diagnosis proposed.
///
/// # Errors
/// The file cannot be read, or holds what is not known.
pub fn take_out_file(read: &mut ReadLog, vehicle: &VehicleFile, path: &Path) -> anyhow::Result<()> {
    let file = Terms::read(path)?;
    take_out(read, vehicle, &file.known()?, &file.effects()?);
    read.log.notes.extend(file.effect.iter().map(|effect| format!("{} was taken out of the readings", effect.name)));
    Ok(())
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
    let mut vehicle = declared.cloned().unwrap_or_else(VehicleFile::reference);
    let mut log = inputs::at_centre(&read.log, &vehicle.installation);
    let mut notes = log.notes.clone();
    if torpedo::is_for(&log) && log.runs.len() <= 1 {
        if let Some((of_run, name)) = torpedo::configurations::vehicle_of(&log, &vehicle) {
            notes.push(format!("the vehicle as it was configured for {name}"));
            vehicle = of_run;
        }
        if let Some(dive) = recording::dive(&log).filter(|dive| dive.len() < log.rows.len()) {
            notes.push(format!(
                "{} rows before and after the dive are left out: the vehicle floats there, or is carried",
                log.rows.len() - dive.len()
            ));
            let log = log.to_mut();
            log.rows.truncate(dive.end);
            log.rows.drain(..dive.start);
        }
    }
    let vehicle = &vehicle;
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
    if let (Estimate::DeadReckoning(_), Some((Against::Gnss, errors))) = (&estimate, &errors) {
        health.doubts.extend(beyond_drift(&estimate, errors, vehicle));
    }
    health.doubts.splice(..0, read.examination.suspicions().map(|finding| finding.message.clone()));
    Ok(NavigationResult {
        description: describe(declared.is_some(), &plan, vehicle),
        format: read.format,
        log,
        estimate,
        truth,
        receiver_bias_m: settings.receiver_bias_m,
        errors,
        smoothed_errors,
        health,
        notes,
        read_s: read.read_s,
        wall_s,
    })
}

fn plan(settings: &Settings, log: &Log, vehicle: &VehicleFile, notes: &mut Vec<String>) -> Plan {
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
        Model::Nominal | Model::Thesis => FilterOptions::new(vehicle, ProcessModel::Dynamic),
        Model::Kinematic => FilterOptions::new(vehicle, ProcessModel::Kinematic),
    };
    if model == Model::Thesis {
        options.navigation.make_as_in_thesis();
    }
    options.use_dvl = !settings.no_dvl;
    options.use_range_rate = !settings.no_range_rate;
    options.smooth = settings.smooth;
    options.level =
        Some(Declared { area: settings.water, receivers_m: [settings.receiver_bias_m; 2], ..Declared::DEFAULT });
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
        Plan::Filter(options) => {
            let progress = Progress::new("filter", log.rows.len());
            let run = filter::run_watched(log, vehicle, options, |row| progress.set(row), |_| {})?;
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

/// Says so where dead reckoning is off by more than heading and speed of their class make over the distance run.
fn beyond_drift(estimate: &Estimate, errors: &[(u64, f64)], vehicle: &VehicleFile) -> Option<String> {
    let positions = estimate.positions();
    let mut run_m = vec![(0, 0.0)];
    for pair in positions.windows(2) {
        let step_m =
            f64::hypot(pair[1].position_m[0] - pair[0].position_m[0], pair[1].position_m[1] - pair[0].position_m[1]);
        run_m.push((pair[1].time_us, run_m[run_m.len() - 1].1 + step_m));
    }
    let most_m = |time_us: u64| {
        let at = run_m.partition_point(|(run_us, _)| *run_us <= time_us).saturating_sub(1);
        most_position_error_m(Carrier::WaterSpeed, run_m[at].1, &vehicle.sensors)
    };
    let error_m = rms(&errors.iter().map(|(_, error_m)| *error_m).collect::<Vec<_>>())?;
    let most_m = rms(&errors.iter().map(|(time_us, _)| most_m(*time_us)).collect::<Vec<_>>())?;
    (error_m > most_m).then(|| {
        format!(
            "dead reckoning is off by {error_m:.0} m (RMS), where heading and speed of their class drift by at most \
             {most_m:.0} m over this distance: a current, a sign or a unit?"
        )
    })
}

fn describe(is_declared: bool, plan: &Plan, vehicle: &VehicleFile) -> String {
    match plan {
        Plan::DeadReckoning(_) => "dead reckoning on logged heading and speed".to_owned(),
        Plan::Filter(options) => {
            let model = match options.navigation.process_model {
                ProcessModel::Dynamic if options.is_robust() => "robust dynamic model",
                ProcessModel::Dynamic if options.navigation.surface.is_none() => "the thesis' dynamic model",
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
