//! `cargo lab`: the laboratory, which makes docs/results.

use backseat_lab::Lab;
use clap::Parser as _;
use std::process::ExitCode;

fn main() -> ExitCode {
    match Lab::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
