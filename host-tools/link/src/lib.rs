//! Client of a backseat board: its five ports, and the host link over one of them.
//!
//! | module | |
//! |---|---|
//! | [`Ports`] | the five byte streams: of a board on serial ports, a process on pseudo-terminals, a simulator |
//! | [`Client`] | the host link over such ports: parameters, mission, lock-step, session log |
//! | [`named`] | what a board names of what has changed, in words |
//! | [`image`] | an image of the firmware, as cargo builds it |
//! | [`board`] | a board on the bench or on deck, over its host port alone |

pub mod board;
mod client;
pub mod image;
pub mod named;
mod output;
mod port_name;
mod process;
mod pty;
mod serial;
mod tap;
mod tape;

pub use client::Client;
pub use output::{ReportedFusion, StepOutput};
pub use process::Process;
pub use pty::Pty;
pub use serial::Serial;
pub use tap::Tap;

use backseat_logs::DataError;
use backseat_logs::session::Event;
use backseat_wire::hostlink::{Port, Refusal, ResetCause};
use std::io;
use std::process::ExitStatus;
use std::time::Duration;

/// Bytes and the time at which the last of them has arrived, µs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Arrival {
    /// Arrival of the last byte, µs.
    pub time_us: u64,
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// Why a board starts again, and in what state it finds its memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reset {
    /// Why.
    pub cause: ResetCause,
    /// So many of the two copies of its parameters were corrupted in the meantime.
    pub corrupted: u8,
}

/// Why a backseat cannot be flown any further.
#[derive(Debug, thiserror::Error)]
pub enum BackseatError {
    /// Its process ended.
    #[error("the backseat process ended ({0})")]
    Died(ExitStatus),
    /// The emulated board ended.
    #[error("the ARM image ended ({status}): {message}")]
    Ended {
        /// Its exit code: 101 panic, 102 fault, 103 unexpected interrupt.
        status: ExitStatus,
        /// Its last message.
        message: String,
    },
    /// It stopped answering.
    #[error("the backseat sent nothing on its {port:?} port for {seconds} s")]
    Silent {
        /// The port that was read.
        port: Port,
        /// For how long.
        seconds: u32,
    },
    /// It sent something, but not the answer.
    #[error("the backseat sent data, but no answer within {seconds} s")]
    Unanswered {
        /// How long was waited.
        seconds: u32,
    },
    /// Its answer does not fit the request.
    #[error("unexpected answer of the backseat: {0}")]
    Protocol(String),
    /// It refused a request.
    #[error("the backseat refused {request}: {}", board::reason(*refusal))]
    Refused {
        /// What was asked.
        request: String,
        /// Why not.
        refusal: Refusal,
    },
    /// A port failed.
    #[error("{port:?} port: {error}")]
    Port {
        /// Which.
        port: Port,
        /// How.
        error: io::Error,
    },
    /// Only the app in this process can be reset by a scenario.
    #[error("the scenario resets the board, which the backseat `host` alone lets it")]
    CannotReset,
    /// The session log could not be written.
    #[error(transparent)]
    Session(#[from] DataError),
}

/// The five byte streams of a backseat.
pub trait Ports {
    /// Hands all of `bytes` to a port.
    ///
    /// # Errors
    /// When the backseat is gone or takes no more.
    fn write(&mut self, port: Port, bytes: &[u8]) -> Result<(), BackseatError>;

    /// Appends what a port has sent to `received`, waiting for at least one byte.
    ///
    /// # Errors
    /// When the backseat is gone or silent.
    fn read(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError>;

    /// Appends what a port has sent to `received`, without waiting.
    ///
    /// # Errors
    /// When the backseat is gone.
    fn poll(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError>;

    /// An answer comes within this time, whatever else is sent.
    fn patience(&self) -> Duration {
        Duration::from_secs(10)
    }

    /// Resets the board: what is not in its memory is forgotten. Returns what a session needs to do it again: the start
    /// and the parameters that the board found.
    ///
    /// # Errors
    /// When that is not in this program's power.
    fn reset(&mut self, _: Reset) -> Result<Vec<Event>, BackseatError> {
        Err(BackseatError::CannotReset)
    }
}

impl<P: Ports + ?Sized> Ports for Box<P> {
    fn write(&mut self, port: Port, bytes: &[u8]) -> Result<(), BackseatError> {
        (**self).write(port, bytes)
    }

    fn read(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        (**self).read(port, received)
    }

    fn poll(&mut self, port: Port, received: &mut Vec<u8>) -> Result<(), BackseatError> {
        (**self).poll(port, received)
    }

    fn patience(&self) -> Duration {
        (**self).patience()
    }

    fn reset(&mut self, reset: Reset) -> Result<Vec<Event>, BackseatError> {
        (**self).reset(reset)
    }
}

/// Text of a device: control characters, which a terminal would obey, as escapes.
#[must_use]
pub fn printable(text: &str) -> String {
    let escaped = |c: char| if c.is_control() { c.escape_default().collect() } else { String::from(c) };
    text.chars().map(escaped).collect()
}
