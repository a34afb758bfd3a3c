//! The app as a process of its own on five pseudo-terminals.

use crate::pty::Pty;
use crate::{BackseatError, Ports};
use backseat_wire::hostlink::Port;
use std::io;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// After this long a silent backseat is given up.
const PATIENCE_S: u32 = 10;
const POLL_MS: u32 = 200;

/// A backseat process; it is ended when this is dropped.
pub struct Process {
    child: Child,
    ports: Vec<Pty>,
}

impl Process {
    /// Starts `program __backseat PORT…`, with the paths of five fresh pseudo-terminals.
    ///
    /// # Errors
    /// When a pseudo-terminal cannot be opened or the program cannot be started.
    pub fn spawn(program: &Path) -> io::Result<Self> {
        let ports = Port::ALL.iter().map(|_| Pty::open()).collect::<io::Result<Vec<_>>>()?;
        let child = Command::new(program)
            .arg("__backseat")
            .args(ports.iter().map(Pty::path))
            .stdin(Stdio::null())
            // Ctrl-C is for the simulator, which then ends the backseat in order.
            .process_group(0)
            .spawn()?;
        Ok(Self { child, ports })
    }

    /// Paths of the backseat's ends.
    pub fn paths(&self) -> impl Iterator<Item = &str> {
        self.ports.iter().map(Pty::path)
    }

    /// Process id of the backseat.
    #[must_use]
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    fn check_alive(&mut self) -> Result<(), BackseatError> {
        match self.child.try_wait() {
            Ok(Some(status)) => Err(BackseatError::Died(status)),
            _ => Ok(()),
        }
    }

    fn read_for(&mut self, port: Port, received: &mut Vec<u8>, timeout_ms: u32) -> Result<usize, BackseatError> {
        let mut buffer = [0; 4096];
        let count = self.ports[port as usize]
            .read(&mut buffer, timeout_ms)
            .map_err(|error| BackseatError::Port { port, error })?;
        received.extend_from_slice(&buffer[..count]);
        Ok(count)
    }
}

impl Ports for Process {
    fn write(&mut self, port: Port, bytes: &[u8]) -> Result<(), BackseatError> {
        let outcome = self.ports[port as usize].write_all(bytes);
        if outcome.is_err() {
            self.check_alive()?;
        }
        outcome.map_err(|error| BackseatError::Port { port, error })
    }

    fn read(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        for _ in 0..PATIENCE_S * 1000 / POLL_MS {
            if self.read_for(port, received, POLL_MS)? > 0 {
                return Ok(());
            }
            self.check_alive()?;
        }
        Err(BackseatError::Silent { port, seconds: PATIENCE_S })
    }

    fn poll(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        if self.read_for(port, received, 0)? == 0 {
            self.check_alive()?;
        }
        Ok(())
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Both fail only when it has ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
