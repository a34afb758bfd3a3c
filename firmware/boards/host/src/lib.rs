//! The backseat app as a Linux process on pseudo-terminals or serial ports.
//!
//! [`run`] opens the five ports, and then pumps: it sleeps in the kernel until a port is ready or
//! the next step is due. There is no other thread and no busy waiting.

mod port;

use anyhow::{Context, Result, anyhow};
use backseat_app::{App, PortFailure, Progress, Pump};
use backseat_wire::hostlink::Port;
use mio::{Events, Poll, Token};
use port::Serial;
use std::fmt::Display;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// A serial port to open.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PortSettings {
    /// Device, e.g. `/dev/ttyUSB0` or `/dev/pts/3`.
    pub path: PathBuf,
    /// Baud rate; a pseudo-terminal ignores it.
    pub baud: u32,
}

/// The five ports of the backseat.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HostPorts {
    /// In the order of [`Port::ALL`]: frontseat, DVL, AHRS, modem, host.
    pub ports: [PortSettings; 5],
}

/// Default baud rates, in the order of [`Port::ALL`].
pub const DEFAULT_BAUD: [u32; 5] = [19_200, 115_200, 115_200, 19_200, 115_200];
/// Names of the ports, in the order of [`Port::ALL`].
pub const PORT_NAMES: [&str; 5] = ["frontseat", "dvl", "ahrs", "modem", "host"];

/// How often the stop flag is looked at while nothing happens.
const STOP_INTERVAL: Duration = Duration::from_millis(100);

impl HostPorts {
    /// These devices, in the order of [`Port::ALL`], at [`DEFAULT_BAUD`].
    #[must_use]
    pub fn new(paths: [PathBuf; 5]) -> Self {
        let mut baud = DEFAULT_BAUD.into_iter();
        Self { ports: paths.map(|path| PortSettings { path, baud: baud.next().unwrap_or(115_200) }) }
    }
}

/// Runs the backseat on these ports until `stop` is set (looked at every 0.1 s).
///
/// # Errors
/// A port that cannot be opened, or that vanished: one line that names it.
pub fn run(ports: &HostPorts, stop: &AtomicBool) -> Result<()> {
    let mut app = Box::new(App::new());
    let mut poll = Poll::new().context("cannot poll")?;
    let mut serial = open(ports, &poll)?;
    let mut events = Events::with_capacity(16);
    let mut pump = Pump::new();
    let start = Instant::now();
    while !stop.load(Ordering::Relaxed) {
        let now_us = micros(start);
        let progress = pump
            .poll(&mut app, &mut serial, now_us)
            .map_err(|PortFailure { port, error }| vanished(ports, port as usize, error))?;
        let Progress::IdleUntil(until_us) = progress else { continue };
        let wait = until_us.map_or(STOP_INTERVAL, |us| Duration::from_micros(us.saturating_sub(micros(start))));
        // The kernel's timeout has milliseconds; rounded up by mio, so that a step is never polled for.
        match poll.poll(&mut events, Some(wait.min(STOP_INTERVAL))) {
            Err(error) if error.kind() != std::io::ErrorKind::Interrupted => return Err(error).context("cannot poll"),
            _ => {}
        }
        for event in &events {
            let Token(i) = event.token();
            // The pump would only notice at its next read or write.
            if event.is_read_closed() || event.is_error() {
                return Err(vanished(ports, i, "hung up"));
            }
            if let Some(serial) = serial.get_mut(i) {
                serial.set_ready(event.is_readable(), event.is_writable());
            }
        }
    }
    Ok(())
}

fn micros(start: Instant) -> u64 {
    u64::try_from(start.elapsed().as_micros()).unwrap_or(u64::MAX)
}

fn open(ports: &HostPorts, poll: &Poll) -> Result<[Serial; 5]> {
    let mut serial = Vec::new();
    for (i, (settings, name)) in ports.ports.iter().zip(PORT_NAMES).enumerate() {
        let path = settings.path.to_str().with_context(|| format!("{name}: path is not UTF-8"))?;
        let opened = Serial::open(path, settings.baud, poll.registry(), Token(i));
        serial.push(opened.with_context(|| format!("{name}: cannot open {path} as a serial port"))?);
    }
    serial.try_into().map_err(|_| anyhow!("five ports are needed"))
}

fn vanished(ports: &HostPorts, i: usize, how: impl Display) -> anyhow::Error {
    anyhow!("{}: {} vanished ({how})", PORT_NAMES[i], ports.ports[i].path.display())
}

// `Port` as an index is the order of `Port::ALL`.
const _: () = assert!(Port::Frontseat as usize == 0 && Port::Host as usize == 4);
