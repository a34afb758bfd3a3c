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
