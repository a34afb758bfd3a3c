//! The commands, one file each.

pub mod adoption;
pub mod consistency;
pub mod dataset;
pub mod faults;
pub mod packets;
pub mod run;
pub mod study;

use crate::scenario::Scenario;
use anyhow::{Context, anyhow};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

/// Prints the speed of the truth model.
///
/// # Errors
/// If the built-in scenario cannot be read.
pub fn bench_truth() -> anyhow::Result<()> {
    let parameters = Scenario::built_in("survey")?.truth_parameters();
    println!("{:.0} RK4 steps/s", crate::truth::benchmark(&parameters));
    Ok(())
}

/// Runs the app on these ports until it is ended.
///
/// # Errors
/// A port that cannot be opened or vanished.
pub fn backseat(ports: &[PathBuf]) -> anyhow::Result<()> {
    let ports: [PathBuf; 5] = ports.to_vec().try_into().map_err(|_| anyhow!("five ports are needed"))?;
    backseat_host::run(&backseat_host::HostPorts::new(ports), &AtomicBool::new(false)).context("backseat")
}
