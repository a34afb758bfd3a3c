//! `backseat mission`: the board's mission, over its host port.

use crate::board::Common;
use anyhow::bail;
use backseat_analysis::mission_file::{self, StoredMission};
use backseat_analysis::reach;
use backseat_link::board::{Board, Declared};
use backseat_logs::output::{self, Existing};
use backseat_wire::hostlink::Waypoint;
use clap::Subcommand;
use hil_sim::scenario::Separate;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::Duration;

const EXAMPLES: &str = "\
Examples:
  backseat mission put /dev/ttyACM0 survey.toml
  backseat mission get /dev/ttyACM0 > mission.toml
  backseat mission start /dev/ttyACM0
  backseat mission stop /dev/ttyACM0

PORT is the board's host port, with :BAUD behind it where that is not 115200. A mission file:

  separate = \"on legs\"       # optional, above all tables: \"never\", \"on legs\" or \"free\" for manoeuvres that tell causes apart
  log_required = false       # optional, there too: without the board's own log `check` says NO GO, unless it is false

  [[mission.waypoints]]      # one for each leg, in order
  x_m = 120.0                # north
  y_m = 0.0                  # east
  depth_m = 3.0              # of the leg that ends here; 0 is surfaced
  speed_mps = 1.0

  [fence]                    # optional: neither mission nor vehicle leaves this polygon
  corners_m = [[-50.0, -50.0], [200.0, -50.0], [200.0, 80.0], [-50.0, 80.0]]    # [north, east], at most 32

  [alert]                    # optional: a protection level beyond these is degraded navigation; 0: none
  horizontal_m = 60.0
  depth_m = 25.0

The [mission], [fence], [alert], separate and log_required of a simulator's scenario do as well, lawnmower included.";

/// A step takes 0.1 s; a few of them.
const MOMENT: Duration = Duration::from_millis(400);

/// Put, get, start or stop the board's mission
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Replace the board's mission by the one in a file, all of it or nothing
    #[command(after_help = "Example:\n  backseat mission put /dev/ttyACM0 survey.toml")]
    Put {
        #[command(flatten)]
        common: Common,
        /// Mission file or scenario, TOML
        #[arg(value_name = "MISSION.toml")]
        file: PathBuf,
    },
    /// Print the board's mission as a mission file, or write it
    #[command(after_help = "Example:\n  backseat mission get /dev/ttyACM0 -o mission.toml")]
    Get {
        #[command(flatten)]
        common: Common,
        /// Write it there instead of printing it
        #[arg(value_name = "MISSION.toml", conflicts_with = "out")]
        file: Option<PathBuf>,
        /// As the argument above
        #[arg(short, long, value_name = "MISSION.toml")]
        out: Option<PathBuf>,
        /// Replace a file that exists
        #[arg(long)]
        force: bool,
    },
    /// Start the stored mission as soon as navigation is valid
    #[command(after_help = "Example:\n  backseat mission start /dev/ttyACM0")]
    Start(Common),
    /// Stop: neutral fins, propeller off, frontseat in charge
    #[command(after_help = "Example:\n  backseat mission stop /dev/ttyACM0")]
    Stop(Common),
}

/// Does what is asked.
pub fn run(args: &Args) -> anyhow::Result<()> {
    match &args.action {
        Action::Put { common, file } => {
            let stored = mission_file::read(file)?;
            let warnings = put(&mut common.connect()?, &stored)?;
            let StoredMission { waypoints, fence_m, alerts_m, .. } = stored;
            let (fence, alert) = (fence_text(&fence_m), alert_text(alerts_m));
            let mut text = format!("{} waypoints, {:.0} m{fence}{alert}\n", waypoints.len(), length_m(&waypoints));
            text.extend(warnings.iter().map(|warning| format!("warning: {warning}\n")));
            let (count, corners) = (waypoints.len(), fence_m.len());
            let json = json!({"waypoints": count, "length_m": length_m(&waypoints), "fence_corners": corners,
                "alert_m": alerts_m, "warnings": warnings});
            common.say(&json, &text)
        }
        Action::Get { common, file, out, force } => {
            let existing = if *force { Existing::Replace } else { Existing::Keep };
            let path = file.as_ref().or(out.as_ref());
            path.map_or(Ok(()), |path| output::check(path, existing))?;
            let mut board = common.connect()?;
            let waypoints: Vec<Waypoint> = board.mission()?;
            if waypoints.is_empty() {
                bail!("{}: no mission is stored on the board", common.port);
            }
            let fence_m = board.fence()?;
            let parameters = board.parameters()?;
            let alerts_m = alerts_of(&parameters).filter(|alerts_m| *alerts_m != [0.0; 2]);
            let separate = value(&parameters, SEPARATE);
            let separate =
                Separate::ALL.map(|(own, _)| own).into_iter().skip(1).find(|own| Some(own.parameter()) == separate);
            // one that is required is the default
            let log_required = (value(&parameters, LOG_REQUIRED) == Some(0.0)).then_some(false);
            let stored = StoredMission { waypoints, fence_m, alerts_m, separate, log_required };
            let text = mission_file::text_of(&stored);
            let StoredMission { waypoints, fence_m, .. } = stored;
            if let Some(path) = path {
                output::write(path, existing, |file| file.write_all(text.as_bytes()))?;
            }
            let fence = fence_text(&fence_m);
            let done =
                path.map_or(text, |path| format!("{} waypoints{fence} to {}\n", waypoints.len(), path.display()));
            let waypoints: Vec<_> = waypoints.iter().map(json_of).collect();
            common.say(&json!({"waypoints": waypoints, "fence_m": fence_m, "alert_m": alerts_m}), &done)
        }
        Action::Start(common) => {
            let mut board = common.connect()?;
            board.start_mission()?;
            state(common, &mut board, "armed: the mission begins when navigation is valid")
        }
        Action::Stop(common) => {
            let mut board = common.connect()?;
            board.stop_mission()?;
            state(common, &mut board, "stopped: neutral fins, propeller off, frontseat in charge")
        }
    }
}

