//! The ARM image in QEMU: the same bits as on this computer, and on its own clock.
//!
//! Without QEMU or the ARM target these tests pass over it and say so; with `BACKSEAT_REQUIRE_QEMU` set
//! in the environment they fail instead.

use crate::harness::{is_qemu_there, wait_for};
use backseat_analysis::flight_score;
use backseat_core::navigation::{ProcessModel, Sensor};
use backseat_estimation::filter::{self, FilterOptions, ShipSource};
use backseat_link::{BackseatError, Client, Ports};
use backseat_logs::VehicleFile;
use backseat_wire::hostlink::{Decoder, FromBoard, Mode, Port, Step, ToBoard};
use hil_sim::backseat::{InProcess, Qemu, build_image};
use hil_sim::flight::{FlightLog, Start, board_parameters, fly, fly_prepared, fly_realtime};
use hil_sim::scenario::Scenario;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::thread::sleep;
use std::time::Duration;

fn survey(minutes: f64) -> Scenario {
    let mut scenario = Scenario::built_in("survey").unwrap();
    scenario.settings.seed = 1;
    scenario.settings.duration_s = 60.0 * minutes;
    scenario
}

/// `None` when something is not installed.
fn image() -> Option<Qemu> {
    is_qemu_there().then(|| Qemu::start(&build_image().unwrap()).unwrap())
}

/// Notes time and digest of every step that passes by on the host port.
struct Tap<P> {
    ports: P,
    decoder: Decoder,
    digests: Vec<(u64, u64)>,
}

impl<P: Ports> Tap<P> {
    fn new(ports: P) -> Self {
        Self { ports, decoder: Decoder::new(), digests: Vec::new() }
    }

    fn note(&mut self, port: Port, mut bytes: &[u8]) {
        while port == Port::Host
            && let Some(frame) = self.decoder.feed(&mut bytes)
        {
            if let Ok(FromBoard::StepDone(done)) = frame.and_then(|frame| frame.message()) {
                self.digests.push((done.time_us, done.digest));
            }
        }
    }
}

impl<P: Ports> Ports for Tap<P> {
    fn write(&mut self, port: Port, bytes: &[u8]) -> Result<(), BackseatError> {
        self.ports.write(port, bytes)
    }

    fn read(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        let before = received.len();
        self.ports.read(port, received)?;
        self.note(port, &received[before..]);
        Ok(())
    }

    fn poll(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        let before = received.len();
        self.ports.poll(port, received)?;
        self.note(port, &received[before..]);
        Ok(())
    }

    fn patience(&self) -> Duration {
        self.ports.patience()
    }
}

fn flown<P: Ports>(scenario: &Scenario, ports: P) -> (FlightLog, Vec<(u64, u64)>) {
    let mut client = Client::new(Tap::new(ports));
    let flight = fly(scenario, &mut client, None, &AtomicBool::new(false), |_| {}).unwrap();
    (flight, std::mem::take(&mut client.ports().digests))
}

#[test]
fn arm_and_host_agree_to_the_bit_at_every_step() {
    let Some(qemu) = image() else { return };
    let scenario = survey(7.0);
    let (host, expected) = flown(&scenario, InProcess::new());
    // By then the board has gone over to its own clock, which must leave no trace.
    sleep(Duration::from_secs(4));
    let (arm, digests) = flown(&scenario, qemu);

    let differs = digests.iter().zip(&expected).find(|(arm, host)| arm != host);
    assert_eq!(differs, None, "the first step (time, digest) that differs, ARM and host");
    // The step at time zero, and ten a second.
    assert_eq!((digests.len(), expected.len()), (4201, 4201));
    assert_eq!((arm.digest, &arm.fusions), (host.digest, &host.fusions));
    // It was navigation with ranges, not silence, that was compared.
    let seconds = arm.samples.iter().filter(|sample| sample.telemetry.mode == Mode::Navigating).count();
    assert!(seconds > 300, "{seconds}");
    for sensor in [Sensor::Range, Sensor::RangeRate, Sensor::Depth, Sensor::Attitude] {
        let fused = host.fusions.iter().filter(|fusion| fusion.sensor == sensor && fusion.fused).count();
        assert!(fused >= 10, "{sensor:?}: {fused}");
    }
}

/// The error of the board itself and, over the same measurements, of the filter on this computer.
fn errors(flight: &FlightLog, vehicle: &VehicleFile) -> [f64; 2] {
    let mut options = FilterOptions::new(vehicle, ProcessModel::Dynamic);
    options.use_dvl = false;
    options.ship = ShipSource::Packet;
    let run = filter::run(&flight.log, vehicle, &options).unwrap();
    let filter = flight_score::of_run("filter", &run, &flight_score::truth_of(flight)).unwrap();
    [flight_score::backseat("board", flight).unwrap().error.rms_m, filter.error.rms_m]
}

