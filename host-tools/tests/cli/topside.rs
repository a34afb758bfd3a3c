//! `backseat topside` as a user meets it: configuration files, wrong ports, a port that is unplugged.

use crate::harness::{Outcome, command, program};
use backseat_link::Pty;
use std::path::Path;
use std::process::Stdio;

const EXAMPLE: &str = include_str!("../../logs/examples/topside.toml");

/// Exit code, stdout and stderr of `topside` with this configuration.
fn topside(folder: &Path, text: &str, more: &[&str]) -> (Option<i32>, String, String) {
    let file = folder.join("ship.toml");
    std::fs::write(&file, text).unwrap();
    let Outcome { code, stdout, stderr } = program(folder, [&["topside", file.to_str().unwrap()], more].concat());
    (code, stdout, stderr)
}

#[test]
fn the_example_is_the_cycle_of_the_thesis() {
    let folder = tempfile::tempdir().unwrap();
    let (code, stdout, stderr) = topside(folder.path(), EXAMPLE, &["--check"]);
    assert_eq!((code, stderr.as_str()), (Some(0), ""));
    for line in
        ["cycle of 30 s", "   0 s  uplink       2", "  15 s  downlink     all", "  20 s  vehicle_ping 2", "no key"]
    {
        assert!(stdout.contains(line), "{line}: {stdout}");
    }
}

/// Each mistake is one line that names the file and what is wrong, and the exit code is 1.
#[test]
fn a_wrong_configuration_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let cases = [
        ("at_s = 5\n", "at_s = 2\n", "the slots at 0 s (uplink) and 2 s (downlink) overlap"),
        ("range_max_m = 700.0", "range_max_m = 1500.0", "overlap by"),
        ("period_s = 30", "period_s = 15", "outside the cycle of 15 s"),
        ("address = 2\n", "address = 1\n", "both the ship's and a vehicle's"),
        ("exchange = \"uplink\"\nvehicle = 2", "exchange = \"uplink\"\nvehicle = 7", "not in the list of vehicles"),
        ("exchange = \"uplink\"\nvehicle = 2", "exchange = \"uplink\"", "vehicle is missing"),
        ("exchange = \"uplink\"", "exchange = \"upload\"", "ship.toml:34"),
        ("rate = 0", "speed = 0", "ship.toml:18"),
        ("rate = 0", "rate = 6", "data rate 6"),
        ("# key = \"0001", "key = \"zz01", "32 hexadecimal digits"),
    ];
    for (from, to, words) in cases {
        assert!(EXAMPLE.contains(from), "{from}");
        let (code, stdout, stderr) = topside(folder.path(), &EXAMPLE.replacen(from, to, 1), &["--check"]);
        assert_eq!((code, stdout.as_str()), (Some(1), ""), "{to}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
        assert!(stderr.contains(words) && stderr.contains("ship.toml"), "{words}: {stderr}");
    }
    // a port that is not there
    let (code, _, stderr) = topside(folder.path(), &EXAMPLE.replace("/dev/ttyUSB", "/dev/none"), &["--json"]);
    assert!(code == Some(1) && stderr.contains("ports.gnss: /dev/none0 cannot be opened"), "{stderr}");
    // no terminal
    let (code, _, stderr) = topside(folder.path(), EXAMPLE, &[]);
    assert!(code == Some(1) && stderr.contains("--json"), "{stderr}");
}

#[test]
fn swapped_ports_are_named_and_nothing_is_sent_but_settings() {
    let folder = tempfile::tempdir().unwrap();
    let (gnss, modem) = (Pty::open().unwrap(), Pty::open().unwrap());
    let text = EXAMPLE.replace("/dev/ttyUSB0", gnss.path()).replace("/dev/ttyUSB1", modem.path());
    let file = folder.path().join("ship.toml");
    std::fs::write(&file, text).unwrap();
    let log = folder.path().join("dive.mcap");
    let mut child = command(folder.path())
        .args(["topside", file.to_str().unwrap(), "--json", "--for", "7", "--log", log.to_str().unwrap()])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut sent = Vec::new();
    while child.try_wait().unwrap().is_none() {
        gnss.write_all(b"$CADQF,234,1*55\r\n").unwrap();
        modem.write_all(b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n").unwrap();
        let mut buffer = [0; 4096];
        let count = modem.read(&mut buffer, 100).unwrap();
        sent.extend_from_slice(&buffer[..count]);
    }
    let output = child.wait_with_output().unwrap();
    let lines = String::from_utf8(output.stdout).unwrap();
    let last: serde_json::Value = serde_json::from_str(lines.lines().last().unwrap()).unwrap();
    assert_eq!((&last["sending"], &last["hold"]["name"]), (&false.into(), &"gnss_is_modem".into()), "{last}");
    let sent = String::from_utf8(sent).unwrap();
    assert!(sent.contains("$CCCFG,SRC,1") && !sent.contains("$CCCYC") && !sent.contains("$CCTXD"), "{sent}");
    assert!(log.metadata().unwrap().len() > 1000);
}
