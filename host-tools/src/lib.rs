//! The command `backseat`, one module per subcommand: arguments, files and exit codes. What the commands compute is in
//! `backseat-analysis`.

mod bench;
mod board;
mod bridge;
mod check;
mod decode;
mod diagnose;
mod effect;
mod export;
mod foxglove;
mod hint;
mod identify;
mod info;
mod live;
mod log_input;
mod map;
mod mission;
mod monitor;
mod navigate;
mod outcome;
mod output;
mod params;
mod record;
mod replay;
mod screen;
mod sim;
mod topside;
mod update;
mod vehicle;

use anyhow::Context as _;
use backseat_logs::with_hint;
use backseat_report::console;
use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use outcome::Outcome;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The backseat of an Iver3-class AUV: simulated missions, recorded missions, and the board on the bench.
///
/// Without a command it flies the simulator's default mission, as `backseat sim run` does: ten 1 km lines without a
/// DVL, backseat and topside as processes of their own on virtual serial ports. Options are those of `backseat sim run`.
#[derive(Parser)]
#[command(name = "backseat", version, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "\
Examples:
  backseat                                            fly the default mission
  backseat sim run --minutes 20 --seed 7              its first twenty minutes, other noise
  backseat sim dataset --effect random --seed 1 --hours 1 --out set1
  backseat info log.csv                               is a log plausible, and what can be done with it?
  backseat diagnose set1/log.csv                      which effect does the declared model lack?
  backseat navigate log.csv --report out              navigation of a recorded mission, out/report.html";

#[derive(Subcommand)]
enum Command {
    #[command(subcommand)]
    Sim(sim::Simulation),
    Info(info::Args),
    Map(map::Args),
    #[command(subcommand)]
    Vehicle(vehicle::Vehicle),
    Navigate(navigate::Args),
    Diagnose(diagnose::Args),
    #[command(subcommand)]
    Effect(effect::Effect),
    Identify(identify::Args),
    Bench(bench::Args),
    Record(record::Args),
    Replay(replay::Args),
    Export(export::Args),
    Mission(mission::Args),
    Params(params::Args),
    Monitor(monitor::Args),
    Bridge(bridge::Args),
    Check(check::Args),
    Topside(topside::Args),
    Update(update::Args),
    /// Print the completion script of a shell
    #[command(
        after_help = "Example:\n  backseat completions bash > ~/.local/share/bash-completion/completions/backseat"
    )]
    Completions {
        /// Which shell
        shell: clap_complete::Shell,
    },
    /// Write manual pages, one a command
    #[command(after_help = "Example:\n  backseat man ~/.local/share/man/man1; man backseat-navigate")]
    Man {
        /// Where to; it is made
        folder: PathBuf,
    },
    /// The backseat app on five serial ports: what `sim run` starts as its other end
    #[command(name = "__backseat", hide = true)]
    Backseat {
        /// Frontseat, DVL, AHRS, modem and host port
        #[arg(num_args = 5, required = true)]
        ports: Vec<PathBuf>,
    },
    /// Topside with a host link: what `sim run` starts on the ship
    #[command(name = "__topside", hide = true)]
    SimulatedTopside(topside::Simulated),
}

/// The arguments; `sim run` goes in where no command is named.
fn arguments(given: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut arguments: Vec<OsString> = given.collect();
    let is_option = |argument: Option<&OsString>| match argument.map(|text| text.to_string_lossy()) {
        None => true,
        Some(text) => text.starts_with('-') && !["-h", "--help", "-V", "--version"].contains(&&*text),
    };
    if is_option(arguments.get(1)) {
        arguments.insert(1.min(arguments.len()), "sim".into());
    }
    if arguments.get(1).is_some_and(|command| command == "sim") && is_option(arguments.get(2)) {
        arguments.insert(2, "run".into());
    }
    arguments
}

/// Adds to the complaint about an unknown command those that are one letter away: clap overlooks them in short names.
fn with_tip(mut error: clap::Error, given: &[OsString]) -> clap::Error {
    let Some(ContextValue::String(wrong)) = error.get(ContextKind::InvalidSubcommand).cloned() else { return error };
    if error.get(ContextKind::SuggestedSubcommand).is_some() {
        return error;
    }
    let mut command = &Cli::command();
    for word in given.iter().skip(1) {
        command = command.find_subcommand(word).unwrap_or(command);
    }
    let names = command.get_subcommands().filter(|command| !command.is_hide_set()).map(|command| command.get_name());
    let near: Vec<String> =
        names.filter(|name| strsim::damerau_levenshtein(name, &wrong) == 1).map(str::to_owned).collect();
    if !near.is_empty() {
        error.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(near));
    }
    error
}

