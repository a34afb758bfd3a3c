//! What a log can be used for.

use backseat_diagnose::log_models::{
    dead_reckoning, glider, pinger, planar_manoeuvring, reference_velocity, thruster, transponders,
};
use backseat_identify::surge_yaw::SurgeYawData;
use backseat_logs::Log;
use backseat_logs::log::Column;
use backseat_logs::manoeuvring;

/// How a log is navigated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Navigation {
    /// By the vehicle's own dynamics.
    Dynamic,
    /// At constant velocity between measurements.
    Kinematic,
    /// By summing up heading and speed.
    DeadReckoning,
}

/// The five columns of propeller and fins.
pub const ACTUATORS: &[Column] = Column::ALL.split_at(Column::FinStarboard as usize + 1).0;

/// Whether propeller and all fins have samples.
pub fn has_actuators(log: &Log) -> bool {
    has_all(log, ACTUATORS)
}

/// Whether a log holds a vessel with propeller and rudder, and not a whole vehicle.
pub fn is_vessel(log: &Log) -> bool {
    manoeuvring::is_in(log) && !(has_actuators(log) && log.rows.iter().any(|row| row.attitude_rad().is_some()))
}

/// The best way to navigate a log; `None` if the filter may lack what it starts from.
pub fn navigation(log: &Log) -> Option<Navigation> {
    let has_attitude = log.rows.iter().any(|row| row.attitude_rad().is_some());
    let aiding = [Column::DvlU, Column::Range, Column::TwoWayRange, Column::UplinkRange];
    let has_aiding = aiding.into_iter().any(|column| log.has(column));
    if has_actuators(log) {
        Some(Navigation::Dynamic)
    } else if has_attitude && has_aiding {
        Some(Navigation::Kinematic)
    } else if log.has(Column::Heading) && log.has(Column::SpeedLog) {
        Some(Navigation::DeadReckoning)
    } else {
        None
    }
}

/// A command and what it does with a log, or what it lacks.
pub struct Use {
    /// Name of the command.
    pub command: &'static str,
    /// Whether it can use the log.
    pub possible: bool,
    /// What it does with the log, or what the log lacks.
    pub how: String,
}

/// What each command does with a log.
pub fn of(log: &Log) -> [Use; 3] {
    let entry = |command, found: Result<&str, String>| match found {
        Ok(how) => Use { command, possible: true, how: how.to_owned() },
        Err(lacks) => Use { command, possible: false, how: lacks },
    };
    [entry("navigate", navigate(log)), entry("identify", identify(log)), entry("diagnose", diagnose(log))]
}

fn navigate(log: &Log) -> Result<&'static str, String> {
    let start = lacking(log, &[Column::GpsX, Column::GpsY]);
    match navigation(log) {
        None if is_beside(log) && [Column::Tol, Column::Range, Column::UplinkRange].iter().any(|c| log.has(*c)) => {
            Ok("only beside a vehicle's log, with --modem")
        }
        _ if !start.is_empty() => Err(format!("lacks a fix to start from: {start}")),
        Some(Navigation::Dynamic) if !log.rows.iter().any(|row| row.attitude_rad().is_some()) => {
            Err("lacks an attitude: roll_rad, pitch_rad, heading_rad".to_owned())
        }
        Some(Navigation::Dynamic) => Ok("by the vehicle's dynamics (robust filter)"),
        Some(Navigation::Kinematic) => Ok("by the kinematic filter: no propeller and fins in the log"),
        Some(Navigation::DeadReckoning) => Ok("by dead reckoning on heading and speed: nothing else in the log"),
        None if manoeuvring::is_in(log) => Ok("by [manoeuvring] of a vehicle file, which identify writes"),
        None if is_beside(log) => Ok("only beside a vehicle's log, as its ship's, with --ship"),
        None => Err("lacks a velocity: dvl_u_mps, dvl_v_mps, dvl_w_mps with the attitude, or speed_log_mps".to_owned()),
    }
}

fn identify(log: &Log) -> Result<&'static str, String> {
    const WHOLE: &[Column] = &[
        Column::Roll,
        Column::Pitch,
        Column::Heading,
        Column::P,
        Column::Q,
        Column::R,
        Column::DvlU,
        Column::DvlV,
        Column::DvlW,
    ];
    let missing = lacking(log, &[ACTUATORS, WHOLE].concat());
    match missing.as_str() {
        "" => Ok("all parameters of the vehicle"),
        _ if SurgeYawData::is_in(log) && !log.has(Column::PropRpm) => Ok("surge and yaw, in servo counts"),
        _ if is_vessel(log) => Ok("surge, sway and yaw of a vessel with propeller and rudder"),
        _ => Err(format!("lacks {missing}")),
    }
}

fn diagnose(log: &Log) -> Result<&'static str, String> {
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
        Ok("against dead reckoning from fix to fix")
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

/// Whether a log may be one that others are joined with: it says nothing of how a vehicle moves.
fn is_beside(log: &Log) -> bool {
    ![Column::Depth, Column::DvlU, Column::SpeedLog].into_iter().any(|column| log.has(column))
}

fn has_all(log: &Log, columns: &[Column]) -> bool {
    columns.iter().all(|column| log.has(*column))
}

/// Names of the columns without samples.
fn lacking(log: &Log, columns: &[Column]) -> String {
    let names: Vec<&str> = columns.iter().filter(|column| !log.has(**column)).map(|column| column.name()).collect();
    names.join(", ")
}
