//! The commands of these studies.

use super::{compensation, excitation_planning, faults, methods};
use anyhow::bail;
use backseat_data::console;
use backseat_identify::plan::Limits;

/// Arguments of the study of methods.
#[derive(clap::Args)]
#[command(after_help = "Example:
  backseat studies identification --runs 10")]
pub struct MethodArgs {
    /// Seeds of each method
    #[arg(long, value_name = "N", default_value_t = 10)]
    runs: u64,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

impl MethodArgs {
    /// Runs the ensemble and prints the table.
    ///
    /// # Errors
    /// An identification that fails.
    pub fn run(&self) -> anyhow::Result<()> {
        methods::run(self.runs, self.json)
    }
}

/// Arguments of the study of fault detection.
#[derive(clap::Args)]
#[command(after_help = "Example:
  backseat studies fault-detection --runs 200")]
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
    /// Print one JSON object, without the table of compensation
    #[arg(long)]
    json: bool,
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
        faults::run(self.runs, self.hours, self.seed, self.json)?;
        if self.json {
            return Ok(());
        }
        let table = compensation::markdown(self.runs.div_ceil(10).max(2), self.seed)?;
        console::print(format!("\n{table}").as_bytes())
    }
}

/// Length and limits of a planned mission.
#[derive(clap::Args)]
pub struct LimitArgs {
    /// Length of the planned mission, s
    #[arg(long, value_name = "S", default_value_t = 1800.0)]
    pub duration: f64,
    /// Shallowest and deepest of the planned mission, m
    #[arg(long, value_name = "MIN,MAX", value_delimiter = ',', default_value = "3,20")]
    pub depth: Vec<f64>,
    /// Slowest and fastest of the planned mission, m/s
    #[arg(long, value_name = "MIN,MAX", value_delimiter = ',', default_value = "0.7,1.5")]
    pub speed: Vec<f64>,
}

impl LimitArgs {
    /// As limits of a plan.
    ///
    /// # Errors
    /// If depth or speed is not two numbers.
    pub fn limits(&self) -> anyhow::Result<Limits> {
        let (&[shallow, deep], &[slow, fast]) = (&self.depth[..], &self.speed[..]) else {
            bail!("--depth and --speed take two numbers each, smallest and largest");
        };
        Ok(Limits { depth_m: [shallow, deep], speed_mps: [slow, fast], ..Limits::DEFAULT })
    }
}

/// Arguments of the study of planned missions.
#[derive(clap::Args)]
#[command(after_help = "Example:
  backseat studies plan --runs 10 --duration 1800")]
pub struct PlanArgs {
    /// Seeds of each mission
    #[arg(long, value_name = "N", default_value_t = 10)]
    runs: u64,
    #[command(flatten)]
    limits: LimitArgs,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

impl PlanArgs {
    /// Runs the ensemble and prints the table.
    ///
    /// # Errors
    /// A plan that is not found, or an identification that fails.
    pub fn run(&self) -> anyhow::Result<()> {
        excitation_planning::run(self.runs, &self.limits.limits()?, self.limits.duration, self.json)
    }
}
