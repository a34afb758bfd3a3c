//! The app inside this process, on ports in memory: no operating system in between, for studies of
//! many flights. The same app, pump and host link as on any board.

use super::{BackseatError, Ports};
use backseat_app::{App, Progress, Pump};
use backseat_wire::hostlink::Port;
use std::collections::VecDeque;
use std::convert::Infallible;

/// A port in memory.
#[derive(Debug, Default)]
struct Memory {
    to_board: VecDeque<u8>,
    from_board: Vec<u8>,
}

impl embedded_io::ErrorType for Memory {
    type Error = Infallible;
}

impl embedded_io::Read for Memory {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        let count = buffer.len().min(self.to_board.len());
        for (slot, byte) in buffer.iter_mut().zip(self.to_board.drain(..count)) {
            *slot = byte;
        }
        Ok(count)
    }
}

impl embedded_io::ReadReady for Memory {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!self.to_board.is_empty())
    }
}

impl embedded_io::Write for Memory {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.from_board.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl embedded_io::WriteReady for Memory {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(true)
    }
}

/// The app in this process.
pub struct InProcess {
    app: Box<App>,
    pump: Pump,
    ports: [Memory; 5],
}

impl Default for InProcess {
    fn default() -> Self {
        Self::new()
    }
}

impl InProcess {
    /// As after power-up.
    #[must_use]
    pub fn new() -> Self {
        Self { app: Box::new(App::new()), pump: Pump::new(), ports: Default::default() }
    }

    /// Lets the app work until it has nothing left to do.
    fn run(&mut self) {
        // Time zero: the lock-step clock is the only one here.
        while let Ok(Progress::Moved) = self.pump.poll(&mut self.app, &mut self.ports, 0) {}
    }
}

impl Ports for InProcess {
    fn write(&mut self, port: Port, bytes: &[u8]) -> Result<(), BackseatError> {
        self.ports[port as usize].to_board.extend(bytes);
        Ok(())
    }

    fn read(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        self.poll(port, received)?;
        if received.is_empty() { Err(BackseatError::Silent { port, seconds: 0 }) } else { Ok(()) }
    }

    fn poll(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        if self.ports[port as usize].from_board.is_empty() {
            self.run();
        }
        received.append(&mut self.ports[port as usize].from_board);
        Ok(())
    }
}
