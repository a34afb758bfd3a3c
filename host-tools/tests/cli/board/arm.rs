//! The commands that talk to a board against the ARM image, as `cargo qemu` starts it.
//!
//! Without QEMU or the ARM target the test passes over it and says so; with `BACKSEAT_REQUIRE_QEMU` set
//! in the environment it fails instead.

use super::bench::simulate;
use super::check::{checked, verdict};
use crate::harness::{Outcome, is_qemu_there, program, wait_for};
use backseat_link::Pty;
use backseat_link::Serial;
use backseat_logs::VehicleFile;
use hil_sim::backseat::build_image;
use hil_sim::scenario::Scenario;
use serde_json::Value;
use std::fs::File;
use std::io::Write as _;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::sleep;
use std::time::Duration;
use tempfile::TempDir;

/// The image in QEMU, with its console on a terminal of its own.
struct Emulator {
    child: Child,
    folder: TempDir,
    /// Paths of the pseudo-terminals, in the order of the README.
    ports: [String; 5],
    monitor: String,
}

impl Emulator {
    /// `None` when something is not installed.
    fn start() -> Option<Self> {
        if !is_qemu_there() {
            return None;
        }
        build_image().unwrap();
        let folder = tempfile::tempdir().unwrap();
        let said = folder.path().join("said");
        let mut child = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
            .args(["qemu", "--quiet", "--", "-monitor", "pty"])
            .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
            // Flags meant for this computer.
            .env_remove("RUSTFLAGS")
            .env_remove("CARGO_ENCODED_RUSTFLAGS")
            .stdin(Stdio::null())
            .stdout(File::create(&said).unwrap())
            .stderr(Stdio::inherit())
            .spawn()
            .unwrap();
        let [ports @ .., monitor] = ["frontseat", "dvl", "ahrs", "modem", "host", "compat_monitor0"].map(|label| {
            wait_for(label, || {
                // Behind these lines the image's log follows, which is no text.
                let text = String::from_utf8_lossy(&std::fs::read(&said).unwrap()).into_owned();
                let mut lines = text.lines().filter_map(|line| line.strip_prefix("char device redirected to "));
                let label = format!(" (label {label})");
                if let Some(path) = lines.find_map(|line| line.strip_suffix(label.as_str())) {
                    return Ok(path.to_owned());
                }
                assert_eq!(child.try_wait().unwrap(), None, "cargo qemu ended: {text}");
                Err(text)
            })
        });
        Some(Self { child, folder, ports, monitor })
    }

    /// Runs the program; `PORT` among the arguments stands for the board's host port.
    fn run(&self, arguments: &[&str]) -> Outcome {
        let arguments = arguments.iter().map(|argument| if *argument == "PORT" { &self.ports[4] } else { *argument });
        program(self.folder.path(), arguments)
    }

    fn good(&self, arguments: &[&str]) -> String {
        self.run(arguments).good(&format!("{arguments:?}"))
    }

    fn json(&self, arguments: &[&str]) -> Value {
        self.run(&[arguments, &["--json"]].concat()).json()
    }

