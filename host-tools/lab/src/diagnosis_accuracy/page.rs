//! The page.

use super::plan::Class;
use super::run::DiagnosedLog;
use super::sections::{Findings, Target};
use backseat_report::markdown::markdown_table;
use clap::ValueEnum as _;
use std::fmt::Write as _;

/// The page with its introduction.
pub struct Page<'a> {
    pub study: Findings<'a>,
    pub runs: &'a [DiagnosedLog],
    /// Seeds asked for.
    pub seeds: std::ops::Range<u64>,
    /// Those classes; empty if it is all.
    pub classes: &'a [Class],
}

impl Page<'_> {
    fn intro(&self) -> String {
        let seeds = &self.seeds;
        format!(
            "{} runs, seeds {} to {}. Each is a simulated log of half an hour of the reference vehicle with one undeclared \
             effect, or two, or three, or none, or one that is in no catalogue; `diagnose` is given the log and the declared vehicle \
             alone. Half of the logs have manoeuvres that excite (dives, steps of speed, legs across), half \
             are lines to and fro; three of four have noise as sensors have it (of another size than declared, one or two \
             parts that last 0.5 to 60 s, steps of the readings, gaps, readings twice), half have a DVL, on half the \
             inputs move on between their samples. Half of the events end. Seeds below {} were used while `diagnose` was \
             developed; these were not.",
            self.runs.len(),
            seeds.start,
            seeds.end - 1,
            super::FIRST_SEED
        )
    }

    fn command(&self) -> String {
        let mut command = format!("cargo lab diagnosis-accuracy --runs {}", self.seeds.end - self.seeds.start);
        if self.seeds.start != super::FIRST_SEED {
            let _ = write!(command, " --first-seed {}", self.seeds.start);
        }
        let classes: Vec<String> = self
            .classes
            .iter()
            .filter_map(|class| class.to_possible_value())
            .map(|value| value.get_name().to_owned())
            .collect();
        if !classes.is_empty() {
            let _ = write!(command, " --class {}", classes.join(","));
        }
        command
    }

    pub fn markdown(&self) -> String {
        let mut out = format!("# Undeclared effects: how often `diagnose` is right\n\n{}\n\n", self.intro());
        let _ = writeln!(out, "Command: `{}`, results of version {}.\n", self.command(), super::VERSION);
        grid(&mut out, &TARGETS, &self.study.targets().iter().map(row).collect::<Vec<_>>());
        for section in
            self.study.sections().iter().filter(|section| !section.rows.is_empty() || !section.text.is_empty())
        {
            let _ = writeln!(out, "\n## {}\n", section.title);
            if !section.text.is_empty() {
                let _ = writeln!(out, "{}\n", section.text);
            }
            if !section.rows.is_empty() {
                grid(&mut out, &section.header, &section.rows);
            }
        }
        out
    }
}

const TARGETS: [&str; 4] = ["", "asked", "found", "reached"];

fn row(target: &Target) -> Vec<String> {
    let reached = match target.reached {
        Some(true) => "yes",
        Some(false) => "no",
        None => "–",
    };
    vec![target.what.to_owned(), target.asked.to_owned(), target.found.clone(), reached.to_owned()]
}

fn grid(out: &mut String, header: &[&str], rows: &[Vec<String>]) {
    let mut table = markdown_table(header.iter().copied());
    table.add_rows(rows.iter().map(|row| row.iter().map(|cell| cell.replace("|n|", "\\|n\\|"))));
    let _ = writeln!(out, "{table}");
}
