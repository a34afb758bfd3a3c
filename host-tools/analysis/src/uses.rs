//! What a log can be used for.

pub use crate::columns::{ACTUATORS, has_actuators};
use crate::columns::{IN_LABORATORY, ONLY_BESIDE, is_beside, lacking};
use crate::diagnose::log_kinds;
use backseat_logs::Log;
use backseat_logs::log::Column;

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

/// The best way to navigate a log; `None` if the filter may lack what it starts from.
pub fn navigation(log: &Log) -> Option<Navigation> {
    let has_attitude = log.rows.iter().any(|row| row.attitude_rad().is_some());
    let aiding = [Column::DvlU, Column::Range, Column::TwoWayRange, Column::UplinkRange, Column::UsblRange];
    let has_aiding = aiding.into_iter().chain([Column::UsblNorth]).any(|column| log.has(column));
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

impl Use {
    /// The command that uses this log, of its own or of the laboratory; `options` as the log was read.
    pub fn command_line(&self, log: &str, options: &str) -> Option<String> {
        match self.how.strip_prefix(IN_LABORATORY) {
            Some(command) => Some(command.replace("LOG", log)),
            // beside a vehicle's log it is an option
            None if self.possible && !self.how.starts_with(ONLY_BESIDE) => {
                Some(format!("backseat {} {log}{options}", self.command))
            }
            None => None,
        }
    }
}

/// What each command does with a log.
pub fn of(log: &Log) -> [Use; 3] {
    let entry = |command, found: Result<&str, String>| match found {
        Ok(how) => Use { command, possible: true, how: how.to_owned() },
        Err(lacks) => Use { command, possible: false, how: lacks },
    };
    [entry("navigate", navigate(log)), entry("identify", identify(log)), entry("diagnose", log_kinds::use_of(log))]
}

fn navigate(log: &Log) -> Result<&'static str, String> {
    let is_seen = log.rows.iter().any(|row| row.usbl().is_some() && row.ship_at_launch_m().is_some());
    let start = if is_seen { String::new() } else { lacking(log, &[Column::GpsX, Column::GpsY]) };
    match navigation(log) {
        None if is_beside(log)
            && !log.has(Column::ShipGpsX)
            && [Column::Tol, Column::Range, Column::UplinkRange].iter().any(|c| log.has(*c)) =>
        {
            Ok("only beside a vehicle's log, with --modem")
        }
        _ if !start.is_empty() && log.runs.is_empty() => Err(format!("lacks a fix to start from: {start}")),
        Some(Navigation::Dynamic) if !log.rows.iter().any(|row| row.attitude_rad().is_some()) => {
            Err("lacks an attitude: roll_rad, pitch_rad, heading_rad".to_owned())
        }
        Some(Navigation::Dynamic) => Ok("by the vehicle's dynamics (robust filter)"),
        Some(Navigation::Kinematic) => Ok("by the kinematic filter: no propeller and fins in the log"),
        Some(Navigation::DeadReckoning) => Ok("by dead reckoning on heading and speed: too little for a filter"),
        None if is_beside(log) => Ok("only beside a vehicle's log, as its ship's, with --ship"),
        None => Err("lacks a velocity: dvl_u_mps, dvl_v_mps, dvl_w_mps with the attitude, or speed_log_mps".to_owned()),
    }
}

fn identify(log: &Log) -> Result<&'static str, String> {
    const WHOLE: &[Column] = Column::group(Column::Roll, Column::DvlW);
    let missing = lacking(log, &[ACTUATORS, WHOLE].concat());
    match missing.as_str() {
        "" => Ok("all parameters of the vehicle"),
        _ if log.has(Column::Rudder) => Err(format!("{IN_LABORATORY}cargo lab vessel identify LOG")),
        _ => Err(format!("lacks {missing}")),
    }
}
