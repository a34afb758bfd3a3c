//! The command that a diagnosis prints under `Next` is one that runs, with all options of the log, and does what it says.

use crate::harness::{Outcome, program};
use std::path::Path;

/// Runs `diagnose` with these arguments, then what it prints under `Next`: the sentence above, the command and its outcome.
fn next(folder: &Path, arguments: &str) -> (String, String, Outcome) {
    let diagnosed = program(folder, format!("diagnose {arguments}").split_whitespace());
    assert!(matches!(diagnosed.code, Some(0 | 3)), "{arguments}: {}{}", diagnosed.stdout, diagnosed.stderr);
    let lines: Vec<&str> = diagnosed.stdout.lines().collect();
    let place = lines.iter().position(|line| line.trim() == "Next").expect(&diagnosed.stdout);
    let command = lines[place..].iter().find_map(|line| line.trim().strip_prefix("backseat ")).unwrap();
    let outcome = program(folder, command.split_whitespace());
    assert!(matches!(outcome.code, Some(0 | 3)), "{arguments}: {command}: {}{}", outcome.stdout, outcome.stderr);
    assert!(!command.contains('{'), "{command}");
    let said = lines[place + 1].trim().to_owned();
    assert!(!said.contains("->"), "a figure is promised of another command: {said}");
    (said, command.to_owned(), outcome)
}

fn samples() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let samples = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/guide/samples"));
    for entry in std::fs::read_dir(samples).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, folder.path().join(path.file_name().unwrap())).unwrap();
    }
    folder
}

#[test]
fn what_is_next_runs_on_each_sample() {
    let folder = samples();
    let folder = folder.path();
    let drafted = program(folder, ["map", "other_maker.csv.gz", "--out", "map.toml"]);
    assert!(matches!(drafted.code, Some(0 | 3)), "{}", drafted.stderr);
    for (arguments, kept) in [
        ("iver_survey.csv.gz", ""),
        ("iver_survey.csv.gz --report survey", ""),
        ("other_maker.csv.gz --columns map.toml", "--columns map.toml"),
        ("dive.csv.gz --vehicle iver3.toml --no-dvl", "--vehicle iver3.toml --no-dvl"),
        ("dive.csv.gz --no-dvl --report dive", "--vehicle dive/vehicle.toml --no-dvl"),
    ] {
        let (_, command, _) = next(folder, arguments);
        // Where the next command writes a report: no result is overwritten.
        let _ = std::fs::remove_dir_all(folder.join("why"));
        assert!(command.contains(kept), "{arguments}: {command}");
    }
}

/// With the vehicle file that is written the track is nearer to the truth than with the declared one.
#[test]
fn what_is_next_on_simulated_logs_brings_what_it_says() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (name, effect, options) in
        [("bent", "thrust_loss:k_n_s2_per_rad_m=0.004", "--report why"), ("clean", "none", "")]
    {
        let made = format!("sim dataset --effect {effect} --seed 7 --hours 0.3 --excite --out {name}");
        program(folder, made.split_whitespace()).good(&made);
        let judged = format!("--vehicle {name}/vehicle.toml --truth {name}/truth/truth.csv");
        let (said, command, outcome) = next(folder, &format!("{name}/log.csv {judged} {options}"));
        assert!(command.starts_with("navigate ") && command.contains("--truth"), "{command}");
        assert!(said.contains("track"), "{said}");
        if !options.is_empty() {
            let median = |arguments: &str| {
                let found = program(folder, format!("{arguments} --model nominal --json").split_whitespace()).json();
                found["error"]["median_m"].as_f64().unwrap()
            };
            let [declared, found] =
                [&format!("navigate {name}/log.csv {judged}"), &command].map(|command| median(command));
            assert!(found < declared, "{declared} m with the declared vehicle, {found} m with the one found");
        }
        assert!(outcome.stdout.contains("error"), "{}", outcome.stdout);
    }
}

/// Commands under `Next`, on lines of their own and in back quotes.
fn printed(outcome: &Outcome) -> Vec<String> {
    let lines: Vec<&str> = outcome.stdout.lines().map(str::trim).collect();
    let Some(place) = lines.iter().position(|line| *line == "Next") else { return Vec::new() };
    let text = lines[place + 1..].join(" ");
    let quoted = text.split('`').skip(1).step_by(2).map(str::to_owned);
    let own = lines[place + 1..].iter().filter(|line| line.starts_with("backseat ")).map(|line| (*line).to_owned());
    own.chain(quoted).filter(|command| command.starts_with("backseat ")).collect()
}