#[test]
#[ignore = "a quarter of an hour in QEMU: .ci/nightly"]
fn val_a_better_vehicle_over_the_host_link_helps_as_predicted() {
    let Some(qemu) = image() else { return };
    let mut scenario = survey(8.0);
    // The robust filter would find most of what is wrong by itself.
    scenario.settings.backseat.robust = false;
    let right = &scenario.vehicle;
    let mut wrong = scenario.clone();
    for drag in &mut wrong.vehicle.parameters.quadratic_diag {
        *drag *= 1.1;
    }
    wrong.vehicle.parameters.cl[0] *= 0.9;

    let mut client = Client::new(qemu);
    client.set_parameters(&board_parameters(&wrong)).unwrap();
    client.set_mission(&scenario.settings.waypoints()).unwrap();
    let fly =
        |client: &mut Client<Qemu>| fly_prepared(&scenario, client, None, &AtomicBool::new(false), |_| {}).unwrap();
    let before = fly(&mut client);
    client.request(&ToBoard::MissionStop, || "to stop".into()).unwrap();
    client.set_parameters(&board_parameters(&scenario)).unwrap();
    let after = fly(&mut client);

    let ([board_before, filter_before], [board_after, filter_after]) =
        (errors(&before, &wrong.vehicle), errors(&after, right));
    let (ratio, expected) = (board_after / board_before, filter_after / filter_before);
    println!("board {board_before:.2} to {board_after:.2} m, filter {filter_before:.2} to {filter_after:.2} m");
    // Devices round what the board hears, the log does not: centimetres of the few decimetres that are left.
    assert!(ratio < 0.15 && (ratio / expected - 1.0).abs() < 0.3, "{ratio:.4} instead of {expected:.4}");
}

#[test]
fn bytes_that_nobody_reads_are_counted_and_reported() {
    const SENT: usize = 6000;
    /// What the image's queue holds.
    const KEPT: u32 = 2047;
    let Some(qemu) = image() else { return };
    let mut client = Client::new(qemu);
    client.step(0, &[], &[]).unwrap();
    // Under the simulator's clock the board reads what is announced, and this is not.
    client.ports().write(Port::Ahrs, &[0x55; SENT]).unwrap();
    let mut losses = [0; 5];
    wait_for("the last byte", || {
        client.send(&ToBoard::HealthGet).unwrap();
        losses = client
            .receive(|message| match message {
                FromBoard::Health(health) => Some(health.receive_losses),
                _ => None,
            })
            .unwrap();
        if losses[Port::Ahrs as usize] == SENT as u32 - KEPT { Ok(()) } else { Err(format!("{losses:?}")) }
    });
    assert_eq!(losses, [0, 0, SENT as u32 - KEPT, 0, 0]);
    // and after the next step without being asked
    client
        .send(&ToBoard::Step(Step {
            time_us: 100_000,
            pps_us: Default::default(),
            chunks: Default::default(),
            fittings: Default::default(),
        }))
        .unwrap();
    let reported = client.receive(|message| match message {
        FromBoard::Health(health) => Some(health.receive_losses == losses),
        FromBoard::StepDone(_) => Some(false),
        _ => None,
    });
    assert!(reported.unwrap());
}

#[test]
#[ignore = "in real time: .ci/nightly"]
fn arm_navigates_on_its_own_clock() {
    let Some(qemu) = image() else { return };
    let mut client = Client::new(Tap::new(qemu));
    let flight =
        fly_realtime(&survey(2.0), &mut client, Start::AtOnce, None, None, &AtomicBool::new(false), |_| {}).unwrap();
    assert!(client.ports().digests.is_empty(), "a lock-step without its clock");
    // Once a second, but for what a busy machine misses.
    assert!(flight.samples.len() > 110, "{}", flight.samples.len());
    let last = flight.samples.last().unwrap();
    assert_eq!(last.telemetry.mode, Mode::Navigating);
    assert_eq!(last.telemetry.rejected_frames, [0; 4], "a byte was lost");
    assert!(last.telemetry.leg.is_some() && last.truth.actuators.propeller_radps > 50.0, "{last:?}");
    // Fixes of 1.5 m until it dived; a filter with a wrong clock is off by tens of metres.
    let error_m = (0..2).map(|axis| last.telemetry.state[axis] - last.truth.state[axis]).fold(0.0, f64::hypot);
    assert!(error_m < 6.0, "{error_m} m");
}

/// The one line that an image is answered with.
fn complaint(image: &str) -> String {
    let started = Qemu::start(Path::new(image)).and_then(|qemu| Ok(Client::new(qemu).hello()?));
    let text = format!("{:#}", started.unwrap_err());
    assert_eq!(text.lines().count(), 1, "{text}");
    text
}

#[test]
fn a_file_that_is_no_image_is_refused_in_one_line() {
    assert!(complaint("nowhere.elf").contains("nowhere.elf: no such image"));
    if image().is_some() {
        let text = complaint(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"));
        assert!(text.contains("the ARM image ended"), "{text}");
    }
}
