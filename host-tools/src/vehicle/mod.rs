//! `backseat vehicle`: vehicle files from a data sheet, and whether what they describe flies.

mod check;
mod examination;
mod flight;
mod manoeuvres;
mod new;
mod report;
mod stability;

pub use examination::unflyable;

use crate::outcome::Outcome;
use backseat_logs::VehicleFile;

/// Make a vehicle file, and check that what it describes flies
#[derive(clap::Subcommand)]
pub enum Vehicle {
    Check(check::Args),
    New(new::Args),
}

/// What `vehicle check` says of a vehicle at this speed, as one JSON object.
///
/// # Errors
/// The backseat refuses the vehicle.
pub fn examination(file: &VehicleFile, speed_mps: f64) -> anyhow::Result<String> {
    Ok(report::json(file, &examination::examine(file, speed_mps)?))
}

impl Vehicle {
    pub fn run(&self) -> anyhow::Result<Outcome> {
        match self {
            Self::Check(args) => check::run(args),
            Self::New(args) => new::run(args).map(Outcome::from),
        }
    }
}
