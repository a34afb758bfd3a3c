//! `backseat`: the lab's one command-line tool, one module per subcommand.

mod board;
mod check;
mod columns;
mod console;
mod diagnose;
mod export;
mod identify;
mod mission;
mod monitor;
mod navigate;
mod params;
mod record;
mod replay;
mod reproduce;
mod study;

use clap::{CommandFactory, Parser, Subcommand};
use std::process::ExitCode;

/// Tools for the backseat of an Iver3-class AUV: recorded missions, and the board on the bench.
#[derive(Parser)]
#[command(name = "backseat", version, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Navigate(navigate::Args),
    Diagnose(diagnose::Args),
    Identify(identify::Args),
    Record(record::Args),
    Replay(replay::Args),
    Export(export::Args),
    Reproduce(reproduce::Args),
    Study(study::Args),
    Mission(mission::Args),
    Params(params::Args),
    Monitor(monitor::Args),
    Check(check::Args),
    /// Print the completion script of a shell
    #[command(
        after_help = "Example:\n  backseat completions bash > ~/.local/share/bash-completion/completions/backseat"
    )]
    Completions {
        /// Which shell
        shell: clap_complete::Shell,
    },
}

/// 0: done; 1: failed, with one line on stderr; 2: bad usage (clap).
fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Navigate(args) => navigate::run(&args),
        Command::Diagnose(args) => diagnose::run(&args),
        Command::Identify(args) => identify::run(&args),
        Command::Record(args) => record::run(&args),
        Command::Replay(args) => replay::run(&args),
        Command::Export(args) => export::run(&args),
        Command::Reproduce(args) => reproduce::run(&args),
        Command::Study(args) => study::run(&args),
        Command::Mission(args) => mission::run(&args),
        Command::Params(args) => params::run(&args),
        Command::Monitor(args) => monitor::run(&args),
        Command::Check(args) => check::run(&args),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "backseat", &mut script);
            console::print(&script)
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
