//! `hil-sim`: flies missions against a backseat; without arguments, the default mission.

use clap::{Parser, Subcommand};
use hil_sim::commands;
use std::path::PathBuf;
use std::process::ExitCode;

/// Host-in-the-loop simulator of an Iver3-class AUV, its ship, sensors and acoustic modem.
///
/// Without arguments it flies the default mission: ten 1 km lines without a DVL, the backseat as a
/// process of its own on five virtual serial ports.
#[derive(Parser)]
#[command(version, after_help = EXAMPLES)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
}

const EXAMPLES: &str = "Examples:
  hil-sim                                    fly the default mission
  hil-sim run --minutes 20 --seed 7          its first twenty minutes, other noise
  hil-sim run my_scenario.toml --out flight  a scenario of your own
  hil-sim run --realtime --minutes 5         at the speed of the clock
  hil-sim dataset --effect random --seed 1 --hours 1 --out set1   a log whose effect nobody declares";

#[derive(Subcommand)]
enum Command {
    /// Fly a scenario against a backseat and judge its navigation.
    Run(commands::run::Arguments),
    /// Make a measured log of a vehicle that does more than was declared; the truth goes to a folder of its own.
    Dataset(commands::dataset::Arguments),
    /// The navigation table over an ensemble of seeded missions.
    Study(commands::study::Arguments),
    /// Packet-fed, centralized and information filter on one flight.
    Packets(commands::packets::Arguments),
    /// Does the filter know how wrong it is: normalised errors and innovations, and the bound, over an ensemble.
    Consistency(commands::consistency::Arguments),
    /// Fly every fault there is and judge what the backseat makes of it.
    Faults(commands::faults::Arguments),
    /// Measure how many RK4 steps of the true vehicle this machine takes in a second.
    BenchTruth,
    /// The backseat app on five serial ports (what `run` starts as its other end).
    #[command(name = "__backseat", hide = true)]
    Backseat {
        /// Frontseat, DVL, AHRS, modem and host port.
        #[arg(num_args = 5, required = true)]
        ports: Vec<PathBuf>,
    },
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let outcome = match arguments.command {
        None => commands::run::run(&commands::run::Arguments::default()),
        Some(Command::Run(arguments)) => commands::run::run(&arguments),
        Some(Command::Dataset(arguments)) => commands::dataset::run(&arguments),
        Some(Command::Study(arguments)) => commands::study::run(&arguments),
        Some(Command::Packets(arguments)) => commands::packets::run(&arguments),
        Some(Command::Consistency(arguments)) => commands::consistency::run(&arguments),
        Some(Command::Faults(arguments)) => commands::faults::run(&arguments),
        Some(Command::BenchTruth) => commands::bench_truth(),
        Some(Command::Backseat { ports }) => commands::backseat(&ports),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
