//! The programs behind `docs/results`: ensembles of seeded simulations, and the thesis' tables and figures beside ours.
//!
//! The laboratory: every study is one command of `cargo lab`. Nobody who only uses the tools builds it.

mod alone;
mod closed_loop;
pub mod consistency;
mod diagnosis_accuracy;
mod draw;
mod ensemble;
pub mod experiment;
pub mod fault_table;
mod flights;
pub mod geometry;
pub mod identification;
mod injections;
mod intervals;
mod judge;
mod naming;
pub mod navigation;
mod partial;
pub mod reproduce;
mod results;
mod sampled_lqr;
mod servo_counts;
mod single_logs;
mod store;
mod team;
mod twins;
pub mod vessel;
mod wrap;
mod wrong_recordings;

use backseat_report::console;
use std::path::PathBuf;

/// Stores to be joined.
#[derive(clap::Args, Clone, Debug)]
pub struct MergeArgs {
    /// Stores of one command with the same options, made by the same program
    #[arg(value_name = "STORE", required = true)]
    stores: Vec<PathBuf>,
    /// The store to write; it must not exist
    #[arg(short, long, value_name = "STORE")]
    out: PathBuf,
}

impl MergeArgs {
    fn run(&self) -> anyhow::Result<()> {
        let runs = store::merge(&self.stores, &self.out)?;
        console::print(format!("{runs} runs in {}\n", self.out.display()).as_bytes())
    }
}

/// The laboratory: ensembles of seeded simulations, and the thesis reproduced. What makes docs/results.
///
/// Nobody who only uses the tools builds it: the tools are in `backseat`.
#[derive(clap::Parser)]
#[command(name = "lab", bin_name = "cargo lab", version)]
pub struct Lab {
    #[command(subcommand)]
    command: LabCommand,
}

/// A study, with its options.
#[derive(clap::Subcommand)]
enum LabCommand {
    /// Reproduce the thesis' tables and figures
    Reproduce(reproduce::Args),
    /// Error of every filter where vehicle, sensors and water are not as declared, over an ensemble of seeded missions
    #[command(after_help = "Examples:
  cargo lab navigation --runs 4 --cases exact,10%,Y
  cargo lab navigation --runs 20 --store runs.jsonl --out docs/results/navigation.md")]
    Navigation(navigation::Args),
    /// Five hours without ship, DVL or fixes, after twenty minutes of ranges
    #[command(after_help = "Example:
  cargo lab alone --runs 20 --store runs.jsonl --out docs/results/five_hours_alone.md")]
    Alone(alone::Args),
    /// Four vehicles that hear each other, and a ship that leaves after twenty minutes
    #[command(after_help = "Example:
  cargo lab team --runs 20 --first-seed 700001 --store runs.jsonl --out docs/results/team.md")]
    Team(team::Args),
    /// Where the ship is, against the error of the position and its observability
    #[command(after_help = "Example:
  cargo lab geometry --runs 5 --out docs/results/geometry.md")]
    Geometry(geometry::Args),
    /// Is the filter's covariance right: normalised errors and innovations, and the Cramér-Rao bound, over an ensemble
    Consistency(consistency::Args),
    /// How often `diagnose` finds the right cause: verdicts over simulated logs of undeclared effects
    DiagnosisAccuracy(diagnosis_accuracy::Args),
    /// Errors of every identification method over an ensemble of simulated experiments
    Identification(identification::methods::Args),
    /// How soon the fault monitor detects a fault under way, and what compensation gains
    FaultDetection(identification::faults::Args),
    /// Does the board's protection level bound its error: flights drawn over the whole scenario language
    #[command(after_help = "Examples:
  cargo lab judge --runs 20 --classes work --hours 3
  cargo lab judge --runs 3000 --seed 100000 --store judged.jsonl --out page.md --picture page.svg")]
    Judge(judge::Args),
    /// Does the board name what changes in flight: surveys with one cause, two, none, and with some that it cannot know
    #[command(after_help = "Examples:
  cargo lab naming --runs 8 --seed 1000
  cargo lab naming --runs 350 --seed 500000 --store named.jsonl --out docs/results/naming.md")]
    Naming(naming::Args),
    /// Fly every fault of the table and judge how the backseat copes
    Faults(fault_table::Args),
    /// A planned identification mission against a lawnmower and open-loop inputs
    Plan(identification::excitation_planning::Args),
    /// Diagnose the log of a glider, a pinger, transponders, a pair of thrusters or a ship: models of one public log each
    SingleLog(single_logs::Args),
    /// Surge and yaw of an Iver's mission log, in servo counts
    ServoCounts(servo_counts::Args),
    /// A ship's model with propeller and rudder on the surface, simulated, identified and navigated
    #[command(subcommand)]
    Vessel(vessel::Command),
    /// Whether a log that is recorded wrongly is told, and one that is recorded rightly is not
    WrongRecordings(wrong_recordings::Args),
    /// Whether `diagnose` names and sizes effects of known size that are put into recorded logs
    Injections(injections::Args),
    /// Which pages of docs/results are older than the code that they show, and the commands that renew them
    #[command(after_help = "Examples:
  cargo lab results
  cargo lab results --renew cost emulation
  cargo lab results --made thesis                 after its tables were put into the page")]
    Results(results::Args),
    /// How often `diagnose` names the right cause in simulated short runs of a torpedo
    Twins(twins::Args),
    /// Join the stores of the parts of an ensemble
    #[command(after_help = MERGE_EXAMPLES)]
    Merge(MergeArgs),
}

