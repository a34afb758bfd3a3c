//! What every command of the board has in common.

use super::bench::Bench;
use crate::harness::program;
use backseat_link::Pty;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::spawn;

const COMMANDS: [&[&str]; 12] = [
    &["mission", "put", "PORT", "m.toml"],
    &["mission", "get", "PORT"],
    &["mission", "start", "PORT"],
    &["mission", "stop", "PORT"],
    &["params", "get", "PORT"],
    &["params", "set", "PORT", "app.use_dvl=1"],
    &["params", "export", "PORT", "x.toml"],
    &["params", "import", "PORT", "v.toml"],
    &["params", "store", "PORT"],
    &["params", "learnt", "PORT"],
    &["params", "forget", "PORT"],
    &["check", "PORT"],
];

#[test]
fn a_port_that_is_none_is_told_in_one_line() {
    let bench = Bench::new();
    bench.write("m.toml", "[[mission.waypoints]]\nx_m = 0\ny_m = 0\ndepth_m = 0\nspeed_mps = 1\n");
    bench.write("v.toml", "[app]\nuse_dvl = 1\n");
    let at = |command: &[&str], port: &str| {
        let arguments = command.iter().map(|argument| if *argument == "PORT" { port } else { argument });
        program(&bench.path("."), arguments).complaint(&format!("{command:?} {port}"))
    };
    for command in COMMANDS {
        for port in ["/dev/null", "/dev/no-such-port", "m.toml"] {
            let line = at(command, port);
            assert!(line.contains(port) && line.contains("serial port"), "{line}");
        }
    }
    assert!(!bench.path("x.toml").exists());
}

#[test]
fn a_port_without_a_board_is_given_up() {
    let silent = Pty::open().unwrap();
    let outcome = program(Path::new("."), ["params", "get", silent.path()]);
    assert!(outcome.complaint("a silent port").contains("no data received"), "{}", outcome.stderr);
    // something else that talks
    let other = Arc::new(Pty::open().unwrap());
    let over = Arc::new(AtomicBool::new(false));
    let talker = {
        let (other, over) = (Arc::clone(&other), Arc::clone(&over));
        spawn(move || {
            while !over.load(Ordering::Relaxed) {
                let _ = other.write_all(b"$GPRMC,not a backseat*00\r\n\0\x05junk");
                std::thread::sleep(std::time::Duration::from_millis(50));
            }
        })
    };
    let outcome = program(Path::new("."), ["check", other.path()]);
    over.store(true, Ordering::Relaxed);
    talker.join().unwrap();
    assert!(outcome.complaint("another device").contains("not from a backseat's host port"), "{}", outcome.stderr);
}

#[test]
fn help_has_examples_and_bad_usage_is_told() {
    let run = |arguments: &[&str]| program(Path::new("."), arguments);
    for command in COMMANDS {
        let words = command.iter().position(|word| *word == "PORT").unwrap();
        let help = run(&[&command[..words], &["--help"]].concat());
        assert_eq!(help.code, Some(0));
        assert!(help.stdout.contains("Example") && help.stdout.contains("--json"), "{}", help.stdout);
        // without a port
        assert_eq!(run(&command[..words]).code, Some(2), "{command:?}");
    }
    for arguments in [
        &["mission"][..],
        &["mission", "fly", "/dev/null"],
        &["mission", "put", "/dev/null"],
        &["mission", "get", "/dev/null", "a.toml", "-o", "b.toml"],
        &["params", "set", "/dev/null"],
        &["params", "set", "/dev/null", "app.use_dvl"],
        &["params", "set", "/dev/null", "app.use_dvl=yes"],
        &["check", "/dev/no-such:fast"],
    ] {
        assert_eq!(run(arguments).code, Some(2), "{arguments:?}");
    }
}
