//! A bench: the app on five pseudo-terminals, a simulated vehicle where one is needed, and the program under test.

use crate::harness::{HANG, Outcome, program};
use backseat_host::{HostPorts, run};
use backseat_link::Pty;
use backseat_link::{BackseatError, Ports};
use backseat_wire::hostlink::Port;
use hil_sim::devices::Devices;
use hil_sim::scenario::Scenario;
use hil_sim::world::World;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{JoinHandle, sleep, spawn};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Our ends of the board's five ports.
#[derive(Clone)]
pub struct Lines(pub Arc<Vec<Pty>>);

pub struct Bench {
    pub lines: Lines,
    folder: TempDir,
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Bench {
    pub fn new() -> Self {
        let lines = Lines(Arc::new(Port::ALL.iter().map(|_| Pty::open().unwrap()).collect()));
        let paths: Vec<PathBuf> = lines.0.iter().map(|pty| PathBuf::from(pty.path())).collect();
        let ports = HostPorts::new(paths.try_into().unwrap());
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        let board = spawn(move || run(&ports, &flag).unwrap());
        Self { lines, folder: tempfile::tempdir().unwrap(), stop, threads: vec![board] }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    /// Runs the program in the bench's folder; `PORT` in its arguments stands for the board's host port.
    pub fn run(&self, arguments: &[&str]) -> Outcome {
        self.run_until(arguments, usize::MAX)
    }

    /// The same; the cable breaks when this many bytes have gone to the board.
    pub fn run_until(&self, arguments: &[&str], bytes_to_board: usize) -> Outcome {
        let cable = Arc::new(Pty::open().unwrap());
        let path = cable.path().to_owned();
        let over = Arc::new(AtomicBool::new(false));
        let carriers = [true, false].map(|to_board| {
            let (cable, lines, over) = (Arc::clone(&cable), self.lines.clone(), Arc::clone(&over));
            spawn(move || carry(&cable, &lines.0[Port::Host as usize], to_board, bytes_to_board, &over))
        });
        // Only the carriers hold it now: when they let go, the device is gone.
        drop(cable);
        let arguments: Vec<String> = arguments.iter().map(|argument| argument.replace("PORT", &path)).collect();
        let output = program(self.folder.path(), &arguments);
        over.store(true, Ordering::Relaxed);
        carriers.into_iter().for_each(|carrier| carrier.join().unwrap());
        output
    }

    /// Runs it, expects success; what it printed.
    pub fn good(&self, arguments: &[&str]) -> String {
        self.run(arguments).good(&format!("{arguments:?}"))
    }

    pub fn json(&self, arguments: &[&str]) -> serde_json::Value {
        self.run(&[arguments, &["--json"]].concat()).json()
    }

    /// Runs it, expects one line of complaint and nothing else.
    pub fn complaint(&self, arguments: &[&str]) -> String {
        let outcome = self.run(arguments);
        outcome.complaint(&format!("{arguments:?}"))
    }

    /// The board's value of a parameter.
    pub fn value(&self, name: &str) -> f64 {
        self.json(&["params", "get", "PORT", name])["parameters"][0]["value"].as_f64().unwrap()
    }

    /// What the board sends on a device port comes back to it.
    pub fn join_ports(&mut self) {
        for port in Port::DEVICES {
            let (lines, stop) = (self.lines.clone(), Arc::clone(&self.stop));
            self.threads.push(spawn(move || {
                let mut buffer = [0; 256];
                while !stop.load(Ordering::Relaxed) {
                    let Ok(count) = lines.0[port as usize].read(&mut buffer, 20) else { return };
                    let _ = lines.0[port as usize].write_all(&buffer[..count]);
                }
            }));
        }
    }

    /// A simulated vehicle on the device ports.
    pub fn simulate(&mut self, scenario: Scenario) {
        self.threads.push(simulate(self.lines.clone(), scenario, Arc::clone(&self.stop)));
    }
}

/// A simulated vehicle on a board's device ports, at the speed of the clock, until it is stopped.
pub fn simulate(mut lines: impl Ports + Send + 'static, scenario: Scenario, stop: Arc<AtomicBool>) -> JoinHandle<()> {
    spawn(move || {
        let (mut world, mut devices) = (World::new(&scenario), Devices::new(&scenario));
        let begun = Instant::now();
        while !stop.load(Ordering::Relaxed) {
            sleep(Duration::from_millis(5));
            let now_us = begun.elapsed().as_micros() as u64;
            let mut until_us = 0;
            while until_us < now_us {
                until_us = devices.next_us().unwrap_or(now_us).min(now_us);
                world.advance(until_us, &mut |observation| devices.observe(observation));
                world.set_actuator_targets(until_us, devices.run(until_us));
            }
            for (port, arrival) in devices.arrivals(now_us) {
                // until the board reads, for its first two seconds, a line may be full
                let _ = lines.write(port, &arrival.bytes);
            }
            for port in Port::DEVICES {
                let mut bytes = Vec::new();
                if lines.poll(port, &mut bytes).is_err() {
                    return; // the board is gone, and whoever talks to it will say so
                }
                devices.sent_by_backseat(port, now_us, &bytes);
            }
        }
    })
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            let ended = thread.join();
            assert!(ended.is_ok() || std::thread::panicking(), "a thread of the bench panicked");
        }
    }
}

/// One direction of the cable between the program and the board.
pub fn carry(cable: &Pty, board: &Pty, to_board: bool, mut left: usize, over: &AtomicBool) {
    let (from, to) = if to_board { (cable, board) } else { (board, cable) };
    while !over.load(Ordering::Relaxed) {
        let mut buffer = [0; 1024];
        let count = from.read(&mut buffer, 20).unwrap();
        let sent = if to_board { count.min(left) } else { count };
        if to.write_all(&buffer[..sent]).is_err() {
            continue; // nobody reads: the program has ended
        }
        if to_board {
            left -= sent;
            if left == 0 {
                over.store(true, Ordering::Relaxed);
            }
        }
    }
}

impl Ports for Lines {
    fn write(&mut self, port: Port, bytes: &[u8]) -> Result<(), BackseatError> {
        self.0[port as usize].write_all(bytes).map_err(|error| BackseatError::Port { port, error })
    }

    fn read(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        let seconds = HANG.as_secs() as u32;
        for _ in 0..seconds * 5 {
            let before = received.len();
            read(&self.0[port as usize], port, received, 200)?;
            if received.len() > before {
                return Ok(());
            }
        }
        Err(BackseatError::Silent { port, seconds })
    }

    fn poll(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        read(&self.0[port as usize], port, received, 0)
    }

    fn patience(&self) -> Duration {
        HANG
    }
}

fn read(pty: &Pty, port: Port, received: &mut Vec<u8>, timeout_ms: u32) -> Result<(), BackseatError> {
    let mut buffer = [0; 4096];
    let count = pty.read(&mut buffer, timeout_ms).map_err(|error| BackseatError::Port { port, error })?;
    received.extend_from_slice(&buffer[..count]);
    Ok(())
}
