//! The tutorial, line by line: every command of `docs/guide/tutorial.md` is run, and prints what the page shows.

use crate::harness::{Outcome, program};
use std::path::Path;

const PAGE: &str = include_str!("../../../docs/guide/tutorial.md");

/// A command of the page, its exit code there, and what it is said to print.
#[derive(Debug, Default)]
struct Step {
    command: String,
    code: i32,
    shown: Vec<String>,
}

/// Commands are indented; the block behind one, if any, is what it prints. `<!-- exit 3 -->` before a command: its
/// code.
fn steps() -> Vec<Step> {
    let (mut steps, mut code, mut is_inside): (Vec<Step>, i32, bool) = (Vec::new(), 0, false);
    for line in PAGE.lines() {
        if line == "```" {
            is_inside = !is_inside;
        } else if is_inside {
            if let Some(step) = steps.last_mut() {
                step.shown.push(line.to_owned());
            }
        } else if let Some(rest) = line.strip_prefix("<!-- exit ") {
            code = rest.trim_end_matches(" -->").parse().unwrap();
        } else if let Some(command) = line.strip_prefix("    ") {
            steps.push(Step { command: command.to_owned(), code, ..Step::default() });
            code = 0;
        }
    }
    steps
}

/// Whether the lines are printed, in this order; `...` stands for any lines, and in a line for any text.
fn is_printed(shown: &[String], printed: &str) -> Result<(), String> {
    let mut lines = printed.lines();
    let mut is_gap = true;
    for wanted in shown {
        if wanted == "..." {
            is_gap = true;
            continue;
        }
        let fits = |line: &str| match wanted.split_once("...") {
            Some((begin, end)) => line.starts_with(begin) && line.ends_with(end),
            None => line.trim_end() == wanted.trim_end(),
        };
        let found =
            if is_gap { lines.by_ref().find(|line| fits(line)) } else { lines.next().filter(|line| fits(line)) };
        if found.is_none() {
            return Err(format!("the page shows {wanted:?}"));
        }
        is_gap = false;
    }
    Ok(())
}

#[test]
fn every_command_prints_what_the_page_shows() {
    let folder = tempfile::tempdir().unwrap();
    let samples = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/guide/samples"));
    std::fs::create_dir_all(folder.path().join("docs/guide/samples")).unwrap();
    for entry in std::fs::read_dir(samples).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, folder.path().join("docs/guide/samples").join(path.file_name().unwrap())).unwrap();
    }
    let steps = steps();
    assert!(steps.len() >= 6, "{steps:?}");
    assert!(steps.iter().filter(|step| !step.shown.is_empty()).count() >= 5, "the page shows too little");
    for step in steps {
        let arguments = step.command.split(" #").next().unwrap().trim().strip_prefix("backseat ").unwrap();
        let Outcome { code, stdout: printed, stderr: aside } = program(folder.path(), arguments.split_whitespace());
        assert_eq!(code, Some(step.code), "{}\n{printed}{aside}", step.command);
        if let Err(missing) = is_printed(&step.shown, &printed) {
            panic!("{}: {missing}, it prints\n{printed}{aside}", step.command);
        }
    }
}
