//! The board's host port: one serial device of this machine.

use crate::{BackseatError, Ports};
use anyhow::Context;
use backseat_wire::hostlink::Port;
use serialport::{ClearBuffer, SerialPort, TTYPort};
use std::fmt;
use std::io::{ErrorKind, Read, Write};
use std::path::Path;
use std::str::FromStr;
use std::time::{Duration, Instant};

/// A board that is silent for this long is not there: it sends telemetry ten times a second, or is asked.
const PATIENCE: Duration = Duration::from_secs(4);
const POLL: Duration = Duration::from_millis(100);

/// A serial device, as `PATH` or `PATH:BAUD`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PortName {
    path: String,
    baud: u32,
}

impl PortName {
    /// `PATH`, at this rate, or `PATH:BAUD`.
    ///
    /// # Errors
    /// If what stands behind the colon is no baud rate.
    pub fn parse(text: &str, default_baud: u32) -> Result<Self, String> {
        // A device may have colons in its own name.
        match text.rsplit_once(':').filter(|_| !Path::new(text).exists()) {
            Some((path, baud)) => match baud.parse() {
                Ok(baud) if baud > 0 => Ok(Self { path: path.to_owned(), baud }),
                _ => Err(format!("{baud}: not a baud rate; expected a whole number such as 115200")),
            },
            None => Ok(Self { path: text.to_owned(), baud: default_baud }),
        }
    }

    /// Opens the device; a read or a write waits no longer than this.
    ///
    /// # Errors
    /// If it cannot be opened as a serial port.
    pub fn open(&self, timeout: Duration) -> serialport::Result<TTYPort> {
        serialport::new(&self.path, self.baud).timeout(timeout).preserve_dtr_on_open().open_native()
    }

    /// Path of the device.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// The same device at another rate.
    pub fn with_baud(&self, baud: u32) -> Self {
        Self { path: self.path.clone(), baud }
    }
}

impl FromStr for PortName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::parse(text, Port::DEFAULT_BAUD[Port::Host as usize])
    }
}

impl fmt::Display for PortName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.path)
    }
}

/// The open port.
pub struct HostPort(TTYPort);

impl HostPort {
    /// Opens the port.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn open(name: &PortName) -> anyhow::Result<Self> {
        // A short time-out: reading waits in `read` below, where it is counted.
        name.open(POLL).map(Self).with_context(|| format!("{name}: cannot be opened as a serial port"))
    }

    /// Forgets what has come by now.
    pub fn discard(&self) -> anyhow::Result<()> {
        Ok(self.0.clear(ClearBuffer::Input)?)
    }

    /// Reads once; how much came before the time-out.
    fn read_once(&mut self, received: &mut Vec<u8>) -> Result<usize, BackseatError> {
        let mut buffer = [0; 4096];
        match self.0.read(&mut buffer) {
            // Not a time-out: the device was unplugged.
            Ok(0) => Err(BackseatError::Port { port: Port::Host, error: ErrorKind::UnexpectedEof.into() }),
            Ok(count) => {
                received.extend_from_slice(&buffer[..count]);
                Ok(count)
            }
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => Ok(0),
            Err(error) => Err(BackseatError::Port { port: Port::Host, error }),
        }
    }
}

/// The other ports of the board lead elsewhere.
fn only_host(port: Port) -> Result<(), BackseatError> {
    let error = || BackseatError::Port { port, error: ErrorKind::Unsupported.into() };
    if port == Port::Host { Ok(()) } else { Err(error()) }
}

impl Ports for HostPort {
    fn write(&mut self, port: Port, bytes: &[u8]) -> Result<(), BackseatError> {
        only_host(port)?;
        self.0.write_all(bytes).map_err(|error| BackseatError::Port { port, error })
    }

    fn read(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        only_host(port)?;
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            if self.read_once(received)? > 0 {
                return Ok(());
            }
        }
        Err(BackseatError::Silent { port, seconds: PATIENCE.as_secs() as u32 })
    }

    fn poll(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        only_host(port)?;
        let waiting = self.0.bytes_to_read().map_err(|error| BackseatError::Port { port, error: error.into() })?;
        if waiting > 0 {
            self.read_once(received)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_and_without_a_rate() {
        let name = |path: &str, baud| PortName { path: path.to_owned(), baud };
        assert_eq!("/dev/ttyACM0".parse(), Ok(name("/dev/ttyACM0", 115_200)));
        assert_eq!("/dev/ttyACM0:921600".parse(), Ok(name("/dev/ttyACM0", 921_600)));
        for wrong in ["fast", "0"] {
            let refused = format!("/dev/x:{wrong}").parse::<PortName>().unwrap_err();
            assert!(refused.starts_with(&format!("{wrong}: not a baud rate")), "{refused}");
        }
    }
}
