//! Every command has help with an example and, where it yields results, `--json`; bad usage is explained; completions work.

use std::process::{Command, Stdio};

/// Commands whose result is no data: a script.
const WITHOUT_JSON: [&str; 2] = ["completions", "params docs"];

/// Exit code, stdout and stderr.
fn backseat(words: &[String], more: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_backseat"));
    let output = command.args(words).args(more).stdin(Stdio::null()).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// Names under "Commands:" of a help text.
fn subcommands(help: &str) -> Vec<String> {
    let list = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let name =
        |line: &str| line.strip_prefix("  ").filter(|rest| !rest.starts_with(' '))?.split(' ').next().map(Into::into);
    list.filter_map(name).filter(|name: &String| name != "help").collect()
}

/// Every command that does something.
fn leaves(words: &[String]) -> Vec<Vec<String>> {
    let (code, help, stderr) = backseat(words, &["--help"]);
    assert_eq!((code, stderr.as_str()), (Some(0), ""), "{words:?}");
    let below = subcommands(&help);
    if below.is_empty() {
        return vec![words.to_vec()];
    }
    below.into_iter().flat_map(|name| leaves(&[words, &[name]].concat())).collect()
}

#[test]
fn every_command_has_help_an_example_and_json() {
    let commands = leaves(&[]);
    let names: Vec<&str> = commands.iter().map(|words| words[0].as_str()).collect();
    for name in [
        "sim",
        "studies",
        "info",
        "map",
        "vehicle",
        "navigate",
        "diagnose",
        "effect",
        "identify",
        "bench",
        "reproduce",
        "record",
        "replay",
        "export",
        "monitor",
        "check",
        "topside",
    ] {
        assert!(names.contains(&name), "{name} is missing among {names:?}");
    }
    assert!(commands.len() > 15, "{commands:?}");
    for words in &commands {
        let (_, help, _) = backseat(words, &["--help"]);
        let example = format!("  backseat {}", words.join(" "));
        let examples = help.split_once("\nExample").map_or("", |(_, examples)| examples);
        assert!(examples.contains(&example), "{words:?} has no example of itself: {help}");
        let wants_json = !WITHOUT_JSON.contains(&words.join(" ").as_str());
        assert_eq!(help.contains("--json"), wants_json, "{words:?}: {help}");
        // the summary is there as well, and one line says what the command does
        let (code, summary, _) = backseat(words, &["-h"]);
        assert!(code == Some(0) && !summary.lines().next().unwrap_or("").is_empty(), "{words:?}: {summary}");
    }
}

#[test]
fn bad_usage_is_told() {
    for words in leaves(&[]) {
        let (code, stdout, stderr) = backseat(&words, &["--no-such-flag"]);
        assert_eq!((code, stdout.as_str()), (Some(2), ""), "{words:?}");
        assert!(stderr.starts_with("error: ") && stderr.contains("--no-such-flag"), "{words:?}: {stderr}");
    }
    assert_eq!(backseat(&["no-such-command".to_owned()], &[]).0, Some(2));
    for (given, meant) in [("smi", "sim"), ("sim rn", "run"), ("effect nw", "new"), ("vehicle chek", "check")] {
        let words: Vec<String> = given.split(' ').map(str::to_owned).collect();
        let (code, _, stderr) = backseat(&words, &[]);
        let tip = format!("tip: a similar subcommand exists: '{meant}'");
        assert!(code == Some(2) && stderr.contains(&tip), "{given}: {stderr}");
    }
}

#[test]
fn completions_know_every_command() {
    let commands = leaves(&[]);
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let (code, script, stderr) = backseat(&["completions".to_owned()], &[shell]);
        assert_eq!((code, stderr.as_str()), (Some(0), ""), "{shell}");
        for word in commands.iter().flatten() {
            assert!(script.contains(word.as_str()), "{shell} does not know {word}");
        }
        assert!(script.contains("realtime"), "{shell}: flags are missing");
    }
    // and a shell takes the script
    let (_, script, _) = backseat(&["completions".to_owned()], &["bash"]);
    let complete = "COMP_WORDS=(backseat re); COMP_CWORD=1; _backseat backseat re backseat; echo ${COMPREPLY[*]}";
    let Ok(output) = Command::new("bash").arg("-c").arg(format!("{script}\n{complete}")).output() else { return };
    let offered = String::from_utf8(output.stdout).unwrap();
    for word in ["record", "replay", "reproduce"] {
        assert!(offered.split_whitespace().any(|offer| offer == word), "{offered}{:?}", output.stderr);
    }
}
