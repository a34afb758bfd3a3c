//! The programs behind `docs/results`: ensembles of seeded simulations, and the thesis' tables and figures beside ours.
//!
//! The laboratory: every study is one command of `cargo lab`. Nobody who only uses the tools builds it.

pub mod adaptive_control;
mod closed_loop;
pub mod consistency;
mod diagnosis_accuracy;
mod ensemble;
mod flights;
pub mod geometry;
pub mod identification;
mod intervals;
pub mod navigation;
pub mod packet_navigation;
pub mod reproduce;
mod sampled_lqr;
mod store;

use std::path::PathBuf;

/// Which flights an ensemble has, and where its table goes.
#[derive(clap::Args, Clone, Debug)]
pub struct EnsembleArgs {
    /// Seeded missions of each row
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,
    /// Seed of the first; the others follow
    #[arg(long, value_name = "N", default_value_t = 1)]
    first_seed: u64,
    /// End each mission after this simulated time
    #[arg(long)]
    minutes: Option<f64>,
    /// Write the table to this file as well (Markdown)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// A study, with its options.
#[derive(clap::Subcommand)]
pub enum Study {
    /// Reproduce the thesis' tables and figures
    Reproduce(reproduce::Args),
    /// Error of every filter where vehicle, sensors and water are not as declared, over an ensemble of seeded missions
    #[command(after_help = "Examples:
  cargo lab navigation --runs 4 --cases exact,10%,Y
  cargo lab navigation --runs 20 --store runs.jsonl --out docs/results/navigation.md")]
    Navigation(navigation::Args),
    /// Gains and feed-forward that follow the filter's parameters, against fixed ones
    #[command(after_help = "Example:
  cargo lab adaptive-control --runs 5 --out docs/results/adaptive_control.md")]
    AdaptiveControl(EnsembleArgs),
    /// Where the ship is, against the error of the position and its observability
    #[command(after_help = "Example:
  cargo lab geometry --runs 5 --out docs/results/geometry.md")]
    Geometry(EnsembleArgs),
    /// What it costs to know the ship from its packets alone: packet-fed and centralized filter on one flight
    PacketNavigation(packet_navigation::Args),
    /// Is the filter's covariance right: normalised errors and innovations, and the Cramér-Rao bound, over an ensemble
    Consistency(consistency::Args),
    /// How often `diagnose` finds the right cause: verdicts over simulated logs of undeclared effects
    DiagnosisAccuracy(diagnosis_accuracy::Args),
    /// Errors of every identification method over an ensemble of simulated experiments
    Identification(identification::MethodArgs),
    /// How soon the fault monitor detects a fault under way, and what compensation gains
    FaultDetection(identification::FaultArgs),
    /// A planned identification mission against a lawnmower and open-loop inputs
    Plan(identification::PlanArgs),
}

impl Study {
    /// Runs it, prints its tables and writes the files asked for.
    ///
    /// # Errors
    /// A flight or a filter that fails; a file that cannot be written.
    pub fn run(&self) -> anyhow::Result<()> {
        match self {
            Self::Reproduce(arguments) => reproduce::run(arguments),
            Self::Navigation(arguments) => navigation::run(arguments),
            Self::AdaptiveControl(arguments) => adaptive_control::run(arguments),
            Self::Geometry(arguments) => geometry::run(arguments),
            Self::PacketNavigation(arguments) => packet_navigation::run(arguments),
            Self::Consistency(arguments) => consistency::run_command(arguments),
            Self::DiagnosisAccuracy(arguments) => diagnosis_accuracy::run(arguments),
            Self::Identification(arguments) => arguments.run(),
            Self::FaultDetection(arguments) => arguments.run(),
            Self::Plan(arguments) => arguments.run(),
        }
    }
}
