//! `cargo lab`: the laboratory, which makes docs/results.

use backseat_lab::Study;
use clap::Parser;
use std::process::ExitCode;

/// The laboratory: ensembles of seeded simulations, and the thesis reproduced. What makes docs/results.
///
/// Nobody who only uses the tools builds it: the tools are in `backseat`.
#[derive(Parser)]
#[command(name = "lab", bin_name = "cargo lab", version)]
struct Cli {
    #[command(subcommand)]
    study: Study,
}

fn main() -> ExitCode {
    match Cli::parse().study.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
