//! `backseat monitor`.

use super::bench::{Bench, Lines, carry};
use crate::harness::{PROGRAM, command, program, signal, wait_for};
use backseat_link::Pty;
use backseat_wire::hostlink::Port;
use hil_sim::scenario::Scenario;
use serde_json::Value;
use std::fs::File;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{JoinHandle, sleep, spawn};
use std::time::Duration;

/// One JSON object a line.
fn objects(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"))).collect()
}

/// Texts of all events, in their order.
fn events(objects: &[Value]) -> Vec<String> {
    let of = |object: &Value| object["events"].as_array().unwrap().clone();
    objects.iter().flat_map(of).map(|event| event["text"].as_str().unwrap().to_owned()).collect()
}

/// A cable of the board's host port under a name of its own, which can be unplugged.
struct Cable {
    over: Arc<AtomicBool>,
    carriers: [JoinHandle<()>; 2],
}

impl Cable {
    fn plug(lines: &Lines, name: &Path) -> Self {
        let cable = Arc::new(Pty::open().unwrap());
        let _ = std::fs::remove_file(name);
        symlink(cable.path(), name).unwrap();
        let over = Arc::new(AtomicBool::new(false));
        let carriers = [true, false].map(|to_board| {
            let (cable, lines, over) = (Arc::clone(&cable), lines.clone(), Arc::clone(&over));
            spawn(move || carry(&cable, &lines.0[Port::Host as usize], to_board, usize::MAX, &over))
        });
        Self { over, carriers }
    }

    fn unplug(self, name: &Path) {
        std::fs::remove_file(name).unwrap();
        self.over.store(true, Ordering::Relaxed);
        self.carriers.into_iter().for_each(|carrier| carrier.join().unwrap());
    }
}