const MERGE_EXAMPLES: &str = "\
Examples:
  cargo lab geometry --runs 20 --shard 1/2 --store a.jsonl        on one machine
  cargo lab geometry --runs 20 --shard 2/2 --store b.jsonl        on another, with the same program
  cargo lab merge a.jsonl b.jsonl -o all.jsonl
  cargo lab geometry --runs 20 --store all.jsonl --out geometry.md

Results of one version only: the same program, command and conditions. A run that stands in two stores must be the
same in both.";

impl Lab {
    /// Runs it, prints its tables and writes the files asked for.
    ///
    /// # Errors
    /// A flight or a filter that fails; a file that cannot be written.
    pub fn run(&self) -> anyhow::Result<()> {
        match &self.command {
            LabCommand::Reproduce(arguments) => reproduce::run(arguments),
            LabCommand::Alone(arguments) => alone::run(arguments),
            LabCommand::Team(arguments) => team::run(arguments),
            LabCommand::Navigation(arguments) => navigation::run(arguments),
            LabCommand::Geometry(arguments) => geometry::run(arguments),
            LabCommand::Consistency(arguments) => consistency::run_command(arguments),
            LabCommand::DiagnosisAccuracy(arguments) => diagnosis_accuracy::run(arguments),
            LabCommand::Identification(arguments) => identification::methods::run(arguments),
            LabCommand::FaultDetection(arguments) => identification::faults::run(arguments),
            LabCommand::Judge(arguments) => judge::run(arguments),
            LabCommand::Naming(arguments) => naming::run(arguments),
            LabCommand::Faults(arguments) => fault_table::run(arguments),
            LabCommand::Plan(arguments) => identification::excitation_planning::run(arguments),
            LabCommand::SingleLog(arguments) => single_logs::run(arguments),
            LabCommand::ServoCounts(arguments) => servo_counts::run(arguments),
            LabCommand::Vessel(command) => command.run(),
            LabCommand::WrongRecordings(arguments) => wrong_recordings::run(arguments),
            LabCommand::Injections(arguments) => injections::run(arguments),
            LabCommand::Results(arguments) => arguments.run(),
            LabCommand::Twins(arguments) => twins::run(arguments),
            LabCommand::Merge(arguments) => arguments.run(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{CommandFactory as _, Parser as _};

    fn examples(command: &clap::Command) -> Vec<String> {
        let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        let own = help.lines().filter_map(|line| line.strip_prefix("  cargo ")).map(ToOwned::to_owned);
        own.chain(command.get_subcommands().flat_map(examples)).collect()
    }

    #[test]
    fn every_command_has_an_example_and_every_example_is_understood() {
        let lab = Lab::command();
        for command in lab.get_subcommands() {
            assert!(!examples(command).is_empty(), "{} has no example", command.get_name());
        }
        for example in examples(&lab) {
            is_understood(&example);
        }
    }

    fn is_understood(example: &str) {
        // What follows two spaces says what it is for.
        let line = example.split("  ").next().unwrap_or_default();
        let parsed = Lab::try_parse_from(line.split_whitespace());
        assert!(parsed.is_ok(), "{example}\n{}", parsed.err().map(|error| error.to_string()).unwrap_or_default());
    }

    #[test]
    fn every_command_line_of_the_guide_is_understood() {
        let guide = include_str!("../../../docs/guide/laboratory.md");
        let lines = guide.lines().filter_map(|line| line.strip_prefix("    "));
        let own = lines.filter_map(|line| Some(line[line.find("lab ")?..].split(" :::").next()?.to_owned()));
        let own: Vec<String> = own.collect();
        assert!(own.len() > 7, "{own:?}");
        // What the scheduler fills in.
        own.iter().for_each(|line| is_understood(&line.replace("$SLURM_ARRAY_TASK_ID", "1").replace("{}", "1")));
    }

    #[test]
    fn a_part_needs_a_store() {
        let parsed = |line: &str| Lab::try_parse_from(line.split_whitespace()).is_ok();
        assert!(parsed("lab geometry --shard 1/2 --store a.jsonl"));
        assert!(!parsed("lab geometry --shard 1/2") && !parsed("lab geometry --shard 3/2 --store a.jsonl"));
    }
}