/// Paragraphs below the options lose their line breaks, for clap wraps them to the terminal; lists keep theirs.
fn with_flowing_help(command: clap::Command) -> clap::Command {
    let flowing = |text: String| {
        let mut lines: Vec<String> = Vec::new();
        for line in text.lines() {
            let is_prose = |line: &str| !line.is_empty() && !line.starts_with(' ') && !line.ends_with(':');
            match lines.last_mut().filter(|last| is_prose(last) && is_prose(line)) {
                Some(last) => *last += &format!(" {line}"),
                None => lines.push(line.to_owned()),
            }
        }
        lines.join("\n")
    };
    let help = command.get_after_help().map(|help| flowing(help.to_string()));
    let command = command.mut_subcommands(with_flowing_help);
    match help {
        Some(help) => command.after_help(help),
        None => command,
    }
}

/// Runs the command that these arguments name, the program's name first.
///
/// 0: done; 1: failed, with one line on stderr; 2: bad usage (clap); 3: done, but not to be trusted.
#[must_use]
pub fn command_line(given: impl Iterator<Item = OsString>) -> ExitCode {
    let given = arguments(given);
    let matches = with_flowing_help(Cli::command()).try_get_matches_from(&given);
    let cli = matches
        .and_then(|matches| Cli::from_arg_matches(&matches))
        .unwrap_or_else(|error| with_tip(error, &given).exit());
    let result = match cli.command {
        Command::Sim(simulation) => simulation.run(),
        Command::Info(args) => info::run(&args),
        Command::Map(args) => map::run(&args),
        Command::Vehicle(vehicle) => vehicle.run(),
        Command::Backseat { ports } => sim::backseat(&ports).map(Outcome::from),
        Command::SimulatedTopside(args) => topside::run_simulated(&args).map(Outcome::from),
        Command::Navigate(args) => navigate::run(&args),
        Command::Diagnose(args) => diagnose::run(&args),
        Command::Effect(effect) => effect.run().map(Outcome::from),
        Command::Identify(args) => identify::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Record(args) => record::run(&args).map(Outcome::from),
        Command::Replay(args) => replay::run(&args).map(Outcome::from),
        Command::Export(args) => export::run(&args).map(Outcome::from),
        Command::Mission(args) => mission::run(&args).map(Outcome::from),
        Command::Params(args) => params::run(&args).map(Outcome::from),
        Command::Monitor(args) => monitor::run(&args).map(Outcome::from),
        Command::Bridge(args) => bridge::run(&args).map(Outcome::from),
        Command::Topside(args) => topside::run(&args).map(Outcome::from),
        Command::Update(args) => update::run(&args).map(Outcome::from),
        Command::Check(args) => check::run(&args).map(Outcome::from),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "backseat", &mut script);
            console::print(&script).map(Outcome::from)
        }
        Command::Man { folder } => manual(&folder).map(Outcome::from),
    };
    match result {
        Ok(outcome) => outcome.exit_code(),
        Err(error) => {
            console::say(&with_hint(format!("error: {error:#}"), &hint::HINTS));
            ExitCode::FAILURE
        }
    }
}

fn manual(folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    clap_mangen::generate_to(Cli::command(), folder).with_context(|| folder.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    /// Under "Examples:" of every command's help.
    fn examples(command: &clap::Command) -> Vec<String> {
        let help =
            command.get_after_help().or(command.get_after_long_help()).map(ToString::to_string).unwrap_or_default();
        let own = help.lines().filter_map(|line| line.strip_prefix("  ")).filter(|line| line.starts_with("backseat"));
        own.map(ToOwned::to_owned).chain(command.get_subcommands().flat_map(examples)).collect()
    }

    #[test]
    fn every_example_of_the_help_is_understood() {
        let examples = examples(&Cli::command());
        assert!(examples.len() > 60, "{}", examples.len());
        // What the shell fills in is not known here.
        for example in examples.iter().filter(|example| !example.contains("$(")) {
            // What follows two spaces says what it is for.
            let line = example.split("  ").next().unwrap_or_default();
            let line = line.split([';', '|', '>', '#']).next().unwrap_or_default();
            let given = line.split_whitespace().map(|word| OsString::from(word.trim_matches('\'')));
            let parsed = Cli::try_parse_from(arguments(given));
            assert!(parsed.is_ok(), "{example}\n{}", parsed.err().map(|error| error.to_string()).unwrap_or_default());
        }
    }

    #[test]
    fn without_a_command_the_default_mission_is_flown() {
        let full = |given: &str| {
            let words = given.split_whitespace().map(OsString::from);
            arguments(words).join(" ".as_ref()).into_string().unwrap()
        };
        for (given, expected) in [
            ("backseat", "backseat sim run"),
            ("backseat --minutes 1", "backseat sim run --minutes 1"),
            ("backseat sim", "backseat sim run"),
            ("backseat sim --seed 2", "backseat sim run --seed 2"),
            ("backseat sim dataset --seed 1", "backseat sim dataset --seed 1"),
            ("backseat --help", "backseat --help"),
            ("backseat sim --help", "backseat sim --help"),
            ("backseat navigate log.csv", "backseat navigate log.csv"),
        ] {
            assert_eq!(full(given), expected);
        }
    }
}
