//! The host port, through unplugging and replugging.

use anyhow::Context;
use backseat_link::board::PortName;
use backseat_link::{BackseatError, Ports, Pty, Serial};
use backseat_wire::hostlink::{MAX_FRAME, Port, ToBoard, encode};
use std::io::ErrorKind;

/// How often a port that is gone is looked for, µs.
const RETRY_US: u64 = 300_000;

/// What became of the port.
#[derive(Debug)]
pub enum News {
    Lost(String),
    Found,
}

/// The port, with bytes that arrived before discarded.
fn fresh(name: &PortName) -> anyhow::Result<Serial> {
    let port = Serial::host(name)?;
    port.discard()?;
    Ok(port)
}

/// A port that comes back, and that other commands can use meanwhile.
pub struct Link {
    name: PortName,
    port: Option<Serial>,
    retry_us: u64,
    shared: Shared,
    watched: Option<Shared>,
}

/// A second port with the same board behind it, for `params`, `mission` and the like while this one is taken.
struct Shared {
    cable: Pty,
    /// Of a frame that is not whole yet: frames of two programs must not mix.
    asked: Vec<u8>,
}

impl Shared {
    fn open() -> std::io::Result<Self> {
        let cable = Pty::open()?;
        cable.never_block()?;
        Ok(Self { cable, asked: Vec::new() })
    }

    /// Hands on what the board said, as far as somebody reads it; whole frames that are asked there.
    fn relay(&mut self, heard: &[u8]) -> Vec<u8> {
        if !heard.is_empty() {
            let _ = self.cable.offer(heard);
        }
        let mut buffer = [0; 256];
        if let Ok(count) = self.cable.read(&mut buffer, 0) {
            self.asked.extend_from_slice(&buffer[..count]);
        }
        if self.asked.len() > 4 * MAX_FRAME {
            // nobody's frame is so long
            self.asked.clear();
        }
        let whole = self.asked.iter().rposition(|byte| *byte == 0).map_or(0, |end| end + 1);
        self.asked.drain(..whole).collect()
    }
}

impl Link {
    /// Opens the port; it has to be there.
    pub fn open(name: &PortName) -> anyhow::Result<Self> {
        let shared = Shared::open().context("a port for other commands")?;
        Ok(Self { name: name.clone(), port: Some(fresh(name)?), retry_us: 0, shared, watched: None })
    }

    /// Opens one more port, where a program that stays, such as `monitor`, keeps no command away from the other; its path.
    pub fn watch(&mut self) -> anyhow::Result<&str> {
        let opened = Shared::open().context("a port to watch at")?;
        Ok(self.watched.insert(opened).cable.path())
    }

    /// Where other commands reach the board meanwhile.
    pub fn shared(&self) -> &str {
        self.shared.cable.path()
    }

    /// Appends what has come.
    pub fn poll(&mut self, now_us: u64, received: &mut Vec<u8>) -> Option<News> {
        let Some(port) = &mut self.port else {
            if now_us < self.retry_us {
                return None;
            }
            self.retry_us = now_us + RETRY_US;
            self.port = fresh(&self.name).ok();
            return self.port.is_some().then_some(News::Found);
        };
        let from = received.len();
        let mut outcome = port.poll(Port::Host, received);
        let heard = received.get(from..).unwrap_or_default();
        let mut asked = self.shared.relay(heard);
        if let Some(watched) = &mut self.watched {
            asked.append(&mut watched.relay(heard));
        }
        if outcome.is_ok() && !asked.is_empty() {
            outcome = port.write(Port::Host, &asked);
        }
        match outcome {
            Err(BackseatError::Port { error, .. }) if error.kind() == ErrorKind::TimedOut => None,
            Err(error) => Some(self.give_up(now_us, &error)),
            Ok(()) => None,
        }
    }

    /// Sends a question. A line that does not take it just now is not lost.
    pub fn send(&mut self, now_us: u64, message: &ToBoard<'_>) -> Option<News> {
        let port = self.port.as_mut()?;
        let mut buffer = [0; MAX_FRAME];
        let frame = encode(message, &mut buffer).ok()?;
        match port.write(Port::Host, frame) {
            Err(BackseatError::Port { error, .. }) if error.kind() == ErrorKind::TimedOut => None,
            Err(error) => Some(self.give_up(now_us, &error)),
            Ok(()) => None,
        }
    }

    /// Lets go of the device, so that its name is free when it comes back.
    fn give_up(&mut self, now_us: u64, error: &BackseatError) -> News {
        self.port = None;
        self.retry_us = now_us + RETRY_US;
        let why = match error {
            BackseatError::Port { error, .. } => error.to_string(),
            error => error.to_string(),
        };
        News::Lost(why)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Write};

    #[test]
    fn what_others_ask_passes_in_whole_frames_and_what_the_board_says_reaches_them() {
        let mut shared = Shared::open().unwrap();
        let mut other = std::fs::File::options().read(true).write(true).open(shared.cable.path()).unwrap();
        other.write_all(&[0, 7, 7, 0, 0, 9]).unwrap();
        assert_eq!(shared.relay(b"telemetry"), [0, 7, 7, 0, 0], "the frame begun is held back");
        let mut heard = [0; 9];
        other.read_exact(&mut heard).unwrap();
        assert_eq!(&heard, b"telemetry");
        other.write_all(&[9, 0]).unwrap();
        assert_eq!(shared.relay(&[]), [9, 9, 0]);
        // far beyond what a terminal holds for a program that does not read
        (0..10_000).for_each(|_| assert!(shared.relay(b"telemetry").is_empty()));
    }

    /// Each in a lock of its own.
    #[test]
    fn who_watches_keeps_no_command_away() {
        let board = Pty::open().unwrap();
        let mut link = Link::open(&board.path().parse().unwrap()).unwrap();
        let mut received = Vec::new();
        let paths = [link.watch().unwrap().to_owned(), link.shared().to_owned()];
        let mut others = paths.map(|path| Serial::host(&path.parse().unwrap()).unwrap());
        for (frame, other) in [[1, 0], [2, 0]].iter().zip(&mut others) {
            other.write(Port::Host, frame).unwrap();
        }
        let mut asked = Vec::new();
        while asked.len() < 4 {
            link.poll(0, &mut received);
            let mut buffer = [0; 16];
            let count = board.read(&mut buffer, 100).unwrap();
            asked.extend_from_slice(&buffer[..count]);
        }
        assert!([[2, 0, 1, 0], [1, 0, 2, 0]].iter().any(|frames| asked == frames), "{asked:?}");
        board.offer(b"telemetry").unwrap();
        for other in &mut others {
            let mut heard = Vec::new();
            while heard.len() < 9 {
                link.poll(0, &mut received);
                other.poll(Port::Host, &mut heard).unwrap();
            }
            assert_eq!(heard, b"telemetry");
        }
    }
}
