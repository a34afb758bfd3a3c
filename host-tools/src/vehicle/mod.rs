//! `backseat vehicle`: vehicle files from a data sheet, and whether what they describe flies.

mod check;
mod new;

use crate::outcome::Outcome;

/// Make a vehicle file, and check that what it describes flies
#[derive(clap::Subcommand)]
pub enum Vehicle {
    Check(check::Args),
    New(new::Args),
}

impl Vehicle {
    pub fn run(&self) -> anyhow::Result<Outcome> {
        match self {
            Self::Check(args) => check::run(args),
            Self::New(args) => new::run(args).map(Outcome::from),
        }
    }
}
