//! `backseat mission`: the board's mission, over its host port.

pub(crate) mod file;

use crate::board::Common;
use anyhow::bail;
use backseat_link::board::Board;
use backseat_logs::output::{self, Existing};
use backseat_wire::hostlink::Waypoint;
use clap::Subcommand;
use file::StoredMission;
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

  [[mission.waypoints]]      # one for each leg, in order
  x_m = 120.0                # north
  y_m = 0.0                  # east
  depth_m = 3.0              # of the leg that ends here; 0 is surfaced
  speed_mps = 1.0

  [fence]                    # optional: neither mission nor vehicle leaves this polygon
  corners_m = [[-50.0, -50.0], [200.0, -50.0], [200.0, 80.0], [-50.0, 80.0]]    # [north, east], at most 32

The [mission] and [fence] of a simulator's scenario do as well, lawnmower included.";

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
            let StoredMission { waypoints, fence_m } = file::read(file)?;
            let mut board = common.connect()?;
            board.set_mission(&waypoints, &fence_m)?;
            let fence = fence_text(&fence_m);
            let text = format!("{} waypoints, {:.0} m{fence}\n", waypoints.len(), length_m(&waypoints));
            let (count, corners) = (waypoints.len(), fence_m.len());
            let json = json!({"waypoints": count, "length_m": length_m(&waypoints), "fence_corners": corners});
            common.say(&json, &text)
        }
        Action::Get { common, file, out, force } => {
            let existing = if *force { Existing::Replace } else { Existing::Keep };
            let path = file.as_ref().or(out.as_ref());
            path.map_or(Ok(()), |path| output::check(path, existing))?;
            let mut board = common.connect()?;
            let waypoints = board.mission()?;
            if waypoints.is_empty() {
                bail!("{}: no mission is stored on the board", common.port);
            }
            let fence_m = board.fence()?;
            let text = file::text_of(&waypoints, &fence_m);
            if let Some(path) = path {
                output::write(path, existing, |file| file.write_all(text.as_bytes()))?;
            }
            let fence = fence_text(&fence_m);
            let done =
                path.map_or(text, |path| format!("{} waypoints{fence} to {}\n", waypoints.len(), path.display()));
            let waypoints: Vec<_> = waypoints.iter().map(json_of).collect();
            common.say(&json!({"waypoints": waypoints, "fence_m": fence_m}), &done)
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
