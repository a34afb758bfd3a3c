//! The host port, through unplugging and replugging.

use backseat_link::board::{HostPort, PortName};
use backseat_link::{BackseatError, Ports};
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
fn fresh(name: &PortName) -> anyhow::Result<HostPort> {
    let port = HostPort::open(name)?;
    port.discard()?;
    Ok(port)
}

/// A port that comes back.
pub struct Link {
    name: PortName,
    port: Option<HostPort>,
    retry_us: u64,
}

impl Link {
    /// Opens the port; it has to be there.
    pub fn open(name: &PortName) -> anyhow::Result<Self> {
        Ok(Self { name: name.clone(), port: Some(fresh(name)?), retry_us: 0 })
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
        let error = port.poll(Port::Host, received).err()?;
        Some(self.give_up(now_us, &error))
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