#[test]
#[ignore = "in real time: .ci/nightly"]
fn json_tells_a_vehicle_once_a_second_through_a_lost_cable() {
    let mut bench = Bench::new();
    let scenario = Scenario::built_in("survey").unwrap();
    let declination = format!("app.declination_rad={}", scenario.settings.environment.magnetic_declination_rad);
    bench.simulate(scenario);
    bench.write("m.toml", include_str!("../../../../hil-sim/scenarios/survey.toml"));
    bench.good(&["mission", "put", "PORT", "m.toml"]);
    let gate = "app.gate_sigma=7";
    let effect = "effects.thrust_loss.k_n_s2_per_rad_m=0.012";
    bench.good(&["params", "set", "PORT", "app.use_range=0", "app.use_dvl=1", gate, effect, &declination]);

    let port = bench.path("board");
    let cable = Cable::plug(&bench.lines, &port);
    let watching = command(Path::new("."))
        .args(["monitor", port.to_str().unwrap(), "--json", "--for", "21.5"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    sleep(Duration::from_secs(14)); // a fix, every parameter, and a busy machine
    cable.unplug(&port);
    sleep(Duration::from_secs(2));
    let cable = Cable::plug(&bench.lines, &port);
    let output = watching.wait_with_output().unwrap();
    cable.unplug(&port);
    assert!(output.status.success());
    let objects = objects(&String::from_utf8(output.stdout).unwrap());
    assert!((20..=21).contains(&objects.len()), "{}", objects.len());

    let before = objects.iter().take_while(|object| object["link"]["connected"] == true).last().unwrap();
    assert_eq!(before["mode"], "navigating", "{before}");
    assert_eq!((&before["waypoints"], &before["gate_sigmas"]), (&22.into(), &7.0.into()), "{before}");
    assert_eq!(before["effects"]["thrust_loss.k_n_s2_per_rad_m"], 0.012, "{before}");
    for sensor in ["depth", "attitude", "rates", "dvl", "gnss"] {
        let sensor = &before["sensors"][sensor];
        assert!(sensor["rate_hz"].as_f64().unwrap() > 0.2 && sensor["fused"].as_u64().unwrap() > 2, "{before}");
    }
    assert!((before["navigation"]["state"]["x_m"].as_f64().unwrap() + 100.0).abs() < 10.0, "{before}");
    assert!(before["link"]["telemetry_per_s"].as_f64().unwrap() > 5.0, "{before}");
    assert!(before["ports"]["ahrs"]["good_per_s"].as_f64().unwrap() > 1.0, "{before}");

    let away = objects.iter().find(|object| object["link"]["connected"] == false).expect("it was unplugged");
    assert!(away["alarms"][0]["text"].as_str().unwrap().starts_with("port gone for"), "{away}");
    let after = objects.last().unwrap();
    assert_eq!((&after["link"]["connected"], &after["mode"]), (&true.into(), &"navigating".into()), "{after}");
    let printed = events(&objects);
    let position =
        |text: &str| printed.iter().position(|event| event.starts_with(text)).unwrap_or_else(|| panic!("{printed:?}"));
    assert!(position("port lost") < position("port back after"), "{printed:?}");
}

/// The program on a terminal of its own.
struct Screen {
    terminal: Pty,
    child: Child,
    before: String,
    shown: Vec<u8>,
}

impl Screen {
    fn start(port: &str) -> Self {
        let terminal = Pty::open().unwrap();
        assert!(
            Command::new("stty")
                .args(["-F", terminal.path(), "sane", "rows", "24", "cols", "80"])
                .status()
                .unwrap()
                .success()
        );
        let before = stty(&terminal);
        let end = || File::options().read(true).write(true).open(terminal.path()).unwrap();
        let child =
            Command::new(PROGRAM).args(["monitor", port]).stdin(end()).stdout(end()).stderr(end()).spawn().unwrap();
        Self { terminal, child, before, shown: Vec::new() }
    }

    /// Waits until this was shown.
    fn shows(&mut self, wanted: &str) {
        wait_for(wanted, || {
            if self.shown.windows(wanted.len()).any(|bytes| bytes == wanted.as_bytes()) {
                return Ok(());
            }
            let mut buffer = [0; 4096];
            let count = self.terminal.read(&mut buffer, 100).unwrap();
            self.shown.extend_from_slice(&buffer[..count]);
            Err(String::from_utf8_lossy(&self.shown).into_owned())
        });
    }

    /// It ended well and left the terminal as it was.
    fn ends(mut self) {
        // back from the alternate screen, with a cursor
        self.shows("\x1b[?1049l");
        self.shows("\x1b[?25h");
        assert_eq!(self.child.wait().unwrap().code(), Some(0), "{}", String::from_utf8_lossy(&self.shown));
        assert_eq!(stty(&self.terminal), self.before);
    }
}

/// All settings of a terminal.
fn stty(terminal: &Pty) -> String {
    let output = Command::new("stty").args(["-F", terminal.path(), "-g"]).output().unwrap();
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_terminal_is_restored_by_key_and_by_signal() {
    let silent = Pty::open().unwrap();
    for how in ["q", "\x03", "TERM"] {
        let mut screen = Screen::start(silent.path());
        screen.shows("\x1b[?1049h");
        screen.shows("cable, power and baud rate");
        assert_ne!(stty(&screen.terminal), screen.before, "raw");
        if how == "TERM" {
            signal("TERM", screen.child.id());
        } else {
            screen.terminal.write_all(how.as_bytes()).unwrap();
        }
        screen.ends();
    }
}

#[test]
fn without_a_terminal_or_a_port_it_says_so() {
    let run = |arguments: &[&str]| program(Path::new("."), arguments);
    let silent = Pty::open().unwrap();
    assert!(run(&["monitor", silent.path()]).complaint("no terminal").contains("--json"));
    for port in ["/dev/null", "/dev/no-such-port"] {
        assert!(run(&["monitor", port, "--json"]).complaint(port).contains(port));
    }
    let help = run(&["monitor", "--help"]).good("help");
    assert!(help.contains("Example") && help.contains("--json") && help.contains("--for"), "{help}");
    for arguments in [&["monitor"][..], &["monitor", "x", "--for", "-1"], &["monitor", "x:0"]] {
        assert_eq!(run(arguments).code, Some(2), "{arguments:?}");
    }
    // a silent board is an alarm, not an error
    let outcome = run(&["monitor", silent.path(), "--json", "--for", "1.2"]);
    let objects = objects(&outcome.good("a silent port"));
    assert_eq!(objects[0]["alarms"][0]["text"], "no telemetry yet; check cable, power and baud rate");
}
