//! `backseat sim`: fly missions in the simulator, and make data sets with it.

mod dataset;
mod run;
mod short_runs;

use crate::outcome::Outcome;
use anyhow::{Context, anyhow};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

/// Fly missions in the simulator, and make data sets with it
#[derive(clap::Subcommand)]
pub enum Simulation {
    /// Fly a scenario against a backseat and judge its navigation
    Run(run::Args),
    /// Make the log of a vehicle with undeclared effects; the truth goes to a folder of its own
    Dataset(dataset::Args),
    /// Make short runs of a torpedo as a laboratory's control computer logs them
    ShortRuns(short_runs::Args),
}

impl Simulation {
    pub fn run(&self) -> anyhow::Result<Outcome> {
        match self {
            Self::Run(arguments) => run::run(arguments),
            Self::Dataset(arguments) => dataset::run(arguments).map(Outcome::from),
            Self::ShortRuns(arguments) => short_runs::run(arguments).map(Outcome::from),
        }
    }
}

/// Runs the app on these ports until it is ended: what `sim run` starts as its other end.
pub fn backseat(ports: &[PathBuf]) -> anyhow::Result<()> {
    let ports: [PathBuf; 5] = ports.to_vec().try_into().map_err(|_| anyhow!("five ports are needed"))?;
    backseat_host::run(&backseat_host::HostPorts::new(ports), &AtomicBool::new(false)).context("backseat")
}
