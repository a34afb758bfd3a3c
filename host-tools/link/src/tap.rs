//! A second connection to the host port, for an observer of the flight.

use crate::pty::Pty;
use crate::{BackseatError, Ports};
use backseat_wire::hostlink::Port;
use std::io;
use std::time::Duration;

/// Ports of a backseat whose host port a second program can read and write.
///
/// What is asked there reaches the board and no session log, so this is for flights that are not replayed to the bit.
pub struct Tap<P> {
    ports: P,
    cable: Pty,
}

impl<P: Ports> Tap<P> {
    /// With a fresh pseudo-terminal for the watcher.
    ///
    /// # Errors
    /// When no pseudo-terminal can be opened.
    pub fn new(ports: P) -> io::Result<Self> {
        let cable = Pty::open()?;
        cable.never_block()?;
        Ok(Self { ports, cable })
    }

    /// Where the watcher listens.
    pub fn path(&self) -> &str {
        self.cable.path()
    }

    /// Hands on what came after `from`, as far as the watcher keeps up, and what he asks.
    fn relay(&mut self, port: Port, received: &[u8], from: usize) -> Result<(), BackseatError> {
        if port != Port::Host {
            return Ok(());
        }
        let failed = |error| BackseatError::Port { port, error };
        if let Some(new) = received.get(from..).filter(|new| !new.is_empty()) {
            self.cable.offer(new).map_err(failed)?;
        }
        let mut buffer = [0; 256];
        let count = self.cable.read(&mut buffer, 0).map_err(failed)?;
        if count > 0 {
            self.ports.write(port, &buffer[..count])?;
        }
        Ok(())
    }
}

impl<P: Ports> Ports for Tap<P> {
    fn write(&mut self, port: Port, bytes: &[u8]) -> Result<(), BackseatError> {
        self.ports.write(port, bytes)
    }

    fn read(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        let from = received.len();
        self.ports.read(port, received)?;
        self.relay(port, received, from)
    }

    fn poll(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        let from = received.len();
        self.ports.poll(port, received)?;
        self.relay(port, received, from)
    }

    fn patience(&self) -> Duration {
        self.ports.patience()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Write};

    /// A board that repeats one message and keeps the bytes that it receives.
    #[derive(Default)]
    struct Talker {
        received: Vec<u8>,
    }

    impl Ports for Talker {
        fn write(&mut self, port: Port, bytes: &[u8]) -> Result<(), BackseatError> {
            assert_eq!(port, Port::Host);
            self.received.extend_from_slice(bytes);
            Ok(())
        }

        fn read(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
            self.poll(port, received)
        }

        fn poll(&mut self, _: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
            received.extend_from_slice(b"telemetry ");
            Ok(())
        }
    }

    #[test]
    fn a_watcher_hears_and_asks_and_never_holds_up_the_flight() {
        let mut tap = Tap::new(Talker::default()).unwrap();
        let mut watcher = std::fs::File::options().read(true).write(true).open(tap.path()).unwrap();
        let mut received = Vec::new();
        tap.poll(Port::Dvl, &mut received).unwrap();
        tap.poll(Port::Host, &mut received).unwrap();
        assert_eq!(received, b"telemetry telemetry ");
        let mut heard = [0; 10];
        watcher.read_exact(&mut heard).unwrap();
        assert_eq!(&heard, b"telemetry ", "of the host port only");
        watcher.write_all(b"who?").unwrap();
        while tap.ports.received.is_empty() {
            tap.read(Port::Host, &mut received).unwrap();
        }
        assert_eq!(tap.ports.received, b"who?");
        // far beyond what a terminal holds for a program that does not read
        for _ in 0..10_000 {
            tap.poll(Port::Host, &mut Vec::new()).unwrap();
        }
    }
}
