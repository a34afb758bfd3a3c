//! A board on five serial ports of this machine.

use crate::board::PortName;
use crate::{BackseatError, Ports};
use anyhow::{Context, anyhow, bail};
use backseat_wire::hostlink::Port;
use serialport::{SerialPort, TTYPort};
use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

/// After this long a silent board is given up.
const PATIENCE: Duration = Duration::from_secs(10);
const POLL: Duration = Duration::from_millis(200);

/// A board at the other end of five cables.
pub struct Serial {
    ports: Vec<TTYPort>,
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
        let open = |(path, default): (&&str, u32)| {
            let device = PortName::parse(path, default).map_err(|why| anyhow!("{path}: {why}"))?;
            // A short time-out: reading waits in `read` below, where it is counted.
            device.open(POLL).with_context(|| device.to_string())
        };
        Ok(Self { ports: paths.iter().zip(Port::DEFAULT_BAUD).map(open).collect::<anyhow::Result<_>>()? })
    }

    /// Reads once; how much came before the time-out.
    fn read_once(&mut self, port: Port, received: &mut Vec<u8>) -> Result<usize, BackseatError> {
        let mut buffer = [0; 4096];
        match self.ports[port as usize].read(&mut buffer) {
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
        self.ports[port as usize].write_all(bytes).map_err(|error| BackseatError::Port { port, error })
    }

    fn read(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            if self.read_once(port, received)? > 0 {
                return Ok(());
            }
        }
        Err(BackseatError::Silent { port, seconds: PATIENCE.as_secs() as u32 })
    }

    fn poll(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        let waiting = self.ports[port as usize]
            .bytes_to_read()
            .map_err(|error| BackseatError::Port { port, error: error.into() })?;
        if waiting > 0 {
            self.read_once(port, received)?;
        }
        Ok(())
    }
}
