//! The commands of these studies.

use super::{excitation_planning, faults, methods};
use crate::ensemble::PartArgs;
use backseat_identify::plan::Limits;

/// Arguments of the study of methods.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Example:
  cargo lab identification --runs 10")]
pub struct MethodArgs {
    /// Seeds of each method
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,
    #[command(flatten)]
    part: PartArgs,
}

impl MethodArgs {
    /// Runs the ensemble and prints the table.
    ///
    /// # Errors
    /// An identification that fails.
    pub fn run(&self) -> anyhow::Result<()> {
        methods::run(self.runs, &self.part)
    }
}

/// Arguments of the study of fault detection.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Example:
  cargo lab fault-detection --runs 200")]
pub struct FaultArgs {
    /// Flights with each fault
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(2..))]
    runs: u64,
    /// Hours of flights without a fault
    #[arg(long, value_name = "H", default_value_t = 204.0, value_parser = positive)]
    hours: f64,
    /// First seed
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    part: PartArgs,
}

fn positive(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|number: &f64| *number > 0.0 && number.is_finite()).ok_or("a positive number".to_owned())
}

impl FaultArgs {
    /// Runs the flights and prints the tables.
    ///
    /// # Errors
    /// A flight or an identification that fails.
    pub fn run(&self) -> anyhow::Result<()> {
        faults::run(self.runs, self.hours, self.seed, &self.part)
    }
}

/// Arguments of the study of planned missions.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Example:
  cargo lab plan --runs 10 --duration 1800")]
pub struct PlanArgs {
    /// Seeds of each mission
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,
    /// Length of each mission, s
    #[arg(long, value_name = "S", default_value_t = 1800.0)]
    duration: f64,
    #[command(flatten)]
    part: PartArgs,
}

impl PlanArgs {
    /// Runs the ensemble and prints the table.
    ///
    /// # Errors
    /// A plan that is not found, or an identification that fails.
    pub fn run(&self) -> anyhow::Result<()> {
        excitation_planning::run(self.runs, &Limits::DEFAULT, self.duration, &self.part)
    }
}
