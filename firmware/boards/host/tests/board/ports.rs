//! The host board on pseudo-terminals.

use backseat_host::{HostPorts, run};
use backseat_wire::hostlink::{Chunk, Decoder, FromBoard, MAX_FRAME, Port, Step, StepDone, Telemetry, ToBoard, encode};
use serialport::{SerialPort, TTYPort};
use std::fs;
use std::io::{Error, ErrorKind, Read, Write};
use std::path::PathBuf;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{JoinHandle, sleep, spawn};
use std::time::{Duration, Instant};

/// What takes longer has hung: on a busy machine what is a matter of seconds may take minutes, and that is no error.
const HANG: Duration = Duration::from_mins(10);
const COMPASS: &[u8] = b"$C82.8P-3.89R-2.63T20.3D3.2*78\r\n";

/// The simulator's ends, and the board in a thread on the others.
struct Bench {
    masters: Vec<TTYPort>,
    stop: Arc<AtomicBool>,
    board: JoinHandle<anyhow::Result<()>>,
    decoder: Decoder,
    begun: Instant,
}

impl Bench {
    fn new() -> Self {
        let (masters, paths): (Vec<TTYPort>, Vec<PathBuf>) = Port::ALL
            .iter()
            .map(|_| {
                let (mut master, slave) = TTYPort::pair().expect("a pseudo-terminal");
                master.set_timeout(HANG).unwrap();
                // The slave closes here: it cannot be opened twice.
                (master, PathBuf::from(slave.name().expect("its path")))
            })
            .unzip();
        let stop = Arc::new(AtomicBool::new(false));
        let board = {
            let (ports, stop) = (HostPorts::new(paths.try_into().unwrap()), Arc::clone(&stop));
            spawn(move || run(&ports, &stop))
        };
        Self { masters, stop, board, decoder: Decoder::new(), begun: Instant::now() }
    }

    fn write(&mut self, port: Port, bytes: &[u8]) {
        while let Err(error) = self.masters[port as usize].write_all(bytes) {
            self.wait_for_opening(&error);
        }
    }

    /// A pseudo-terminal is broken until the board has opened its end.
    fn wait_for_opening(&self, error: &Error) {
        assert_eq!(error.kind(), ErrorKind::BrokenPipe, "{error}");
        assert!(self.begun.elapsed() < HANG, "the board does not open its ports");
        sleep(Duration::from_millis(1));
    }

    fn send(&mut self, message: &ToBoard<'_>) {
        let frame = encode(message, &mut [0; MAX_FRAME]).unwrap().to_vec();
        self.write(Port::Host, &frame);
    }

