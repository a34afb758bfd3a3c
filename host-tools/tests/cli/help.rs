//! Every command has help with an example and, where it yields results, `--json`; bad usage is explained; completions work.

use crate::harness::{Outcome, program};
use std::path::Path;
use std::process::Command;

/// Commands whose result is no data: a script.
const WITHOUT_JSON: [&str; 3] = ["completions", "man", "params docs"];

/// Exit code, stdout and stderr.
fn backseat(words: &[String], more: &[&str]) -> (Option<i32>, String, String) {
    let words = words.iter().map(String::as_str).chain(more.iter().copied());
    let Outcome { code, stdout, stderr } = program(Path::new("."), words);
    (code, stdout, stderr)
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
        "sim", "info", "map", "vehicle", "navigate", "diagnose", "effect", "identify", "bench", "record", "replay",
        "export", "monitor", "check", "topside", "update",
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

/// Whatever the outcome, stdout has one object and nothing else; where there is no result, as of a file that is no log,
/// it has nothing, and stderr says why.
#[test]
fn json_is_one_object() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let samples = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/guide/samples");
    let host_tools = env!("CARGO_MANIFEST_DIR");
    std::fs::write(at("useless.csv"), "t_s,depth_m\n0,1\n1,1.5\n").unwrap();
    let header = "t_s,gps_x_m,gps_y_m,roll_rad,pitch_rad,heading_rad,dvl_u_mps,dvl_v_mps,dvl_w_mps\n0,0,0,0,0,0,,,\n";
    let absurd: String = (1..9).map(|t| format!("{t},,,1e300,1e300,1e300,1e300,1e300,1e300\n")).collect();
    std::fs::write(at("absurd.csv"), header.to_owned() + &absurd).unwrap();
    std::fs::write(at("moment.csv"), header).unwrap();
    let [flight, reset, data] = ["flight", "reset", "data"].map(at);
    let [session, log, vehicle] = ["flight/session.mcap", "data/log.csv", "data/vehicle.toml"].map(at);
    for (line, code) in [
        (format!("sim run --minutes 2 --out {flight}"), 0),
        // ends before its mission does
        (format!("sim run {samples}/reset.toml --out {reset}"), 3),
        (format!("sim dataset --effect random --seed 1 --hours 0.1 --out {data}"), 0),
        (format!("sim dataset --effect random --seed 1 --hours 0.1 --out {data}"), 1),
        ("sim dataset --list".to_owned(), 0),
        (format!("info {session}"), 0),
        (format!("info {log}"), 0),
        (format!("info {vehicle}"), 0),
        (format!("info {}", at("useless.csv")), 3),
        (format!("map {samples}/other_maker.csv.gz"), 0),
        (format!("vehicle check {vehicle}"), 0),
        (format!("navigate {log} --smooth"), 0),
        (format!("navigate {}", at("moment.csv")), 0),
        (format!("navigate {}", at("absurd.csv")), 3),
        (format!("identify {samples}/dive.csv.gz"), 3),
        (format!("diagnose {samples}/iver_survey.csv.gz"), 0),
        (format!("diagnose {}", at("useless.csv")), 1),
        // the vehicle moves
        (format!("bench {log}"), 1),
        (format!("replay {session}"), 0),
        (format!("export {session} --csv {}", at("tables")), 0),
        (format!("topside {host_tools}/logs/examples/topside.toml --check"), 0),
        ("effect list".to_owned(), 0),
        ("effect show heading_bias".to_owned(), 0),
        (format!("check {}", at("no-such-port")), 1),
        (format!("update {} {log}", at("no-such-port")), 1),
    ] {
        let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        let (found, stdout, stderr) = backseat(&words, &["--json"]);
        assert_eq!(found, Some(code), "{line}: {stderr}");
        if code == 1 {
            assert!(stdout.is_empty() && stderr.contains("error: "), "{line}: {stdout}{stderr}");
        } else {
            let object: Result<serde_json::Map<String, serde_json::Value>, _> = serde_json::from_str(&stdout);
            assert!(object.is_ok_and(|object| !object.is_empty()), "{line}: {stdout}");
        }
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
fn every_command_has_a_manual_page() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().to_str().unwrap();
    assert_eq!(backseat(&["man".to_owned()], &[path]).0, Some(0));
    for command in leaves(&[]) {
        let page = folder.path().join(format!("backseat-{}.1", command.join("-")));
        let text = std::fs::read_to_string(&page).unwrap_or_else(|error| panic!("{}: {error}", page.display()));
        assert!(text.contains(".SH SYNOPSIS"), "{}", page.display());
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
    for word in ["record", "replay"] {
        assert!(offered.split_whitespace().any(|offer| offer == word), "{offered}{:?}", output.stderr);
    }
}
