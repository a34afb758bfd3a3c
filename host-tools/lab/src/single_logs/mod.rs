//! `cargo lab single-log`: models of logs of which we know one set each, diagnosed as `backseat diagnose` does its own.
//!
//! | module | log |
//! |---|---|
//! | `glider` | a Slocum glider: ballast, pitch, depth, density |
//! | `pinger` | arrivals of a pinger with a clock of its own |
//! | `thruster` | a surface vehicle with two thrusters |
//! | `transponders` | two-way travel times to transponders on the sea floor |
//! | `vessel` | a ship's model with propeller and rudder, in wind |

mod glider;
mod pinger;
mod thruster;
mod transponders;
mod vessel;

use backseat_analysis::diagnose::log_kinds::Kind;
use backseat_analysis::diagnose::{Files, compute_with, report};
use backseat_analysis::read_log::ReadLog;
use backseat_analysis::refusal;
use backseat_logs::VehicleFile;
use backseat_logs::output::{Existing, write};
use backseat_report::console;
use std::path::PathBuf;

const KINDS: [Kind; 5] = [
    Kind {
        is_for: pinger::is_for,
        how: "pseudo-ranges of a pinger with its own clock",
        what: "a pinger's log",
        needs: "30 pings with a GNSS position (gps_x_m, gps_y_m) and the pinger's place (ship_x_m, ship_y_m)",
        is_of_sensors: false,
        run: pinger::run,
    },
    Kind {
        is_for: transponders::is_for,
        how: "two-way ranges to transponders, whose places are joined by --with",
        what: "travel times to transponders",
        needs: "200 two-way travel times (two_way_time_s) with the antenna's place and the attitude at both ends, and \
                the places of the transponders (station_x_m, station_y_m, station_z_m): join their table by --with",
        is_of_sensors: true,
        run: transponders::run,
    },
    Kind {
        is_for: thruster::is_for,
        how: "the thrust of two thrusters",
        what: "a log of thrusters",
        needs: "four stretches of 5 s on which both thrusters have the same command above 0.05",
        is_of_sensors: true,
        run: thruster::run,
    },
    Kind {
        is_for: vessel::is_for,
        how: "against a manoeuvring model of hull, propeller and rudder",
        what: "a manoeuvring vessel",
        needs: "30 windows under way, each half the time that the vessel takes for its own length, and at most 24 runs \
                of 8 windows or more",
        is_of_sensors: true,
        run: vessel::run,
    },
    Kind {
        is_for: glider::is_for,
        how: "against a steady glide",
        what: "a glider's log",
        needs: "more steady gliding: 60 stretches of 16 s below 3 m with constant ballast",
        is_of_sensors: false,
        run: glider::run,
    },
];

/// Command line.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Examples:
  cargo lab single-log glider_flight.csv --with glider_ctd.csv
  cargo lab single-log ranges.csv --with transponders.csv --report ranges.html")]
pub struct Args {
    /// Log of a glider, of a pinger, of travel times to transponders, of a pair of thrusters, of a ship
    log: PathBuf,
    /// A second log of the same time base, joined to the first; may be repeated
    #[arg(long, value_name = "LOG2")]
    with: Vec<PathBuf>,
    /// Column mapping for a table of another maker
    #[arg(long = "columns", value_name = "MAP.toml")]
    map: Option<PathBuf>,
    /// Vehicle file, TOML [default: the built-in reference vehicle]
    #[arg(long, value_name = "V.toml")]
    vehicle: Option<PathBuf>,
    /// Write a page; never over an earlier one
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Go on with a log that contradicts physics
    #[arg(long)]
    force: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Diagnoses a log and prints the report.
///
/// # Errors
/// A log that cannot be read, contradicts physics or fits no model; a page that cannot be written.
pub fn run(arguments: &Args) -> anyhow::Result<()> {
    let vehicle = arguments.vehicle.as_ref().map(|path| VehicleFile::read(path)).transpose()?;
    let mut read = ReadLog::of(&arguments.log, arguments.map.as_deref())?;
    for path in &arguments.with {
        read.log.join(ReadLog::of(path, None)?.log);
    }
    if let Some(refused) = refusal::of(&read, "single-log").filter(|_| !arguments.force) {
        return console::print(refused.to_text().as_bytes());
    }
    let result = compute_with(&KINDS, &read, vehicle.as_ref(), None, false)?;
    let report = report(&result, &Files::default()).file("report", arguments.report.as_deref());
    if let Some(path) = &arguments.report {
        write(path, Existing::Keep, |file| file.write_all(report.html().as_bytes()))?;
    }
    console::print(if arguments.json { report.to_json() } else { report.to_text() }.as_bytes())
}