/// Replaces the board's mission and, if there are others with it, alert limits and manoeuvres; what is to be said of them.
pub fn put(board: &mut Board, stored: &StoredMission) -> anyhow::Result<Vec<String>> {
    let warnings = stored.alerts_m.map_or(Ok(Vec::new()), |alerts_m| set_alerts(board, alerts_m))?;
    let separate = stored.separate.map(|separate| (SEPARATE.to_owned(), separate.parameter()));
    let log_required = stored.log_required.map(|required| (LOG_REQUIRED.to_owned(), f64::from(u8::from(required))));
    let mut wanted: Vec<_> = separate.into_iter().chain(log_required).collect();
    if !wanted.is_empty() {
        let parameters = board.parameters()?;
        wanted.retain(|(name, wanted)| value(&parameters, name) != Some(*wanted));
        if !wanted.is_empty() {
            board.set_parameters(&wanted, &parameters, false)?;
        }
    }
    board.set_mission(&stored.waypoints, &stored.fence_m)?;
    Ok(warnings)
}

const SEPARATE: &str = "app.separate";
const LOG_REQUIRED: &str = "app.log_required";

fn value(parameters: &[Declared], name: &str) -> Option<f64> {
    parameters.iter().find(|parameter| parameter.name == name).map(|found| found.value)
}

const ALERTS: [&str; 2] = ["app.alert_horizontal_m", "app.alert_depth_m"];

/// The alert limits of a board that has them.
fn alerts_of(parameters: &[Declared]) -> Option<[f64; 2]> {
    let [horizontal, depth] = ALERTS.map(|name| value(parameters, name));
    Some([horizontal?, depth?])
}

/// Sets the board's alert limits, if they are others; what is to be said of them.
fn set_alerts(board: &mut Board, alerts_m: [f64; 2]) -> anyhow::Result<Vec<String>> {
    let parameters = board.parameters()?;
    if alerts_of(&parameters) != Some(alerts_m) {
        let values: Vec<(String, f64)> = ALERTS.map(str::to_owned).into_iter().zip(alerts_m).collect();
        board.set_parameters(&values, &parameters, false)?;
    }
    let values = parameters.iter().map(|parameter| (parameter.name.as_str(), parameter.value));
    Ok(reach::unreachable(&reach::FlightSetup { alerts_m, ..reach::FlightSetup::by(values) }))
}

fn alert_text(alerts_m: Option<[f64; 2]>) -> String {
    let names = ["horizontal", "depth"];
    let limits = alerts_m.into_iter().flatten().zip(names).filter(|(alert_m, _)| *alert_m > 0.0);
    limits.map(|(alert_m, name)| format!(", {name} alert at {alert_m} m")).collect()
}

fn fence_text(corners_m: &[[f64; 2]]) -> String {
    if corners_m.is_empty() { String::new() } else { format!(", a fence of {} corners", corners_m.len()) }
}

/// Prints the board's mode a moment after the request.
fn state(common: &Common, board: &mut Board, idle: &str) -> anyhow::Result<()> {
    let last = board.listen(MOMENT)?.pop();
    let leg = last.as_ref().and_then(|record| record.leg);
    let mode = last.as_ref().map(|record| format!("{:?}", record.mode));
    let reason = last.as_ref().map(|record| format!("{:?}", record.reason));
    let what = leg.map_or_else(|| idle.to_owned(), |leg| format!("under way on leg {}", leg + 1));
    let stands = match (&mode, &reason) {
        (Some(mode), Some(reason)) => format!(" ({mode}, {reason})"),
        _ => String::new(),
    };
    common.say(&json!({"mode": mode, "reason": reason, "leg": leg}), &format!("{what}{stands}\n"))
}

fn json_of(waypoint: &Waypoint) -> Value {
    let Waypoint { x_m, y_m, depth_m, speed_mps } = waypoint;
    json!({"x_m": x_m, "y_m": y_m, "depth_m": depth_m, "speed_mps": speed_mps})
}

/// From the first waypoint to the last.
fn length_m(waypoints: &[Waypoint]) -> f64 {
    waypoints.windows(2).map(|leg| (leg[1].x_m - leg[0].x_m).hypot(leg[1].y_m - leg[0].y_m)).sum()
}
