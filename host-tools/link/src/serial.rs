//! A board on serial ports of this machine: all five, or its host port alone.

use crate::port_name::PortName;
use crate::{BackseatError, Ports};
use anyhow::{Context, anyhow, bail};
use backseat_wire::hostlink::Port;
use serialport::{ClearBuffer, SerialPort, TTYPort};
use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

/// After this long a silent board is given up, in a flight; and on the bench, where it sends telemetry ten times a
/// second, or is asked.
const PATIENCE: Duration = Duration::from_secs(10);
const BENCH_PATIENCE: Duration = Duration::from_secs(4);
/// A short time-out: reading waits in [`Ports::read`], where it is counted.
const POLL: Duration = Duration::from_millis(100);

/// A board at the other end of its cables.
pub struct Serial {
    /// In the order of [`Port::ALL`].
    ports: [Option<TTYPort>; 5],
    patience: Duration,
}

/// How many times slower than its own time the board may be: 1, but for one that is emulated (`BACKSEAT_SLOWNESS`).
#[must_use]
pub fn slowness() -> u32 {
    std::env::var("BACKSEAT_SLOWNESS").ok().and_then(|text| text.parse().ok()).filter(|times| *times > 0).unwrap_or(1)
}

fn open(name: &PortName) -> anyhow::Result<TTYPort> {
    name.open(POLL).with_context(|| format!("{name}: cannot be opened as a serial port"))
}

impl Serial {
    /// Opens `frontseat,dvl,ahrs,modem,host`: paths with commas between them, each perhaps with `:baud`.
    ///
    /// # Errors
    /// When these are not five, or one cannot be opened.
    pub fn open(list: &str) -> anyhow::Result<Self> {
        let paths: Vec<&str> = list.split(',').collect();
        if paths.len() != Port::ALL.len() {
            bail!("{list}: expected five ports separated by commas: frontseat,dvl,ahrs,modem,host");
        }
        let mut ports = [const { None }; 5];
        for ((port, path), baud) in ports.iter_mut().zip(paths).zip(Port::DEFAULT_BAUD) {
            *port = Some(open(&PortName::parse(path, baud).map_err(|why| anyhow!("{path}: {why}"))?)?);
        }
        Ok(Self { ports, patience: PATIENCE })
    }

    /// Opens the host port alone; the other ports of the board lead elsewhere.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn host(name: &PortName) -> anyhow::Result<Self> {
        let mut ports = [const { None }; 5];
        ports[Port::Host as usize] = Some(open(name)?);
        Ok(Self { ports, patience: BENCH_PATIENCE * slowness() })
    }

    /// Forgets what has come by now.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn discard(&self) -> anyhow::Result<()> {
        self.ports.iter().flatten().try_for_each(|port| Ok(port.clear(ClearBuffer::Input)?))
    }

    fn device(&mut self, port: Port) -> Result<&mut TTYPort, BackseatError> {
        let error = || BackseatError::Port { port, error: ErrorKind::Unsupported.into() };
        self.ports[port as usize].as_mut().ok_or_else(error)
    }

    /// Reads once; how much came before the time-out.
    fn read_once(&mut self, port: Port, received: &mut Vec<u8>) -> Result<usize, BackseatError> {
        let mut buffer = [0; 4096];
        match self.device(port)?.read(&mut buffer) {
            // Not a time-out: the device was unplugged.
            Ok(0) => Err(BackseatError::Port { port, error: ErrorKind::UnexpectedEof.into() }),
            Ok(count) => {
                received.extend_from_slice(&buffer[..count]);
                Ok(count)
            }
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => Ok(0),
            Err(error) => Err(BackseatError::Port { port, error }),
        }
    }
}

impl Ports for Serial {
    fn write(&mut self, port: Port, bytes: &[u8]) -> Result<(), BackseatError> {
        self.device(port)?.write_all(bytes).map_err(|error| BackseatError::Port { port, error })
    }

    fn read(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        let begun = Instant::now();
        while begun.elapsed() < self.patience {
            if self.read_once(port, received)? > 0 {
                return Ok(());
            }
        }
        Err(BackseatError::Silent { port, seconds: self.patience.as_secs() as u32 })
    }

    fn poll(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        let waiting = self.device(port)?.bytes_to_read();
        if waiting.map_err(|error| BackseatError::Port { port, error: error.into() })? > 0 {
            self.read_once(port, received)?;
        }
        Ok(())
    }
}
