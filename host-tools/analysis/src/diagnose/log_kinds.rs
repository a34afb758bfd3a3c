//! Kinds of logs without fins and propeller: what `diagnose` can do with each, and the model that it is diagnosed by.

use crate::columns::{has_actuators, is_beside, lacking};
use anyhow::bail;
use backseat_diagnose::log_models::{
    LogModelDiagnosis, dead_reckoning, glider, pinger, planar_manoeuvring, reference_velocity, thruster, transponders,
};
use backseat_diagnose::torpedo;
use backseat_logs::log::Column;
use backseat_logs::{Log, Truth, VehicleFile};

/// What `diagnose` does with heading, speed and fixes under way.
pub const DEAD_RECKONING: &str = "against dead reckoning from fix to fix";

/// What `diagnose` does with a log, or what the log lacks.
pub fn use_of(log: &Log) -> Result<&'static str, String> {
    if torpedo::is_for(log) {
        return Ok("runs of a torpedo without fixes, in six degrees of freedom");
    }
    if has_actuators(log) {
        let missing = lacking(log, &[Column::GpsX, Column::GpsY, Column::Roll, Column::Pitch, Column::Heading]);
        return if missing.is_empty() { Ok("against the vehicle's dynamics") } else { Err(format!("lacks {missing}")) };
    }
    if pinger::is_for(log) {
        Ok("pseudo-ranges of a pinger with its own clock")
    } else if transponders::is_for(log) {
        Ok("two-way ranges to transponders, whose places are joined by --with")
    } else if reference_velocity::is_for(log) {
        Ok("the DVL against a reference velocity")
    } else if thruster::is_for(log) {
        Ok("the thrust of two thrusters")
    } else if planar_manoeuvring::is_for(log) {
        Ok("against a manoeuvring model of hull, propeller and rudder")
    } else if glider::is_for(log) {
        Ok("against a steady glide")
    } else if dead_reckoning::is_for(log) {
        Ok(DEAD_RECKONING)
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

/// Diagnoses a log without fins and propeller by the model of its kind. Models of sensors apply the installation themselves, to
/// the `raw` log.
pub(super) fn run(
    [raw, log]: [&Log; 2],
    vehicle: &VehicleFile,
    truth: Option<&Truth>,
    use_dvl: bool,
    progress: &dyn Fn(&str),
) -> anyhow::Result<LogModelDiagnosis> {
    let refuse_truth = |what: &str| match truth {
        Some(_) => {
            bail!("--truth cannot be used with {what}, whose errors are computed from the log itself: leave it out")
        }
        None => Ok(()),
    };
    Ok(if pinger::is_for(log) {
        refuse_truth("a pinger's log")?;
        progress("pseudo-ranges");
        let Some(found) = pinger::run(log, vehicle) else {
            bail!(
                "{}: the log has fewer than 30 pings with a GNSS position (gps_x_m, gps_y_m) and the pinger's place (ship_x_m, ship_y_m)",
                log.path.display()
            );
        };
        found
    } else if transponders::is_for(raw) {
        refuse_truth("travel times to transponders")?;
        progress("two-way ranges");
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
        progress("DVL and reference");
        let Some(found) = reference_velocity::run(raw, vehicle) else {
            bail!(
                "{}: the log needs 60 DVL velocities inside runs of the reference velocity with attitude, and at most 24 runs",
                log.path.display()
            );
        };
        found
    } else if thruster::is_for(raw) {
        refuse_truth("a log of thrusters")?;
        progress("thrust");
        let Some(found) = thruster::run(raw, vehicle) else {
            bail!(
                "{}: the log needs four stretches of 5 s on which both thrusters have the same command above 0.05",
                log.path.display()
            );
        };
        found
    } else if planar_manoeuvring::is_for(raw) {
        refuse_truth("a manoeuvring vessel")?;
        progress("manoeuvres");
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
        progress("glide");
        let Some(found) = glider::run(log, vehicle) else {
            bail!(
                "{}: too little steady gliding: the model needs 60 stretches of 16 s below 3 m with constant ballast",
                log.path.display()
            );
        };
        found
    } else {
        progress("dead reckoning");
        let Some(found) = dead_reckoning::run(log, vehicle, use_dvl, truth) else {
            bail!(
                "{}: the log has neither fins and propeller speed (for the dynamic model) nor heading, speed and GNSS \
                 fixes under way, {} stretches between two fixes (for dead reckoning)",
                log.path.display(),
                dead_reckoning::FEWEST
            );
        };
        found
    })
}