    /// Reads the host port until a message is the one that is waited for.
    fn receive<T>(&mut self, mut take: impl FnMut(FromBoard<'_>) -> Option<T>) -> T {
        loop {
            let mut buffer = [0; 4096];
            let count = match self.masters[Port::Host as usize].read(&mut buffer) {
                Ok(count) => count,
                Err(error) => {
                    self.wait_for_opening(&error);
                    continue;
                }
            };
            let mut bytes = &buffer[..count];
            let mut found = None;
            while let Some(frame) = self.decoder.feed(&mut bytes) {
                found = take(frame.expect("a good frame").message().expect("a message")).or(found);
            }
            if let Some(found) = found {
                return found;
            }
        }
    }

    fn step(&mut self, time_us: u64, bytes: &[u8]) -> StepDone {
        let mut step =
            Step { time_us, pps_us: Default::default(), chunks: Default::default(), fittings: Default::default() };
        if !bytes.is_empty() {
            self.write(Port::Frontseat, bytes);
            let length = u16::try_from(bytes.len()).unwrap();
            step.chunks.push(Chunk { port: Port::Frontseat, time_us, length }).unwrap();
        }
        self.send(&ToBoard::Step(step));
        let done = self.receive(|message| if let FromBoard::StepDone(done) = message { Some(done) } else { None });
        for (port, count) in Port::DEVICES.into_iter().zip(done.sent) {
            let mut sent = vec![0; usize::from(count)];
            self.masters[port as usize].read_exact(&mut sent).unwrap();
        }
        done
    }

    /// Stops the board; what `run` returned.
    fn end(self) -> anyhow::Result<()> {
        self.stop.store(true, Ordering::Relaxed);
        self.board.join().unwrap()
    }
}

/// Fifty seconds in lock-step.
fn fly(bench: &mut Bench) {
    for step in 1..=500 {
        let time_us = step * 100_000;
        assert_eq!(bench.step(time_us, COMPASS).time_us, time_us);
    }
}

#[test]
fn steps_in_lock_step() {
    let mut bench = Bench::new();
    bench.step(0, &[]);
    fly(&mut bench);
    bench.end().unwrap();
}

#[test]
#[ignore = "in real time: .ci/nightly"]
fn a_step_waits_for_nothing() {
    let mut bench = Bench::new();
    bench.step(0, &[]);
    let begun = Instant::now();
    fly(&mut bench);
    let wall = begun.elapsed();
    println!("{:.0} µs a step", wall.as_secs_f64() * 1e6 / 500.0);
    // about 0.1 ms on an idle machine; what this catches is a wait of whole milliseconds
    assert!(wall < Duration::from_secs(2), "{wall:?}");
    bench.end().unwrap();
}

/// The next record of telemetry.
fn record(bench: &mut Bench) -> Telemetry {
    bench.receive(|message| if let FromBoard::Telemetry(record) = message { Some(record) } else { None })
}

#[test]
fn steps_by_itself() {
    let mut bench = Bench::new();
    let first = record(&mut bench);
    assert!(record(&mut bench).time_us > first.time_us);
    bench.end().unwrap();
}

#[test]
#[ignore = "in real time: .ci/nightly"]
fn steps_by_itself_in_real_time() {
    let mut bench = Bench::new();
    let first = record(&mut bench);
    let begun = Instant::now();
    let last = (0..5).map(|_| record(&mut bench)).last().unwrap();
    assert_eq!((last.time_us - first.time_us + 50_000) / 100_000, 5);
    let late = begun.elapsed().abs_diff(Duration::from_millis(500));
    // a busy machine may hold a step up, but not for long
    assert!(late < Duration::from_millis(200), "{late:?}");
    bench.end().unwrap();
}

#[test]
fn a_port_that_vanishes_is_named_in_one_line() {
    let mut bench = Bench::new();
    bench.step(0, &[]);
    let master = bench.masters.remove(Port::Modem as usize);
    drop(master);
    let error = bench.board.join().unwrap().unwrap_err();
    let text = format!("{error:#}");
    assert!(text.starts_with("modem: /dev/") && text.contains("vanished") && !text.contains('\n'), "{text}");
}

/// A USB adapter that was pulled and plugged in again: the board goes on, says so, and hears the device again.
#[test]
fn on_its_own_clock_a_port_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    // each device is a name that can be pointed to another terminal
    let stop = Arc::new(AtomicBool::new(false));
    let (mut paths, mut masters) = (Vec::new(), Vec::new());
    for i in 0..5 {
        let (master, slave) = TTYPort::pair().unwrap();
        let link = folder.path().join(format!("port{i}"));
        std::os::unix::fs::symlink(slave.name().unwrap(), &link).unwrap();
        paths.push(link);
        masters.push(master);
    }
    let (ports, flag) = (HostPorts::new(paths.clone().try_into().unwrap()), Arc::clone(&stop));
    let board = spawn(move || run(&ports, &flag));
    let listens = |master: &mut TTYPort| {
        let begun = Instant::now();
        master.set_timeout(Duration::from_millis(100)).unwrap();
        while begun.elapsed() < HANG {
            if master.read(&mut [0; 256]).is_ok_and(|count| count > 0) {
                return true;
            }
            sleep(Duration::from_millis(20));
        }
        false
    };
    assert!(listens(&mut masters[0]), "the frontseat is asked");
    let frontseat = Port::Frontseat as usize;
    drop(masters.remove(frontseat));
    sleep(Duration::from_millis(500));
    assert!(!board.is_finished(), "it goes on without");
    let (master, slave) = TTYPort::pair().unwrap();
    fs::remove_file(&paths[frontseat]).unwrap();
    std::os::unix::fs::symlink(slave.name().unwrap(), &paths[frontseat]).unwrap();
    masters.insert(frontseat, master);
    drop(slave);
    assert!(listens(&mut masters[frontseat]), "the frontseat is asked again");
    // and without any port there is nothing to wait for
    masters.clear();
    let text = format!("{:#}", board.join().unwrap().unwrap_err());
    assert_eq!(text, "every port has vanished");
}

#[test]
fn what_is_no_port_is_refused() {
    let file = std::env::temp_dir().join(format!("backseat-host-{}", std::process::id()));
    fs::write(&file, "not a port").unwrap();
    for path in [&file, &PathBuf::from("/nonexistent/port")] {
        let output = Command::new(env!("CARGO_BIN_EXE_backseat-host"))
            .args(
                ["--frontseat", "--dvl", "--ahrs", "--modem", "--host"]
                    .map(|flag| format!("{flag}={}", path.display())),
            )
            .output()
            .unwrap();
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{text}");
        assert!(text.contains("frontseat: cannot open") && text.lines().count() == 1, "{text}");
    }
    fs::remove_file(file).unwrap();
}