/// Runs a command, then everything that it prints under `Next`, with this log where it says LOG; at least one command is
/// printed, each with these options.
fn all_run(folder: &Path, arguments: &str, log: &str, kept: &str) {
    let first = program(folder, arguments.split_whitespace());
    assert!(matches!(first.code, Some(0 | 3)), "{arguments}: {}{}", first.stdout, first.stderr);
    let commands = printed(&first);
    assert!(commands.iter().any(|command| command.contains(kept)), "{arguments}: {}", first.stdout);
    for command in commands {
        let filled = command.replace("LOG", log).replace("DIR", "exported");
        let words: Vec<&str> = filled.split_whitespace().skip(1).collect();
        // What drafts needs a table that has no mapping yet, and what takes a board needs one: their help is there.
        let is_whole = words.len() > 1 && !words.contains(&"PORT");
        let words = if is_whole { words } else { vec![words[0], "--help"] };
        let outcome = program(folder, &words);
        assert!(matches!(outcome.code, Some(0 | 3)), "{arguments}: {filled}: {}{}", outcome.stdout, outcome.stderr);
    }
}

#[test]
fn what_map_and_info_say_next_runs() {
    let folder = samples();
    let folder = folder.path();
    let log = "other_maker.csv.gz";
    all_run(folder, "map other_maker.csv.gz --out map.toml", log, "--columns map.toml");
    all_run(folder, "info map.toml", log, "map.toml");
    all_run(folder, "info iver3.toml", log, "iver3.toml");
    all_run(folder, "info reset.toml", log, "reset.toml");
    let made = "sim dataset --effect none --seed 3 --hours 0.1 --out set";
    program(folder, made.split_whitespace()).good(made);
    all_run(folder, "info set/truth/truth.csv", "set/log.csv", "--truth set/truth/truth.csv");
    // A table whose mapping has the heading negated: the options by which it was read are kept.
    let map = std::fs::read_to_string(folder.join("map.toml")).unwrap();
    let [before, after] = ["[columns.heading_rad]\n", "[columns.heading_rad]\nsign = -1\n"];
    assert!(map.contains(before), "{map}");
    std::fs::write(folder.join("wrong.toml"), map.replace(before, after)).unwrap();
    all_run(folder, &format!("navigate {log} --columns wrong.toml"), log, "--columns wrong.toml");
}

/// A track that is not to be trusted, and a vehicle that is, or is not, identified.
#[test]
fn what_navigate_and_identify_say_next_runs() {
    let folder = samples();
    let folder = folder.path();
    all_run(folder, "navigate iver_survey.csv.gz", "", "diagnose iver_survey.csv.gz");
    program(folder, ["map", "other_maker.csv.gz", "--out", "map.toml"]);
    let mapped = "other_maker.csv.gz --columns map.toml";
    all_run(folder, &format!("navigate {mapped}"), "", &format!("diagnose {mapped}"));
    all_run(folder, "identify dive.csv.gz --method iv --vehicle iver3.toml", "", "dive.csv.gz");
    // No result is overwritten.
    let _ = std::fs::remove_file(folder.join("identified.toml"));
    let made = "sim dataset --effect thrust_loss:k_n_s2_per_rad_m=0.004 --seed 7 --hours 0.3 --excite --out set";
    program(folder, made.split_whitespace()).good(made);
    let asked = "identify set/log.csv --vehicle set/vehicle.toml --method iv";
    all_run(folder, asked, "", &format!("{asked} --out identified.toml"));
    all_run(folder, &format!("{asked} --report found"), "", "navigate set/log.csv --vehicle found/vehicle.toml");
}

/// A log that is refused: what is said next shows why, and `--force` goes on, in each command.
#[test]
fn what_is_said_next_of_a_refused_log_runs() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let made = "sim dataset --effect none --seed 3 --hours 0.2 --excite --out set";
    program(folder, made.split_whitespace()).good(made);
    let text = std::fs::read_to_string(folder.join("set/log.csv")).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap();
    let place = header.split(',').position(|name| name == "heading_rad").unwrap();
    let mut wrong = format!("{header}\n");
    for line in lines {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if let Ok(heading) = cells[place].parse::<f64>() {
            cells[place] = (-heading).to_string();
        }
        wrong += &(cells.join(",") + "\n");
    }
    std::fs::write(folder.join("wrong.csv"), wrong).unwrap();
    for command in ["navigate", "identify", "diagnose"] {
        all_run(folder, &format!("{command} wrong.csv"), "", "wrong.csv");
        let forced = program(folder, [command, "wrong.csv", "--force"]);
        assert_eq!(forced.code, Some(3), "{command}: {}{}", forced.stdout, forced.stderr);
    }
}