    /// As the board's reset button: the supply stays on. The mission, which is in memory only, is gone behind it.
    fn reset(&self) {
        let mut monitor = File::options().read(true).write(true).open(&self.monitor).unwrap();
        // QEMU looks once a second whether somebody holds the other end.
        sleep(Duration::from_millis(1500));
        monitor.write_all(b"system_reset\n").unwrap();
        wait_for("the reset", || {
            let outcome = self.run(&["mission", "get", "PORT"]);
            if outcome.code == Some(0) { Err(outcome.stdout) } else { Ok(()) }
        });
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // Cargo became QEMU. Both fail only when it has ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
#[ignore = "in real time: .ci/nightly"]
fn check_mission_and_params_work_against_the_arm_image() {
    let Some(board) = Emulator::start() else { return };
    let scenario = Scenario::built_in("survey").unwrap();
    let declination = format!("app.declination_rad={}", scenario.settings.environment.magnetic_declination_rad);

    // A vehicle on its device ports; the host port is the program's.
    let [frontseat, dvl, ahrs, modem, _] = &board.ports;
    let nobody = Pty::open().unwrap();
    let devices = Serial::open(&[frontseat, dvl, ahrs, modem, nobody.path()].join(",")).unwrap();
    let stop = Arc::new(AtomicBool::new(false));
    let vehicle = simulate(devices, scenario, Arc::clone(&stop));

    std::fs::write(board.folder.path().join("m.toml"), include_str!("../../../../hil-sim/scenarios/survey.toml"))
        .unwrap();
    assert_eq!(board.json(&["mission", "put", "PORT", "m.toml"])["waypoints"], 22);
    assert_eq!(board.json(&["mission", "get", "PORT"])["waypoints"].as_array().unwrap().len(), 22);
    // no PPS input there, so no ranges
    board.good(&["params", "set", "PORT", "app.use_range=0", "app.use_dvl=1", &declination]);
    board.good(&["params", "export", "PORT", "set.toml"]);
    board.good(&["params", "set", "PORT", "vehicle.mass_kg=39", "app.use_dvl=0"]);
    assert_eq!(board.json(&["params", "import", "PORT", "set.toml"])["changed"].as_array().unwrap().len(), 2);

    // what the board refuses by itself, with the reason, and what a vehicle file brings
    let values = ["vehicle.mass_kg=40", "vehicle.weight_kg=40", "installation.sound_speed_mps=15"];
    let line = board.run(&[&["params", "set", "PORT"], &values[..]].concat()).complaint("refused");
    for part in
        ["keeps the old set", "weight_kg: this board has no such parameter", "15: expected within 1300 to 1700 m/s"]
    {
        assert!(line.contains(part), "{line}");
    }
    let mut file = VehicleFile::reference();
    file.apply([("fins.cl[0]", 2.9), ("effects.thrust_loss.k_n_s2_per_rad_m", 0.01)]).unwrap();
    std::fs::write(board.folder.path().join("v.toml"), file.to_toml("a test's")).unwrap();
    let printed = board.json(&["params", "import", "PORT", "v.toml"]);
    assert_eq!(printed["changed"].as_array().unwrap().len(), 2, "{printed}");
    board.good(&["params", "import", "PORT", "set.toml"]);

    // A fix comes within a second of its own clock. The emulated board keeps time with the clock, which a busy machine may
    // not grant it for three seconds on end.
    let report = checked(|| board.run(&["check", "PORT", "--wiggle", "--json"]), |report| report["passed"] == true);
    for check in ["telemetry", "frontseat port", "DVL port", "AHRS port", "receive losses", "mission", "fin wiggle"] {
        assert_eq!(verdict(&report, check).0, "ok", "{report}");
    }
    assert!(verdict(&report, "mode").1.starts_with("Navigating"), "{report}");

    assert_eq!(board.json(&["params", "store", "PORT"])["stored"], true);
    board.good(&["mission", "start", "PORT"]);
    let refused = board.run(&["params", "store", "PORT"]).complaint("under way");
    assert!(refused.contains("stored nothing: a mission runs"), "{refused}");
    assert!(board.good(&["mission", "stop", "PORT"]).starts_with("stopped"));

    // what was stored is there after a reset, and nothing else
    board.good(&["params", "set", "PORT", "vehicle.mass_kg=39"]);
    board.reset();
    let value = |name: &str| board.json(&["params", "get", "PORT", name])["parameters"][0]["value"].clone();
    assert_eq!((value("app.use_dvl"), value("vehicle.mass_kg")), (1.0.into(), 38.0.into()));
    assert!(board.run(&["mission", "get", "PORT"]).complaint("after the reset").contains("no mission"));

    stop.store(true, Ordering::Relaxed);
    vehicle.join().unwrap();
}
