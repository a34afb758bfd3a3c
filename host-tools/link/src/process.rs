//! A program as a process of its own on pseudo-terminals: the app, or the ship's topside.

use crate::pty::Pty;
use crate::{BackseatError, Ports};
use backseat_wire::hostlink::Port;
use std::io;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// After this long a silent process is given up.
const PATIENCE_S: u32 = 10;
const POLL_MS: u32 = 200;

/// A process on pseudo-terminals; it is ended when this is dropped.
pub struct Process {
    child: Child,
    /// In the order of [`Port::ALL`]; a program need not have all of them.
    ports: [Option<Pty>; 5],
}

impl Process {
    /// Starts `program __backseat PORT…`, with the paths of five fresh pseudo-terminals.
    ///
    /// # Errors
    /// When a pseudo-terminal cannot be opened or the program cannot be started.
    pub fn spawn(program: &Path) -> io::Result<Self> {
        Self::start(&Port::ALL, |paths| {
            let mut command = Command::new(program);
            command.arg("__backseat").args(paths);
            Ok(command)
        })
    }

    /// Starts the command that is given the paths of a fresh pseudo-terminal for each of `lines`, in their order.
    ///
    /// # Errors
    /// When a pseudo-terminal cannot be opened or the program cannot be started; what `command` fails of.
    pub fn start(lines: &[Port], command: impl FnOnce(&[&str]) -> io::Result<Command>) -> io::Result<Self> {
        let mut ports = [const { None }; 5];
        for port in lines {
            ports[*port as usize] = Some(Pty::open()?);
        }
        let paths: Vec<&str> = lines.iter().filter_map(|port| ports[*port as usize].as_ref()).map(Pty::path).collect();
        let child = command(&paths)?
            .stdin(Stdio::null())
            // Ctrl-C is for the simulator, which then ends the process in order.
            .process_group(0)
            .spawn()?;
        Ok(Self { child, ports })
    }

    /// Paths of the process' ends.
    pub fn paths(&self) -> impl Iterator<Item = &str> {
        self.ports.iter().flatten().map(Pty::path)
    }

    /// Its process id.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Whether it runs.
    ///
    /// # Errors
    /// [`BackseatError::Died`].
    pub fn check_alive(&mut self) -> Result<(), BackseatError> {
        match self.child.try_wait() {
            Ok(Some(status)) => Err(BackseatError::Died(status)),
            _ => Ok(()),
        }
    }

    fn read_for(&mut self, port: Port, received: &mut Vec<u8>, timeout_ms: u32) -> Result<usize, BackseatError> {
        // nothing comes on a line that it does not have
        let Some(line) = &self.ports[port as usize] else { return Ok(0) };
        let mut buffer = [0; 4096];
        let count = line.read(&mut buffer, timeout_ms).map_err(|error| BackseatError::Port { port, error })?;
        received.extend_from_slice(&buffer[..count]);
        Ok(count)
    }
}

impl Ports for Process {
    fn write(&mut self, port: Port, bytes: &[u8]) -> Result<(), BackseatError> {
        let Some(line) = &self.ports[port as usize] else {
            return Err(BackseatError::Port { port, error: io::ErrorKind::Unsupported.into() });
        };
        let outcome = line.write_all(bytes);
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
