//! Sessions to replay: a simulated vehicle with its devices, and the program under test.

use crate::harness::{Outcome, program};
use backseat_link::{Arrival, Client, ReportedFusion};
use backseat_logs::output::Existing;
use backseat_logs::session::{Attachment, Clock, Entry, Meta, Reader, Writer};
use backseat_wire::hostlink::Port;
use hil_sim::backseat::InProcess;
use hil_sim::devices::Devices;
use hil_sim::flight::board_parameters;
use hil_sim::scenario::Scenario;
use hil_sim::world::World;
use serde_json::Value;
use std::path::Path;

pub const STEP_US: u64 = 100_000;
const SECOND_US: u64 = 1_000_000;

/// The default mission.
pub fn scenario() -> Scenario {
    let mut scenario = Scenario::built_in("survey").unwrap();
    scenario.settings.seed = 5;
    scenario
}

/// Vehicle, ship and devices.
pub struct Sim {
    world: World,
    pub devices: Devices,
}

impl Sim {
    pub fn new(scenario: &Scenario) -> Self {
        Self { world: World::new(scenario), devices: Devices::new(scenario) }
    }

    /// What reaches the backseat's ports up to `to_us`.
    pub fn advance(&mut self, to_us: u64) -> Vec<(Port, Arrival)> {
        let mut until_us = 0;
        while until_us < to_us {
            until_us = self.devices.next_us().unwrap_or(to_us).min(to_us);
            self.world.advance(until_us, &mut |observation| self.devices.observe(observation));
            self.world.set_actuator_targets(until_us, self.devices.run(until_us));
        }
        self.devices.arrivals(to_us)
    }

    pub fn sent(&mut self, time_us: u64, sent: &[Vec<u8>; 4]) {
        for (port, bytes) in Port::DEVICES.into_iter().zip(sent).filter(|(_, bytes)| !bytes.is_empty()) {
            self.devices.sent_by_backseat(port, time_us, bytes);
        }
    }
}

/// Edges of the pulse per second up to a step.
pub fn edges(time_us: u64) -> Vec<u64> {
    if time_us.is_multiple_of(SECOND_US) { vec![time_us] } else { vec![] }
}

/// A flight in lock-step, recorded as the simulator does.
pub struct TapedFlight {
    pub client: Client<InProcess>,
    sim: Sim,
    time_us: u64,
    pub fusions: Vec<ReportedFusion>,
    pub digest: u64,
}

impl TapedFlight {
    /// Under way.
    pub fn begin(session: &Path) -> Self {
        let scenario = scenario();
        let mut client = Client::new(InProcess::new());
        client.hello().unwrap();
        let meta = Meta::new("test", Clock::Board).with("seed", scenario.settings.seed);
        client.record(Writer::create(session, &meta, Existing::Keep).unwrap()).unwrap();
        client.set_parameters(&board_parameters(&scenario)).unwrap();
        client.set_mission(&scenario.settings.waypoints()).unwrap();
        client.step(0, &[], &[]).unwrap();
        client.start_mission().unwrap();
        Self { client, sim: Sim::new(&scenario), time_us: 0, fusions: Vec::new(), digest: 0 }
    }

    pub fn fly(&mut self, seconds: u64) {
        let end_us = self.time_us + seconds * SECOND_US;
        while self.time_us < end_us {
            self.time_us += STEP_US;
            let arrivals = self.sim.advance(self.time_us);
            let output = self.client.step(self.time_us, &edges(self.time_us), &arrivals).unwrap();
            self.sim.sent(self.time_us, &output.sent);
            self.fusions.extend(output.fusions);
            self.digest = output.digest;
        }
    }
}

/// Reads a session, changes it, writes another.
pub fn rewrite(from: &Path, to: &Path, clock: Clock, mut change: impl FnMut(Entry) -> Option<Entry>) {
    let reader = Reader::open(from).unwrap();
    let meta = Meta { clock, ..reader.meta().clone() };
    let mut writer = Writer::create(to, &meta, Existing::Keep).unwrap();
    let note = Attachment { name: "a.txt".to_owned(), media_type: "text/plain".to_owned(), bytes: b"changed".to_vec() };
    writer.attach(&note).unwrap();
    for entry in reader {
        if let Some(entry) = change(entry.unwrap()) {
            writer.write(&entry).unwrap();
        }
    }
    writer.finish().unwrap();
}

/// Exit code, stdout and stderr of the program.
pub fn backseat(arguments: &[&str]) -> (i32, String, String) {
    let Outcome { code, stdout, stderr } = program(Path::new("."), arguments);
    (code.unwrap(), stdout, stderr)
}

/// The same, with `--json`; what it printed, read.
pub fn replay(log: &Path, more: &[&str]) -> (i32, Value, String) {
    let arguments = [&["replay", log.to_str().unwrap(), "--json"], more].concat();
    let (code, stdout, stderr) = backseat(&arguments);
    (code, serde_json::from_str(&stdout).unwrap_or_else(|error| panic!("{error}: {stdout}{stderr}")), stderr)
}

/// The first difference that a replay found, of `step` or `record`.
pub fn difference(said: &Value, kind: &str) -> [String; 4] {
    ["t_s", "record", "field", "replayed"].map(|key| said["difference"][kind][key].as_str().unwrap_or("").to_owned())
}
