//! `cargo lab`: the laboratory, which makes docs/results.

use backseat_lab::Lab;
use backseat_logs::with_hint;
use clap::Parser as _;
use std::process::ExitCode;

fn main() -> ExitCode {
    match Lab::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{}", with_hint(format!("error: {error:#}"), &[("exists already", "--force replaces it")]));
            ExitCode::FAILURE
        }
    }
}
