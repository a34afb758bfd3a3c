//! Kinds of logs without fins and propeller: what `diagnose` can do with each, and the model that it is diagnosed by.

use crate::columns::{IN_LABORATORY, has_actuators, is_beside, lacking};
use anyhow::bail;
use backseat_diagnose::log_models::{LogModelDiagnosis, dead_reckoning, reference_velocity};
use backseat_diagnose::torpedo;
use backseat_logs::log::Column;
use backseat_logs::{Log, Truth, VehicleFile};

/// What `diagnose` does with heading, speed and fixes under way.
pub const DEAD_RECKONING: &str = "against dead reckoning from fix to fix";

/// A kind of log with a model of its own.
pub struct Kind {
    /// Whether a log is of this kind.
    pub is_for: fn(&Log) -> bool,
    /// What is diagnosed.
    pub how: &'static str,
    /// What the log is.
    pub what: &'static str,
    /// What the log needs for it.
    pub needs: &'static str,
    /// Whether the model applies the installation itself, to the log as it was read.
    pub is_of_sensors: bool,
    /// The diagnosis; `None` if the log lacks what it needs.
    pub run: fn(&Log, &VehicleFile) -> Option<LogModelDiagnosis>,
}

/// Those of every user.
const KINDS: [Kind; 1] = [Kind {
    is_for: reference_velocity::is_for,
    how: "the DVL against a reference velocity",
    what: "a reference velocity",
    needs: "60 DVL velocities inside runs of the reference velocity with attitude, and at most 24 runs",
    is_of_sensors: true,
    run: reference_velocity::run,
}];

/// Logs whose models are in the laboratory: ballast of a glider, round trips to transponders, a pair of thrusters, a
/// ship's rudder and its motion, the arrivals of a pinger with a clock of its own. Those that can be dead reckoned
/// are, by the command line: a ship's fixes say when its heading and velocity are late.
fn is_of_laboratory(log: &Log) -> bool {
    [Column::Ballast, Column::TwoWayTime, Column::ThrusterLeft].into_iter().any(|column| log.has(column))
        || [Column::Rudder, Column::DvlU, Column::R].into_iter().all(|column| log.has(column))
        || log.has(Column::Toa) && !log.has(Column::Tol) && !log.has(Column::Range)
}

/// What `diagnose` does with a log, or what the log lacks.
pub fn use_of(log: &Log) -> Result<&'static str, String> {
    if torpedo::is_for(log) {
        return Ok("runs of a torpedo without fixes, in six degrees of freedom");
    }
    if has_actuators(log) {
        let missing = lacking(log, &[Column::GpsX, Column::GpsY, Column::Roll, Column::Pitch, Column::Heading]);
        return if missing.is_empty() { Ok("against the vehicle's dynamics") } else { Err(format!("lacks {missing}")) };
    }
    if let Some(kind) = KINDS.iter().find(|kind| (kind.is_for)(log)) {
        Ok(kind.how)
    } else if dead_reckoning::is_for(log) {
        Ok(DEAD_RECKONING)
    } else if is_of_laboratory(log) {
        Err(format!("{IN_LABORATORY}cargo lab single-log LOG"))
    } else if is_beside(log) && [Column::StationX, Column::WindSpeed, Column::WaterDensity].iter().any(|c| log.has(*c))
    {
        Ok("only beside another log, with --with")
    } else {
        Err(format!(
            "lacks propeller and fins, and for dead reckoning heading, speed and fixes under way ({} stretches between two \
             fixes)",
            dead_reckoning::FEWEST
        ))
    }
}

/// Diagnoses a log without fins and propeller by the model of its kind, `more` kinds among them. Models of sensors apply
/// the installation themselves, to the `raw` log.
pub(super) fn run(
    more: &[Kind],
    [raw, log]: [&Log; 2],
    vehicle: &VehicleFile,
    truth: Option<&Truth>,
    use_dvl: bool,
    progress: &dyn Fn(&str),
) -> anyhow::Result<LogModelDiagnosis> {
    if let Some(kind) = more.iter().chain(&KINDS).find(|kind| (kind.is_for)(raw)) {
        if truth.is_some() {
            bail!(
                "a truth cannot be used with {}, whose errors are computed from the log itself: leave it out",
                kind.what
            );
        }
        progress(kind.what);
        let Some(found) = (kind.run)(if kind.is_of_sensors { raw } else { log }, vehicle) else {
            bail!("{}: the log needs {}", log.path.display(), kind.needs);
        };
        return Ok(found);
    }
    if is_of_laboratory(raw) && !dead_reckoning::is_for(log) {
        bail!("{}: such a log has its model in the laboratory", log.path.display());
    }
    progress("dead reckoning");
    let Some(found) = dead_reckoning::run(log, vehicle, use_dvl, truth) else {
        bail!(
            "{}: the log has neither fins and propeller speed (for the dynamic model) nor heading, speed and GNSS \
             fixes under way, {} stretches between two fixes (for dead reckoning)",
            log.path.display(),
            dead_reckoning::FEWEST
        );
    };
    Ok(found)
}
